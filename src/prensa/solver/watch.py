"""What equilibrium alone does not tell: answers that balance and yet are not what was asked for, and why none was found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prensa.fem.context import Context
from prensa.fem.modes import free_to_move
from prensa.fem.state import State
from prensa.fem.surface import Surface
from prensa.fem.system import Evaluation, System

if TYPE_CHECKING:
    from prensa.solver.newton import Reduced, Trial

Array = NDArray[np.float64]

OPPOSITE = -0.5  # cosine between the normals where a straight way enters and leaves a tool: it has been passed through
SHORT = 0.25  # way over element depth that passes through nothing
SUNK = 0.1  # penetration over element depth worth a warning
HIDDEN = 100.0  # a tool force below this many times the residual allowed is not a result


def passed_through(system: System, state: State, u: Array) -> str:
    """A contact point that got from one side of a tool to another in a single increment; '' if none did.

    Both ends of the increment are free of contact, so no residual can tell. Ways are straight in the frame of the tool.
    """
    for s in system.surfaces:
        tool, nodes, h = system.tools[s.tool], s.points.nodes, float(s.points.depth.min())
        start, end = (_in_tool(system, s, v) for v in (state.u, u))
        length = np.hypot(*(end - start).T)
        if length.max() < SHORT * h:
            continue
        share = np.linspace(0.0, 1.0, min(int(8 * length.max() / h) + 8, 256))
        way = start + share[:, None, None] * (end - start)
        close = tool.shape.closest(way.reshape(-1, 2))
        g, n = close.g.reshape(len(share), -1), close.n.reshape(way.shape)
        inside, each = g < 0, np.arange(len(nodes))
        enters, leaves = inside.argmax(axis=0), len(share) - 1 - inside[::-1].argmax(axis=0)
        opposite = (n[enters, each] * n[leaves, each]).sum(axis=1) < OPPOSITE
        through = inside.any(axis=0) & opposite & (np.minimum(g[0], g[-1]) > -0.05 * length)
        if through.any():
            k = int(np.flatnonzero(through)[0])
            x, y = system.positions(state.u)[nodes[k]]
            return (
                f"tool {tool.name!r} passed through node {nodes[k] - system.offsets[s.body]} of {s.body!r} at "
                f"({x:.4g}, {y:.4g}) in one increment"
            )
    return ""


def _in_tool(system: System, s: Surface, u: Array) -> Array:
    """Places (k, 2) of the nodes of a surface in the frame of its tool."""
    x, y, turn = u[system.tool_dof(s.tool) :][:3]
    c, d = np.cos(turn), np.sin(turn)
    return (system.positions(u)[s.points.nodes] - system.tools[s.tool].at - [x, y]) @ np.array([[c, -d], [d, c]])


def let_go(system: System, c: Context, e: Evaluation) -> str:
    """A body whose last contact opened in the increment though nothing else holds it; '' if there is none.

    Its place means nothing then. The matrix need not be singular for that: stresses that stay inside resist a turn.
    """
    for body in system.problem.bodies:
        mine = [(s, f) for s, f in zip(system.surfaces, e.contacts) if s.body in system.tied_bodies(body)]
        held = any((c.state.contact[s.rows, 3] > 0).any() for s, _ in mine)
        if held and not any((f.p > 0).any() for _, f in mine) and free_to_move(system, body, c, contacts=False):
            return f"body {body!r} is free to move, since its last contact has opened; support it"
    return ""


def leaning(system: System, c: Context) -> str:
    """A body that nothing but its contact with a single tool keeps in place, which can only push it away; '' if there is none.

    Loads may press it against the tool, so this is no error by itself; it is what a failed increment is most likely due to.
    """
    for body in system.problem.bodies:
        mine = [s for s in system.surfaces if s.body in system.tied_bodies(body)]
        touched = {system.tools[s.tool].name for s in mine if (c.state.contact[s.rows, 3] > 0).any()}
        if len(touched) == 1 and free_to_move(system, body, c, contacts=False):
            return f"body {body!r} is free to move: nothing but its contact with tool {touched.pop()!r} holds it"
    return ""


def doubts(system: System, c: Context, e: Evaluation, residual: float, tolerance: float) -> Iterator[str]:
    """Sentences about a converged increment that deserves less trust than its residual says."""
    forces = np.zeros((len(system.tools), 2))
    for s, f, scale in zip(system.surfaces, e.contacts, c.scales):
        forces[s.tool] += f.F[:, 2:4].sum(axis=0)
        depth = np.where(f.p > 0, -f.g / scale.h, 0.0)
        k = int(np.argmax(depth))
        if depth[k] > SUNK:
            x, node = s.X[k], s.points.support[k, np.argmax(s.points.N[k])]
            yield (
                f"contact {s.name}: node {node - system.offsets[s.body]} (initially at {x[0]:.4g}, {x[1]:.4g}) lies "
                f"{-f.g[k]:.3g} inside the tool, {depth[k]:.2g} of an element: raise its stiffness 'beta', or use 'augmented'"
            )
    for t, tool in enumerate(system.tools):
        size = float(np.hypot(*forces[t]))
        noise = HIDDEN * max(residual, tolerance) * e.scale
        if 0 < size < noise:
            yield (
                f"the force on tool {tool.name!r}, {size:.3g}, is not above what convergence leaves open ({noise:.3g}): much "
                f"larger forces are at work elsewhere (supports or tools that press against each other, Σ|f| = {e.scale:.3g}); "
                "remove them or lower 'tolerance'"
            )


def unmet(system: System, ever: NDArray[np.bool_]) -> Iterator[str]:
    """Tools of contacts that met nothing in a whole run; ever (points,): points that were closed at some increment's end."""
    for t, tool in enumerate(system.tools):
        mine = [s for s in system.surfaces if s.tool == t]
        if mine and not any(ever[s.rows].any() for s in mine):
            surfaces = ", ".join(repr("+".join(s.description.surface)) for s in mine)
            yield f"tool {tool.name!r} never touched {surfaces}: its forces are zero because it met nothing"


