"""Checks of the files of a run by plain geometry and statics: nothing here is shared with the solver.

Every check answers '' or, in words, what is wrong. Forces at nodes are the pressures and shears of the contact tables times
tributary areas of the deformed outline, along normals of the tools' outlines (`prensa_bench.robustness.outlines`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

import prensa as pr
from prensa.types import Array, Index
from prensa_bench.robustness.cells_in_space import contact_points
from prensa_bench.robustness.drawn import Drawn, Placed
from prensa_bench.robustness.files import Record, Shape

SAME_GAP = 1e-6  # difference of a gap from the own one, of the size of the body
DEEP, DEEP_BY_PRESSURE = 2e-3, 0.1  # allowed penetration in elements, and that for each p/E
LOBATTO = 0.6  # of a quadratic side that begins on the axis, where what its middle is said to bear acts
FORCES, MOMENTS = 1e-5, 1e-4  # allowed imbalance of the largest force so far, and of that times the size
FORCES_WHOLE = 1e-7  # and of the largest force of the whole run
WORK = 1e-6  # allowed difference of the work, and fall of a dissipation, of the largest energy
LOST = 1e-3  # of an energy at a new mesh, and of the work by the jumps of forces at all of them
DRIFT = 2e-3  # of the volume by what integration points know of it, on meshes that are made anew
ENHANCED = 0.5  # of the square of an hourglass: volume that enhanced strains give it, a third of it and what is of higher order
REACHED = 1e-6  # allowed distance from the asked place or force, of the largest
LONG = {3: (0, 1, 2), 4: (0, 1, 2, 3), 6: (0, 3, 1, 4, 2, 5), 8: (0, 4, 1, 5, 2, 6, 3, 7)}


def wrong_with(d: Drawn, records: list[Record]) -> str:
    """What is wrong with the runs of the stages of a problem; '' if nothing is found."""
    for record in records:
        for check in (outlines, friction, balance, moments, driven, energy, elements, volume):
            if found := check(d, record):
                return found
    return next((found for claim in d.claims if (found := claim(records[-1]))), "")


# ---------------------------------------------------------------------------------------------------------------- geometry
class Touching(NamedTuple):
    """A contact at one increment: nodes (k,), their own gaps ``at_node``; places x (k, 2) where pressures act, own gaps there.

    Normals there, tributary areas, forces on the body, sizes of sides; ``pressed_as`` (k,): number of the node that is given the
    same pressure, usually the own one.
    """

    nodes: Index
    at_node: Array
    x: Array
    gap: Array
    normal: Array
    area: Array
    force: Array
    size: Array
    pressed_as: Index


def seen_by(tool: Placed, name: str, record: Record, row: int, x: Array) -> tuple[Array, Array]:
    """Signed distance (k,) of points to a tool where the history says that it is, and outward normals (k, 2)."""
    ux, uy, rz = (record.history[f"{name}.{c}"][row] for c in ("ux", "uy", "rz"))
    c, s = np.cos(rz), np.sin(rz)
    turn = np.array([[c, -s], [s, c]])
    gap, n = tool.outline((x - np.asarray(tool.at) - (ux, uy)) @ turn)
    return gap, n @ turn.T


def outer_edges(cells: Index) -> Index:
    """Sides (b, 2) or (b, 3), with their mid-side node in the middle, that belong to one cell only; body on the left."""
    ring = cells[:, LONG[cells.shape[1]]]
    step = 2 if cells.shape[1] > 4 else 1
    closed = np.hstack([ring, ring[:, :1]])
    parts = [closed[:, k : k + step + 1] for k in range(0, ring.shape[1], step)]
    sides = np.vstack(parts)
    key = np.sort(sides[:, [0, -1]], axis=1)
    _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    return sides[first[count == 1]]


def tributary(sides: Index, x: Array, thickness: float | None) -> Array:
    """∫ N dΓ (n,) of the nodes on sides of a shape x (n, 2), straight between neighbours; thickness None: 2πr.

    Quadratic sides that begin on the axis have the weights of the Lobatto rule at 0, 3/5 and 1 instead: those that integrate
    the same three N, whose integrals are 0, w and w'.
    """
    area = np.zeros(len(x))
    a, b = x[sides[:, 0]], x[sides[:, -1]]
    if sides.shape[1] == 2:
        L = np.hypot(*(b - a).T)
        if thickness is None:
            np.add.at(area, sides[:, 0], 2 * np.pi * L * (2 * a[:, 0] + b[:, 0]) / 6)
            np.add.at(area, sides[:, 1], 2 * np.pi * L * (a[:, 0] + 2 * b[:, 0]) / 6)
        else:
            np.add.at(area, sides.ravel(), np.repeat(0.5 * L * thickness, 2))
        return area
    # the quadratic N by Simpson's rule, a third of each straight piece at its corner and the rest in the middle
    m = x[sides[:, 1]]
    deep = np.full(len(x), thickness) if thickness is not None else 2 * np.pi * x[:, 0]
    first, second = np.hypot(*(m - a).T), np.hypot(*(b - m).T)
    for node, length in zip(sides.T, (first / 3, 2 * (first + second) / 3, second / 3)):
        np.add.at(area, node, length * deep[node])
    at_axis = beginning_on_axis(sides, x) if thickness is None else sides[:0]
    middle = area[at_axis[:, 1]].copy()
    here = quadratic(LOBATTO)
    for k, node in enumerate(at_axis.T):
        area[node] += middle / here[1] * ((1.0 if k == 1 else 0.0) - here[k])
    return area


def quadratic(s: float) -> Array:
    """The three shape functions of a side at s, 0 … 1: of its ends and, in the middle, of its mid-side node."""
    return np.array([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])


def beginning_on_axis(sides: Index, x: Array) -> Index:
    """Those of quadratic sides (b, 3) that have one end on the axis of revolution, that end first."""
    on = x[:, 0] <= 1e-12 * x[:, 0].max()
    both = np.vstack([sides, sides[:, ::-1]])
    return both[on[both[:, 0]] & ~on[both[:, 2]]] if sides.shape[1] == 3 else sides[:0]


def bearing(sides: Index, x: Array) -> Array:
    """Where (n, 2) what nodes are said to bear acts on a body of revolution: at them, but for middles of sides at the axis."""
    out = x.copy()
    at_axis = beginning_on_axis(sides, x)
    if len(at_axis):
        out[at_axis[:, 1]] = np.einsum("k,bkd->bd", quadratic(LOBATTO), x[at_axis])
    return out


def touchings(d: Drawn, record: Record) -> Iterator[tuple[int, str, pr.Contact, Touching]]:
    """Row of the history, name, description and own view of every contact table, in the order of time."""
    shape = next(iter(record.bodies.values()), {})
    thickness = None if record.problem.space == "axisymmetric" else record.problem.thickness
    sides = {name: outer_edges(s.cells) for name, s in shape.items()}
    for row, number in enumerate(record.history.get("increment", np.zeros(0)).astype(int)):
        if remeshed(record):
            shape = record.bodies[number]
            sides = {name: outer_edges(s.cells) for name, s in shape.items()}
        for c in record.problem.contacts:
            t = record.contacts[c.name][number]
            body = c.surface[0].partition(".")[0]
            nodes, x = t["node"].astype(np.int64), np.full_like(shape[body].X, np.nan)
            x[nodes] = np.stack([t["x"], t["y"]], axis=1)
            own = sides[body][np.isin(sides[body], nodes).all(axis=1)]
            area = tributary(own, np.nan_to_num(x), thickness)[nodes]
            at_node, _ = seen_by(d.tools[c.against], c.against, record, row, x[nodes])
            place = (bearing(own, np.nan_to_num(x)) if thickness is None else x)[nodes]
            gap, n = seen_by(d.tools[c.against], c.against, record, row, place)
            along = np.stack([-n[:, 1], n[:, 0]], axis=1)
            force = area[:, None] * (t["pressure"][:, None] * n + t["shear"][:, None] * along)
            size = _beside(own, np.nan_to_num(x))[nodes]
            together = np.arange(len(x))
            for pair in beginning_on_axis(own, np.nan_to_num(x))[:, :2] if thickness is None else ():
                together[pair] = pair[::-1]
            same = np.argsort(nodes)[np.searchsorted(np.sort(nodes), together[nodes])]
            yield row, c.name, c, Touching(nodes, at_node, place, gap, n, area, force, size, same)


def tells_forces(problem: pr.Problem) -> bool:
    """Whether pressures at nodes, times areas of the outline, are the forces.

    In plane stress areas have a thickness that changes; rules of other points have other normals than those at nodes.
    """
    return problem.space != "plane stress" and all(c.integration == "nodal" for c in problem.contacts)


def remeshed(record: Record) -> bool:
    """Whether every increment may have a mesh of its own."""
    return record.problem.remesh != "off"


def _beside(sides: Index, x: Array) -> Array:
    """Length (n,) of the longest side at a node."""
    out = np.zeros(len(x))
    L = np.hypot(*(x[sides[:, -1]] - x[sides[:, 0]]).T)
    for k in range(sides.shape[1]):
        np.maximum.at(out, sides[:, k], L)
    return out


def size_of(record: Record) -> float:
    """The largest extent of a body as it was drawn."""
    first = next(iter(record.bodies.values()))
    return max(float(np.ptp(s.X, axis=0).max()) for s in first.values())


def outlines(d: Drawn, record: Record) -> str:
    """The outlines against the tools: gaps are what they are said to be, no node lies inside a tool, no pressure across a gap."""
    if not record.bodies:
        return "no fields were written"
    longest = max(float(np.ptp(s.x[s.cells], axis=1).max()) for shapes in record.bodies.values() for s in shapes.values())
    size, E = size_of(record), d.E or min(body.material.modulus for body in d.problem.bodies.values())
    for row, name, c, t in touchings(d, record):
        table = record.contacts[name][int(record.history["increment"][row])]
        at, p = f"time {record.history['time'][row]:.4g}: {name}", table["pressure"]
        near = np.isfinite(table["gap"]) & (np.abs(t.at_node) < 0.5 * t.size)
        if near.any() and (off := float(np.abs(table["gap"] - t.at_node)[near].max())) > SAME_GAP * size:
            return f"{at}: a gap is {off:.2g} off the distance of its node to the tool"
        allowed = DEEP * t.size + DEEP_BY_PRESSURE * np.maximum(p, 0.0) / E * t.size
        if (p < 0).any():
            return f"{at}: negative pressure"
        if c.integration != "nodal":  # what other rules ask for holds at their points, which the tables by node do not tell
            continue
        if (t.gap < -allowed).any():
            k = int(np.argmin(t.gap + allowed))
            return f"{at}: node {t.nodes[k]} lies {-t.gap[k]:.3g} inside the tool"
        least = np.minimum(t.gap, t.gap[t.pressed_as])
        slack = getattr(c.enforcement, "tolerance", 0.0) * longest  # what the augmented form leaves
        if (least[p > 0] > SAME_GAP * size + slack).any():
            return f"{at}: pressure across an open gap of {least[p > 0].max():.3g}"
    between = {c.against for c in record.problem.contacts if c.integration != "nodal"}  # nodes beside their points go deeper
    tools = {name: tool for name, tool in d.tools.items() if name not in between}
    return bodies_outside(tools, record, outer_edges, _beside, seen_by)


def bodies_outside(
    tools: Mapping[str, Placed], record: Record, outside: Callable[[Index], Index], beside: Callable[[Index, Array], Array],
    seen: Callable[[Placed, str, Record, int, Array], tuple[Array, Array]],
) -> str:  # fmt: skip
    """Every node on the outside of every body that a contact can be at, listed in one or not, against tools.

    ``outside``: sides of cells that are of one alone; ``beside`` (n,): longest length of these at nodes; ``seen``: distances.
    """
    rows = {int(n): k for k, n in enumerate(record.history["increment"])}
    for number, shapes in record.bodies.items():
        for body, s in shapes.items():
            outer = outside(s.cells)
            nodes, h = np.unique(contact_points(outer)), beside(outer, s.x)
            for name, tool in tools.items():
                gap, _ = seen(tool, name, record, rows[number], s.x[nodes])
                # pressures of nodes of contacts are known and judged there: what is meant here is a missing contact
                if (gap < -10 * DEEP * h[nodes]).any():
                    k = int(np.argmin(gap))
                    return f"increment {number}: node {nodes[k]} of {body} lies {-gap[k]:.3g} inside {name}"
    return ""


# ------------------------------------------------------------------------------------------------------------------ statics
def friction(d: Drawn, record: Record) -> str:
    """|shear| is at most the coefficient times the pressure."""
    for c in record.problem.contacts:
        name = c.name
        for number, t in record.contacts[name].items() if c.integration == "nodal" else ():
            bound = d.mu[name] * t["pressure"]
            over = np.abs(t["shear"]) - bound
            if (over > 1e-6 * max(float(bound.max(initial=0.0)), 1e-9 * float(t["pressure"].max(initial=0.0)))).any():
                return f"increment {number}: {name}: shear is {over.max():.3g} above its bound"
    return ""


def balance(d: Drawn, record: Record) -> str:
    """Nodal contact forces against the force on each tool, tools against supports."""
    h, axi = record.history, record.problem.space == "axisymmetric"
    axes = ("fy",) if axi else ("fx", "fy")
    n = len(h["time"])
    tool = {t: np.stack([h[f"{t}.{c}"] for c in axes], axis=1) for t in record.problem.tools}
    held = sum((np.stack([v for k, v in h.items() if k.startswith("fixed.") and k.endswith(c)], axis=1).sum(axis=1)[:, None]
                * (np.array(axes) == c) for c in axes if any(k.startswith("fixed.") and k.endswith(c) for k in h)),
               np.zeros((n, len(axes))))  # fmt: skip
    nodal = {t: np.zeros((n, len(axes))) for t in tool}
    for row, _, c, t in touchings(d, record):
        nodal[c.against][row] += t.force.sum(axis=0)[1 if axi else 0 :]
    largest = np.maximum.accumulate(np.max([np.abs(v).max(axis=1) for v in tool.values()], axis=0))
    allowed = FORCES * largest + FORCES_WHOLE * largest.max()
    for name, f in tool.items() if tells_forces(record.problem) else ():
        off = np.abs(nodal[name] + f).max(axis=1)
        if (off > allowed).any():
            k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
            return f"time {h['time'][k]:.4g}: forces at the nodes miss that on {name} by {off[k] / largest[k]:.1e}"
    off = np.abs(sum(tool.values()) - held).max(axis=1)
    if (off > allowed).any():
        k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
        return f"time {h['time'][k]:.4g}: tools and supports are out of balance by {off[k] / largest[k]:.1e}"
    return ""


def moments(d: Drawn, record: Record) -> str:
    """Moments about the origin: nodal contact forces against each tool, and all tools against the reactions at the nodes."""
    if record.problem.space == "axisymmetric":
        return ""
    h, size = record.history, size_of(record)
    on_tool: dict[str, Array] = {t: np.zeros(len(h["time"])) for t in record.problem.tools}
    for row, _, c, t in touchings(d, record):
        on_tool[c.against][row] += (t.x[:, 0] * t.force[:, 1] - t.x[:, 1] * t.force[:, 0]).sum()
    moments = {}
    for name in on_tool:
        at = np.asarray(d.tools[name].at)
        x, y = at[0] + h[f"{name}.ux"], at[1] + h[f"{name}.uy"]
        moments[name] = h[f"{name}.mz"] + x * h[f"{name}.fy"] - y * h[f"{name}.fx"]
    force = np.max([np.hypot(h[f"{t}.fx"], h[f"{t}.fy"]) for t in on_tool], axis=0)
    reach = max([size, *(float(np.linalg.norm(d.tools[t].at)) for t in on_tool)])
    largest = np.maximum.accumulate(force)
    allowed = (MOMENTS * largest + FORCES_WHOLE * largest.max()) * reach
    for name in on_tool if tells_forces(record.problem) else ():
        off = np.abs(on_tool[name] + moments[name])
        if (off > allowed).any():
            k = int(np.argmax(off / np.maximum(allowed, 1e-300)))
            return f"time {h['time'][k]:.4g}: moments at the nodes miss that on {name} by {off[k] / (largest[k] * reach):.1e}"
    rows = {int(v): k for k, v in enumerate(h["increment"])}
    for number, shapes in record.bodies.items():
        k = rows[number]
        held = sum(float((s.x[:, 0] * s.reaction[:, 1] - s.x[:, 1] * s.reaction[:, 0]).sum()) for s in shapes.values())
        if abs(off_ := sum(m[k] for m in moments.values()) - held) > allowed[k]:
            return f"time {h['time'][k]:.4g}: moments of tools and supports differ by {off_ / (largest[k] * reach):.1e}"
    return ""


def driven(d: Drawn, record: Record) -> str:
    """At the end of each step a tool is where it was to go, and bears the force that it was to bear."""
    h = record.history
    last = {name: k for k, name in enumerate(record.steps)}
    if [s.name for s in record.problem.steps] != list(dict.fromkeys(record.steps)):
        return f"steps {list(dict.fromkeys(record.steps))} were made of {[s.name for s in record.problem.steps]}"
    for step in record.problem.steps:
        k = last[step.name]
        for name, asked in [*step.move.items(), *step.push.items()]:
            moves = hasattr(asked, "rz")
            for key, column in (
                (("x", "ux"), ("y", "uy"), ("rz", "rz")) if moves else (("x", "fx"), ("y", "fy"), ("m", "mz"))
            ):
                value = getattr(asked, key)
                if not isinstance(value, float | int):
                    continue
                found, whole = h[f"{name}.{column}"], np.abs(h[f"{name}.{column}"]).max()
                if not moves:
                    value, whole = (
                        -value,
                        max(whole, np.abs(h[f"{name}.fy"]).max() * (1.0 if key != "m" else size_of(record))),
                    )
                if abs(found[k] - value) > REACHED * max(whole, abs(value)):
                    return f"step {step.name!r}: {name}.{column} is {found[k]:.6g} where {value:.6g} was asked"
    return ""


def energy(d: Drawn, record: Record) -> str:
    """Dissipated energy never falls, and the energy balance's work is that of forces and paths of the history.

    But for what pushed tools do on their way through air, of which the history has both ends alone.
    """
    h = record.history
    parts = ("external", "elastic", "plastic", "friction", "contact")
    whole = max(float(np.abs(h[f"energy.{e}"]).max()) for e in parts)
    anew = np.diff(h["remeshings"], prepend=0) > 0 if remeshed(record) else np.zeros(len(h["time"]), dtype=bool)
    for e in ("plastic", "friction"):
        change = np.diff(h[f"energy.{e}"], prepend=min(0.0, h[f"energy.{e}"][0]))
        fall = -np.where(anew, change + LOST * whole, change).min()
        if fall > WORK * whole:
            return f"{e} work falls by {fall:.2e} of {whole:.2e}"
    if record.problem.start is not None or any(s.fixed for s in record.problem.steps):
        return ""  # supports may have moved, or a force is released
    work = np.zeros(len(h["time"]))
    for name in record.problem.tools:
        for f, u in (("fx", "ux"), ("fy", "uy"), ("mz", "rz")):
            if record.problem.space == "axisymmetric" and f != "fy":
                continue
            force, way = (np.concatenate([[0.0], h[f"{name}.{c}"]]) for c in (f, u))
            work -= np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(way))
    more = work - h["energy.external"]
    off = float(np.maximum(-more, more - np.cumsum(through_air(record))).max())
    allowed = WORK + (LOST if remeshed(record) else 0.0)
    return f"external work is {off:.2e} off forces times paths, {whole:.2e}" if off > allowed * whole else ""


def through_air(record: Record) -> Array:
    """The most (rows,) that forces times paths of pushed tools are in an increment in which they first touch: all of it."""
    h, problem = record.history, record.problem
    step = np.clip(np.ceil(h["time"]).astype(np.int64) - 1, 0, len(problem.steps) - 1)  # step k spans times k − 1 to k
    out = np.zeros(len(step))
    for name in problem.tools:
        area = sum((h[f"{c.name}.area"] for c in problem.contacts if c.against == name), np.zeros(len(out)))
        lands = (area > 0) & (np.concatenate([[0.0], area[:-1]]) == 0) & [name in problem.steps[k].push for k in step]
        for f, u in (("fx", "ux"), ("fy", "uy"), ("mz", "rz")):
            force, way = (np.concatenate([[0.0], h[f"{name}.{c}"]]) for c in (f, u))
            out += np.where(lands, np.abs(0.5 * (force[1:] + force[:-1]) * np.diff(way)), 0.0)
    return out


# ------------------------------------------------------------------------------------------------------------------- volume
def areas(cells: Index, x: Array) -> Array:
    """Areas (m,) of cells by the shoelace formula; a curved side adds 4/3 of the triangle over its chord (Archimedes)."""
    return volumes(cells, x, axisymmetric=False)


def volumes(cells: Index, x: Array, axisymmetric: bool) -> Array:
    """Areas (m,), or volumes of revolution: 2π ∮ ½ r² dz (Green), curved sides by the radius of their middle."""
    corners = 3 if cells.shape[1] in (3, 6) else 4
    a = x[cells[:, :corners]]
    b = np.roll(a, -1, axis=1)
    r2 = a[..., 0] ** 2 + a[..., 0] * b[..., 0] + b[..., 0] ** 2
    flat = np.pi / 3 * r2 * (b - a)[..., 1] if axisymmetric else 0.5 * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
    if cells.shape[1] > corners:
        m = x[cells[:, corners:]]
        v, w = m - a, b - a
        bulge = 2 / 3 * (v[..., 0] * w[..., 1] - v[..., 1] * w[..., 0])
        flat = flat + bulge * (2 * np.pi * m[..., 0] if axisymmetric else 1.0)
    return np.asarray(flat.sum(axis=1))


def elements(d: Drawn, record: Record) -> str:
    """Every element has an area."""
    for number, shapes in record.bodies.items():
        for body, s in shapes.items():
            if (areas(s.cells, s.x) <= 0).any():
                return f"increment {number}: an element of {body} has no area"
    return ""


def deformation(s: Shape) -> Array:
    """The linear map (m, 2, 2) that fits the corners of each cell best."""
    n = 3 if s.cells.shape[1] in (3, 6) else 4
    X, x = (v[s.cells[:, :n]] - v[s.cells[:, :n]].mean(axis=1, keepdims=True) for v in (s.X, s.x))
    return np.asarray(np.einsum("mai,maj->mij", x, X) @ np.linalg.inv(np.einsum("mai,maj->mij", X, X)))


def strains(s: Shape) -> Array:
    """Largest logarithmic strain (m,) of the corners' mean deformation and of the sides of each cell."""
    mean = np.abs(np.log(np.maximum(np.linalg.svd(deformation(s), compute_uv=False), 1e-12))).max(axis=1)
    # bending inside a cell: what its sides have stretched by
    ring = s.cells[:, LONG[s.cells.shape[1]]]
    before, now = (np.linalg.norm(np.roll(v[ring], -1, axis=1) - v[ring], axis=-1) for v in (s.X, s.x))
    return np.maximum(mean, np.abs(np.log(now / before)).max(axis=1))


