"""Nodes that are held along the normal of a tool which presses them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.checks.thresholds import ALONG, NO_DIFFERENCE, SLIGHT
from prensa.contact.surface import Surface
from prensa.errors import Finding, Severity, coordinates
from prensa.mesh.faces import facing
from prensa.model import problem as model
from prensa.system.moments import Moment, contact_path
from prensa.system.system import System
from prensa.types import Array


class Pressed(NamedTuple):
    """A held node that a tool presses in: the largest ``depth``, at time t, the axis along which it is held, and the way (1 or
    −1) along it in which the tool looks.
    """

    depth: float
    t: float
    node: int
    axis: int
    looks: float


NOT_PRESSED = Pressed(0.0, 0.0, 0, 0, 0.0)


def held(system: System, s: Surface, i: int, m: Moment, x: Array, pressed: dict[tuple[int, int], Pressed]) -> None:
    """Nodes of the body that are held along the normal of a tool which reaches into them."""
    field = system.dofs.displacement
    nodes, axis = field.split(m.plan.fixed[field.owns(m.plan.fixed)])
    mine = system.has(s.body, nodes)
    nodes, axis = nodes[mine], axis[mine]
    if not len(nodes):
        return
    master, d = system.tool_masters[s.against], system.dofs.dimension
    place, pairs = master.place(m.u)[:d], master.seen(x[nodes], m.u)
    h = float(s.points.depth.min())
    deep = (pairs.g < -SLIGHT * h) & (np.abs(pairs.n[np.arange(len(nodes)), axis]) > ALONG)
    if not deep.any():
        return
    # beside the contact surface, a tool that came across the normal has pushed the free body ahead of it
    came = pairs.n @ place >= -0.5 * pairs.g
    # deep in a tool that is as narrow as its travel is long, its side may be nearer than the face that came
    across = np.abs(pairs.n @ place) < 0.5 * np.linalg.norm(place)
    own = s.touching
    came |= np.isin(nodes, own) & (master.shape.half_space | ~across)
    # what is free across its support goes along with a tool that comes that way, down a bore under a fillet, say
    free = ~np.isin(field.dofs(nodes), m.plan.fixed)
    beside = x[nodes] + place * free
    came &= ~free.any(axis=1) | (master.seen(beside, m.u).g < -SLIGHT * h)
    for k in np.flatnonzero(deep & came):
        # Negative numbers: nodes that are no candidates of the contact, of which `deepest` keeps account apart.
        key = (i, int(nodes[k]) if nodes[k] in own else -1 - int(nodes[k]))
        if -pairs.g[k] > pressed.get(key, NOT_PRESSED).depth:
            pressed[key] = Pressed(float(-pairs.g[k]), m.t, int(nodes[k]), int(axis[k]), float(np.sign(pairs.n[k, axis[k]])))


def deepest(pressed: dict[tuple[int, int], Pressed]) -> dict[tuple[int, int], Pressed]:
    """The deepest node of each contact, candidates and others apart."""
    worst: dict[tuple[int, int], Pressed] = {}
    for (i, k), entry in pressed.items():
        key = (i, 1 if k >= 0 else -1)
        worst[key] = max(worst.get(key, NOT_PRESSED), entry)
    return worst


def overconstrained(system: System, s: Surface, i: int, most: Pressed, candidate: bool) -> Finding:
    """What there is to say of a held node that a tool presses; ``candidate``: it is one of the contact surface (number i)."""
    depth, t, node = most.depth, most.t, most.node
    where = f"node {node - system.offsets[s.body]} of {s.body!r} at ({coordinates(system.X[node])})"
    tool = s.against
    against = _facing_support(system, s, most)
    if candidate or against:
        advice, meant = (f"remove {against!r} from the supports", "") if against else _advice_to_release(system, s, most)
        return Finding(
            contact_path(system, i),
            f"{where} is held along the normal of tool {tool!r}, which presses it in by {depth:.4g} until time {t:.4g}: the two "
            f"contradict each other; {advice}",
            Severity.REFUSE,
            support=meant,
        )
    return Finding(
        contact_path(system, i),
        f"tool {tool!r} reaches {depth:.4g} beyond {where} at time {t:.4g}, which a support holds: is its travel larger than "
        "the body?",
        Severity.REFUSE
        if system.problem.kinematics == "finite" and system.tool_masters[s.against].shape.half_space
        else Severity.WARN,
    )


def _supports_there(system: System, s: Surface, most: Pressed) -> dict[str, model.Fixed]:
    """Supports of the sides and points of a held node that hold it along the axis in question, up to the time in question."""
    mesh, own = system.meshes[s.body], most.node - system.offsets[s.body]
    there: dict[str, model.Fixed] = {}
    begun: list[model.Problem | model.Step] = [system.problem, *system.problem.steps[: int(np.ceil(most.t))]]
    for owner in begun:
        for name, support in owner.fixed.items():
            body, _, side = name.partition(".")
            of_side = mesh.edges[side] if side in mesh.edges else np.array([mesh.corners.get(side, -1)])
            if body == s.body and own in of_side and getattr(support, "xyz"[most.axis]) is not None:
                there[name] = support
    return there


def _facing_support(system: System, s: Surface, most: Pressed) -> str:
    """The one support of a node that holds a side which looks at the tool and is in none of its contacts; '' if there is none.

    Without 'contacts' a tool has none with sides that are held: it would go through this one, and no travel is too long.
    """
    mesh, normal = system.meshes[s.body], most.looks * np.eye(system.dofs.dimension)[most.axis]
    sides = {name: name.partition(".")[2] for name in _supports_there(system, s, most) if name not in s.description.surface}
    flat = {name: mesh.edges[side] for name, side in sides.items() if side in mesh.edges}
    looking = [name for name, edges in flat.items() if facing(mesh.points, edges, normal) < -ALONG]
    return looking[0] if len(looking) == 1 and s.body in s.description.surface else ""


def _advice_to_release(system: System, s: Surface, most: Pressed) -> tuple[str, str]:
    """What to do about a node of a contact surface that a support holds: by the support, which may be one beside the surface.

    With the support that is meant where one of a flat side acts along the side alone, and a plane of symmetry holds it across.
    """
    beside = _supports_there(system, s, most)
    if len(beside) != 1 or s.body in s.description.surface or set(beside) & set(s.description.surface):
        return "take the support off the contact surface, or let it act along the surface only", ""
    ((name, support),) = beside.items()
    if sum(getattr(support, axis) is not None for axis in "xyz") == 1:
        flat = np.ptp(system.X[system.boundary_nodes(name)], axis=0) <= NO_DIFFERENCE * system.length
        if flat.sum() == 1 and not flat[most.axis]:
            meant = f"{name}: {'xyz'[int(np.argmax(flat))]}"
            instead = f"write '{meant}' if that is a plane of symmetry, or else "
            return f"{instead}remove the support {name!r}, or keep the tool off it", meant
        return f"remove the support {name!r}, or keep the tool off it", ""
    return f"support {name!r}, which meets the contact surface there, only along that surface, or keep the tool off it", ""
