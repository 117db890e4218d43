"""Acceptance criteria: equilibrium is not enough, solutions that balance and yet are impossible are refused."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Attempted, Failed, cut_by, ended_by
from prensa.contact.pairing import rotation
from prensa.contact.surface import Surface
from prensa.errors import Finding
from prensa.linear.rigid_modes import free_to_move
from prensa.mesh.brick_checks import EDGE_ENDS, TETRAHEDRON_ENDS, corner_edges
from prensa.policy import DEFAULT, Policy
from prensa.precision import SMALLEST
from prensa.system.assembly import Block
from prensa.system.contacts import contacts_of, were_closed
from prensa.system.failure import (
    BeyondSmall,
    Collapsed,
    CornerInverted,
    Failure,
    FreeToMove,
    LostSupport,
    Tunnelled,
    TurnedThrough,
    UnilaterallySupported,
)
from prensa.system.interaction import Context
from prensa.system.outcome import NewtonResult
from prensa.system.state import State
from prensa.system.system import Evaluation, System
from prensa.system.time_integration import growths
from prensa.types import Array, Flags

INVERSION_FALL = 0.5
"""Fall of that measure in one increment that is no gradual inversion."""
COLLAPSE_STRAIN = 1.0
"""Equivalent plastic strain in one increment beyond which the increment is refused."""
TUNNEL_MIN_RATIO = 0.25
"""Way over element depth (or tool thickness if less) that tunnels through nothing."""
MAX_TOOL_ROTATION = 0.8
"""Rotation (rad) of a tool in one increment from which its path is checked."""
SWEPT_DEPTH_RATIO = 0.5
"""Penetration over element depth, beyond that at the end, with which a turning tool went through a body."""


class Corners:
    """Least corners of the elements of a system (see `least_corner`). Two ask for them: they are kept from one to the other."""

    def __init__(self, system: System) -> None:
        self.system = system
        self._at: Array | None = None
        self._known: dict[str, Array] = {}

    def least(self, block: Block, u: Array) -> Array:
        """Of the elements (e,) of a block, for degrees of freedom u (ndof,)."""
        # By identity: iterates are new arrays, never changed in place.
        if self._at is not u:
            self._at, self._known = u, {}
        elif block.body in self._known:
            return self._known.pop(block.body)  # a large run has no room for what nobody asks for any more
        self._known[block.body] = least_corner(self.system.positions(u).take(block.corners.T, axis=0))
        return self._known[block.body]


def tunnelling(system: System, policy: Policy, given: Attempted) -> Iterator[Finding]:
    """Increments in which a contact point gets through a tool."""
    if found := tunnelled(system, given.context.state, given.result.u, policy):
        yield cut_by(found)


def turning(system: System, policy: Policy, given: Attempted) -> Iterator[Finding]:
    """Increments in which a tool turns through a body."""
    if found := turned_through(system, given.context.state, given.result.u, policy):
        yield cut_by(found)


def support(system: System, given: Attempted) -> Iterator[Finding]:
    """Increments in which the last contact of a body opens."""
    assert given.result.evaluation is not None
    if found := lost_support(system, given.context, given.result.evaluation):
        yield cut_by(found)


def deformation(system: System, policy: Policy, corners: Corners, given: Attempted) -> Iterator[Finding]:
    """Increments in finite strain in which a corner jumps beyond 180°, or a point flows by more than `COLLAPSE_STRAIN`."""
    c, result = given.context, given.result
    if system.problem.kinematics == "small":
        return
    assert result.evaluation is not None
    result.grown = growths(system.blocks, result.evaluation.history, c.state.history)
    yield from _deformed(system, policy, corners, c, result)


def _deformed(system: System, policy: Policy, corners: Corners, c: Context, result: NewtonResult) -> Iterator[Finding]:
    for block, growth in zip(system.blocks, result.grown):
        if inverted := _corner(system, policy, corners, block, c, result.u):
            yield cut_by(inverted)
        if growth is not None and growth.max() > COLLAPSE_STRAIN:
            worst = int(np.argmax(growth)) // growth.shape[1]  # of (elements, points)
            x, y, *z = _centre(system, block, worst)
            yield cut_by(Collapsed(worst, block.body, x, y, float(growth.max()), *z))


def _corner(system: System, policy: Policy, corners: Corners, block: Block, c: Context, u: Array) -> Failure | None:
    """A corner that jumped beyond 180°, of a brick to a negative Jacobian; None if there is none.

    A corner of 180° is no fold: a free side that rolls onto a die makes such elements, and they answer well. One that
    passes 180° little by little is reported (`Folding`). One that jumps there in a single increment belongs to another,
    impossible solution.
    """
    corner = corners.least(block, u)
    worst = int(np.argmin(corner))
    if not corner[worst] < policy.inverted_corner_ratio:
        return None
    if not corner[worst] < least_corner(c.x_n[block.corners.T[:, [worst]]])[0] - INVERSION_FALL:
        return None
    return CornerInverted(worst, block.body, *_centre(system, block, worst))


def _centre(system: System, block: Block, element: int) -> list[float]:
    """Centre of an element in the initial configuration, two coordinates or three."""
    out: list[float] = system.X[block.cells[element]].mean(axis=0).tolist()
    return out


def least_corner(x: Array) -> Array:
    """Least corner of elements over the mean of all their corners (e,): 0 at 180°, negative beyond.

    Of polygons x (3|4, e, 2) the triangles at their corners, of solids x (4|8, e, 3) the tetrahedra of the three edges there.
    """
    if x.shape[2] == 3:
        return _least_tetrahedron(x)
    along = np.empty_like(x)  # to the next corner
    np.subtract(x[1:], x[:-1], out=along[:-1])
    np.subtract(x[0], x[-1], out=along[-1])
    dx, dy = along[..., 0], along[..., 1]
    area = np.empty(dx.shape)
    for k, out in enumerate(area):
        np.multiply(dx[k - 1], dy[k], out=out)
        out -= dy[k - 1] * dx[k]
    return np.asarray(area.min(axis=0) / np.maximum(np.abs(area.mean(axis=0)), SMALLEST))


def _least_tetrahedron(x: Array) -> Array:
    volume = np.empty(x.shape[:2])
    for corner, (a, b, c) in enumerate(EDGE_ENDS if len(x) == 8 else TETRAHEDRON_ENDS):
        volume[corner] = np.einsum("ei,ei->e", np.cross(x[a] - x[corner], x[b] - x[corner]), x[c] - x[corner])
    wedges = np.flatnonzero((volume == 0.0).any(axis=0)) if len(x) == 8 else ()
    if len(wedges):
        volume[:, wedges] = np.linalg.det(corner_edges(x[:, wedges].transpose(1, 0, 2))).T
    return np.asarray(volume.min(axis=0) / np.maximum(np.abs(volume.mean(axis=0)), SMALLEST))


def tunnelled(system: System, state: State, u: Array, policy: Policy = DEFAULT) -> Tunnelled | None:
    """A contact point that got from one side of a tool to another in a single increment; None if none did.

    Both ends of the increment are free of contact, so no residual shows it. Ways are straight in the frame of the tool.
    """
    for s in system.tool_contacts:
        if system.tool_masters[s.against].shape.half_space:  # nothing gets through a half-space
            continue
        start, end = (_in_tool(system, s, v) for v in (state.u, u))
        through = _through(system, s, start, end, policy)
        if through.any():
            k = int(np.flatnonzero(through)[0])
            node = s.points.nodes[k]
            return Tunnelled(s.against, int(node - system.offsets[s.body]), s.body, *system.positions(state.u)[node].tolist())
    return None


def _through(system: System, s: Surface, start: Array, end: Array, policy: Policy) -> Flags:
    """Nodes (k,) of a surface whose straight ways (k, d) in the frame of the tool lead through it."""
    tool = system.tool_masters[s.against].tool
    h = min(float(s.points.depth.min()), tool.thickness)
    length = np.linalg.norm(end - start, axis=1)
    if length.max() < TUNNEL_MIN_RATIO * h:
        return np.zeros(len(start), dtype=bool)
    # only what is outside at both ends and goes farther than to the tool and back may have got through (twice as far: shapes of
    # a user's own may have distances that are not exact)
    ends = [tool.shape.closest(x).g for x in (start, end)]
    may = (np.minimum(*ends) > policy.tunnel_gap_ratio * length) & (ends[0] + ends[1] < 2.0 * length)
    out = np.zeros(len(start), dtype=bool)
    if not may.any():
        return out
    samples = min(int(policy.tunnel_samples * length.max() / h) + policy.tunnel_samples, policy.max_tunnel_samples)
    share = np.linspace(0.0, 1.0, samples)
    way = start[may] + share[:, None, None] * (end - start)[may]
    close = tool.shape.closest(way.reshape(-1, way.shape[-1]))
    g, n = close.g.reshape(len(share), -1), close.n.reshape(way.shape)
    inside, each = g < 0, np.arange(g.shape[1])
    enters, leaves = inside.argmax(axis=0), len(share) - 1 - inside[::-1].argmax(axis=0)
    # A node that dives into a face and comes out of it again grazed it; through is where it leaves by a face that looks another
    # way.
    opposite = (n[enters, each] * n[leaves, each]).sum(axis=1) < policy.tunnel_cosine
    out[may] = inside.any(axis=0) & opposite
    return out


def turned_through(system: System, state: State, u: Array, policy: Policy = DEFAULT) -> TurnedThrough | None:
    """A tool that turned far in a single increment, and through a body on the way; None if none did. Round ones may."""
    d = system.dofs.dimension
    for s in system.tool_contacts:
        master = system.tool_masters[s.against]
        tool, place = master.tool, master.place(u)
        turned = u[master.dofs[d:]] - state.u[master.dofs[d:]]
        angle = float(np.linalg.norm(turned))
        if not angle > MAX_TOOL_ROTATION:
            continue
        x = system.positions(u)[s.points.nodes] - tool.at - place[:d]
        shares = np.linspace(0.0, 1.0, 2 + int(min(angle / (0.5 * MAX_TOOL_ROTATION), policy.max_tunnel_samples)))
        now = rotation(place[d:])
        depth = [float(-tool.shape.closest(x @ (rotation(-share * turned) @ now)).g.min()) for share in shares]
        # The angles run back from the end of the increment: depth[0] is what contact left there, a penalty's penetration say.
        if max(depth) - max(depth[0], 0.0) > SWEPT_DEPTH_RATIO * float(s.points.depth.min()):
            return TurnedThrough(tool.name, s.body, angle)
    return None


def _in_tool(system: System, s: Surface, u: Array) -> Array:
    """Places (k, d) of the nodes of a surface in the frame of its tool."""
    return system.tool_masters[s.against].local(system.positions(u)[s.points.nodes], u)


def lost_support(system: System, c: Context, e: Evaluation) -> LostSupport | None:
    """A body whose last contact opened in the increment though nothing else holds it; None if there is none.

    Its place means nothing then. The matrix need not be singular for that: stresses that stay inside resist a turn.
    """
    for body in system.problem.bodies:
        # A floating body is still on its way to its tools, and out of touch by right.
        if body in c.floating:
            continue
        own = contacts_of(system, body)
        closed = any(were_closed(c.state, system.surfaces[i]) for i in own)
        if closed and not any((e.contacts[i].p > 0).any() for i in own) and _loose(system, body, c):
            return LostSupport(body)
    return None


def unilateral_support(system: System, given: Failed) -> Iterator[Finding]:
    """A body that nothing but its contact with a single tool holds, which can only push it away.

    Loads may press it against the tool, so this is no error by itself; it is what a failed increment is most likely due to.
    """
    c = given.context
    if isinstance(given.reason, FreeToMove | BeyondSmall):
        return
    for body in system.problem.bodies:
        own = [system.surfaces[i] for i in contacts_of(system, body)]
        touched = {s.against for s in own if were_closed(c.state, s)}
        if len(touched) == 1 and _loose(system, body, c):
            yield ended_by(UnilaterallySupported(body, touched.pop()))
            return


def _loose(system: System, body: str, c: Context) -> bool:
    """Whether a body can move as a rigid one when contacts do not count."""
    return bool(free_to_move(system, body, c, contacts=False))