# ----------------------------------------------------------------------------------------------------------- post-mortem
_HINTS = (
    ("singular", "support the body or the tool in that direction, or hold it until contact does"),
    ("free to move", "support the body or the tool in that direction, or hold it until contact does"),
    (
        "inside out",
        "more 'increments', a mesh that is coarser or better shaped there, element q4_fbar; if a free side slides past the tool, "
        "make it part of the contact surface",
    ),
    ("folded over", "smaller increments; make the free side part of the contact surface, or support it"),
    ("flowed by", "a hardening flow curve, a larger fillet of the tool, a finer mesh there, more 'increments'"),
    ("softens too fast", "a smaller slope of mu, a larger 'beta_T', more 'increments'"),
    ("passed through", "more 'increments', or a shorter travel"),
    ("multipliers", "a larger 'beta', or 'penalty'"),
)
_HINT = (
    "more 'increments', a smaller motion per step, a larger fillet or a finer mesh where it happens, or less softening"
)


def hint(reason: str) -> str:
    """What to try against a reason of failure."""
    return next((text for key, text in _HINTS if key in reason), _HINT)


def where(system: System, c: Context, reduced: Reduced, trial: Trial) -> str:
    """Where the last iterate of a failed attempt is worst: node, element, contact and tool, with coordinates; '' unknown."""
    if "free to move" in trial.reason:
        loose = [f"body {b!r} can {words}" for b in system.problem.bodies if (words := free_to_move(system, b, c))]
        if not loose:  # it was held by contacts that open now
            loose = [
                f"without its contacts body {b!r} can {words}"
                for b in system.problem.bodies
                if (words := free_to_move(system, b, c, contacts=False))
            ]
        return "; ".join(loose)
    if not trial.residuals:
        return ""
    e = system.evaluate(c, trial.u, trial.lam, stiffness=False)
    if e.failed or not len(reduced.free):
        return ""
    dof = int(reduced.free[np.argmax(np.abs(reduced.weight * reduced.part(e.r)))])
    for s in system.surfaces:
        if s.exact and dof in range(s.unknowns.start, s.unknowns.stop):
            dof = int(s.dofs[(dof - s.unknowns.start) // 2, 0])
    if dof >= 2 * system.nodes:
        t, axis = divmod(dof - 2 * system.nodes, 3)
        return f"the largest residual is that of tool {system.tools[t].name!r} along {('x', 'y', 'rz')[axis]}"
    return f"the largest residual is at {_node(system, dof // 2, trial, e)}"


def _node(system: System, node: int, trial: Trial, e: Evaluation) -> str:
    body = next(b for b in reversed(list(system.offsets)) if system.offsets[b] <= node)
    block = next(b for b in system.blocks if b.body == body)
    x = system.positions(trial.u)[node]
    element = int(np.flatnonzero((block.cells == node).any(axis=1))[0])
    text = f"node {node - system.offsets[body]} of {body!r} at ({x[0]:.4g}, {x[1]:.4g}), element {element}"
    for s, f in zip(system.surfaces, e.contacts):
        k = np.flatnonzero((s.points.support == node).any(axis=1))
        if len(k) and np.isfinite(f.g[k[0]]):
            status = "open" if f.p[k[0]] <= 0 else "slipping" if f.slip[k[0]] else "sticking"
            text += f", {status} at tool {system.tools[s.tool].name!r} (gap {f.g[k[0]]:.3g})"
    return text