def hourglass(s: Shape) -> Array:
    """Squares (m,) of the strains that vary within quadrilaterals: A⁻¹h of x = A ξ + h ξη, without the h they began with."""
    corner = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    X, x = (v[s.cells] - v[s.cells].mean(axis=1, keepdims=True) for v in (s.X, s.x))
    F = deformation(s)
    A = F @ np.einsum("mai,aj->mij", X, corner) / 4
    h = np.einsum("mai,a->mi", x - np.einsum("mij,maj->mai", F, X), corner.prod(axis=1)) / 4
    return np.asarray((np.linalg.solve(A, h[..., None]) ** 2).sum(axis=(1, 2)))


def uneven(s: Shape) -> float:
    """What the volume of a body of revolution is from the middles of its cells less what it is, relative: its mesh's doubt."""
    middle = np.linalg.det(deformation(s)) * s.x[s.cells, 0].mean(axis=1) / s.X[s.cells, 0].mean(axis=1)
    V0 = volumes(s.cells, s.X, axisymmetric=True)
    return float(abs((middle * V0).sum() - volumes(s.cells, s.x, axisymmetric=True).sum()) / V0.sum())


def volume(d: Drawn, record: Record) -> str:
    """The volume of a body has changed by what the forces on its outline say: ∫ tr σ dV = Σ f·x (virial theorem).

    Out of the plane σzz is ν(σxx + σyy) where a plane body is elastic; it differs from half their sum by no more than the
    flow stress (σxx = σyy: a body unloaded from all sides but that one).
    """
    p = record.problem
    if d.E == 0.0 or not tells_forces(p):
        return ""
    axi = p.space == "axisymmetric"
    rows = {int(v): k for k, v in enumerate(record.history["increment"])}
    forces: dict[int, dict[str, float]] = {n: {b: 0.0 for b in p.bodies} for n in record.bodies}
    centre = {n: {b: s.x.mean(axis=0) * (0.0 if axi else 1.0) for b, s in v.items()} for n, v in record.bodies.items()}
    of_row = {k: n for n, k in rows.items()}
    for row, _, c, t in touchings(d, record):
        if (n := of_row[row]) in forces:
            body = c.surface[0].partition(".")[0]
            forces[n][body] += float((t.force * (t.x - centre[n][body])).sum())
    for n, shapes in record.bodies.items():
        for body, s in shapes.items():
            virial = forces[n][body] + float((s.reaction * (s.x - centre[n][body])).sum())
            V0, V = (float(volumes(s.cells, x, axi).sum()) * (1.0 if axi else p.thickness) for x in (s.X, s.x))
            if remeshed(record):  # initial places of later meshes are interpolated ones
                first = next(iter(record.bodies.values()))[body]
                V0 = float(volumes(first.cells, first.X, axi).sum()) * (1.0 if axi else p.thickness)
            per = (1 - 2 * d.nu) / d.E / V
            trace = virial * (1.0 if axi else 1.5 if d.strength else 1 + d.nu)
            free = 0.0 if axi or not d.strength else 0.5 * abs(virial) * (1 - 2 * d.nu) + d.strength * V
            # beyond first order: J - 1 - ln J and Kirchhoff against Cauchy stress
            if remeshed(record):
                second = DRIFT
            else:
                second = 3.0 * float((strains(s) ** 2).mean()) * (1 - 2 * d.nu if d.strength == 0 else 0.0)
                second += 2.0 * uneven(s) if axi else 0.0  # a cell's integration points know its volume as its middle does
            second += 3.0 * (per * V * d.strength) ** 2
            if p.bodies[body].element == "q4_enhanced":
                second += ENHANCED * float(np.average(hourglass(s), weights=volumes(s.cells, s.X, axi)))
            off, allowed = V / V0 - 1 - per * trace, per * (free + 0.1 * abs(trace)) + second + 1e-9
            if abs(off) > allowed:
                return (
                    f"increment {n}: the volume of {body} has changed by {V / V0 - 1:.2e}, its forces say {per * trace:.2e} "
                    f"± {allowed:.1e}"
                )
    return ""
