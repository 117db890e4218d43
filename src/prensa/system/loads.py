"""Loads on boundaries: dead tractions, follower pressure and shear with exact tangents, on linear and quadratic edges.

An edge has two nodes (start, end) or three (start, end, middle), body on the left; forces are f_a = ∫ N_a t dΓ with the
shape functions of the edge, by Gauss points that integrate every term exactly on straight edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.system.control import Proportional
from prensa.system.face_loads import face_force, pressure_stiffness
from prensa.system.interaction import Context, Discretisation, Interaction, Part, Request, Response
from prensa.system.schedule import Amplitude, BoundaryLoad, StepPlan
from prensa.system.self_equilibrated import SelfEquilibrated, per_block
from prensa.system.state import State
from prensa.types import Array, Index

# Degree 3 for two nodes, 5 for three: N and 2πr are linear or quadratic, the tangent is constant or linear.
_GAUSS = {2: np.polynomial.legendre.leggauss(2), 3: np.polynomial.legendre.leggauss(3)}


def edge_shapes(nodes: int, xi: float) -> tuple[Array, Array]:
    """Shape functions and their slopes (nodes,) of an edge of 2 or 3 nodes at ξ in [−1, 1]."""
    if nodes == 2:
        return np.array([0.5 - 0.5 * xi, 0.5 + 0.5 * xi]), np.array([-0.5, 0.5])
    return (
        np.array([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi]),
        np.array([xi - 0.5, xi + 0.5, -2.0 * xi]),
    )


def _points(x: Array, edges: Index, depth: Array | None) -> list[tuple[float, Array, Array, Array, Array]]:
    """Gauss points: weight, N (a,), N′ (a,), tangent dx/dξ (k, 2), 2πr or thickness (k,)."""
    m = edges.shape[1]
    out = []
    for xi, weight in zip(*_GAUSS[m]):
        N, dN = edge_shapes(m, float(xi))
        d = np.einsum("a,kad->kd", dN, x[edges])
        rho = 2 * np.pi * (x[edges][:, :, 0] @ N) if depth is None else depth[edges] @ N
        out.append((float(weight), N, dN, d, rho))
    return out


def boundary_force(
    x: Array, edges: Index, depth: Array | None, pressure: float = 0.0, shear: float = 0.0,
    traction: tuple[float, ...] = (0.0, 0.0),
) -> Array:  # fmt: skip
    """Forces (k, 2a) on the nodes of edges (k, a) of the configuration x (n, 2), stresses per area of x.

    ``depth`` (n,): thickness at the nodes; None in axisymmetry (2πr). Traction −p n + q τ + t with τ along the edge.
    """
    f = np.zeros((*edges.shape, 2))
    # M turns the tangent dx/dξ, body on the left of it: shear goes along it, pressure against the normal on its right.
    M = np.array([[shear, -pressure], [pressure, shear]])
    t = np.array(traction)
    for weight, N, _, d, rho in _points(x, edges, depth):
        per_length = d @ M.T + np.hypot(d[:, 0], d[:, 1])[:, None] * t
        f += (weight * rho)[:, None, None] * N[:, None] * per_length[:, None, :]
    return f.reshape(len(edges), -1)


def follower_stiffness(x: Array, edges: Index, depth: Array | None, pressure: float, shear: float) -> Array:
    """K (k, 2a, 2a) = −∂f/∂x of follower pressure and shear (`boundary_force`): t dΓ = M x′ dξ, linear in the positions."""
    k, m = edges.shape
    K = np.zeros((k, m, 2, m, 2))
    M = np.array([[shear, -pressure], [pressure, shear]])
    for weight, N, dN, d, rho in _points(x, edges, depth):
        K -= (weight * rho)[:, None, None, None, None] * np.einsum("a,b,ij->aibj", N, dN, M)
        if depth is None:  # a node that goes outwards has a longer circle to be pressed on
            K[..., 0] -= 2 * np.pi * weight * np.einsum("a,b,ki->kaib", N, N, d @ M.T)
    return K.reshape(k, 2 * m, 2 * m)


# ----------------------------------------------------------------------------------------------------- as interactions
@dataclass(frozen=True)
class EdgeLoad:
    """Pressure, shear and traction on a boundary."""

    system: Discretisation
    name: str
    load: BoundaryLoad

    def couplings(self) -> list[Index]:
        """Of the nodes of each edge, which a follower load couples."""
        return [self.system.dofs.displacement.dofs(self.load.edges).reshape(len(self.load.edges), -1)]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        system, load = self.system, self.load
        p, q = load.pressure(c.time), load.shear(c.time)
        t = tuple(course(c.time) for course in load.traction)
        (dofs,) = self.couplings()
        parts = []
        if load.follower and (p != 0.0 or q != 0.0):
            x = system.positions(ask.u) if system.problem.kinematics == "finite" else system.X
            K = self._stiffness(x, c.depth, p, q) if ask.stiffness else None
            parts.append(Part(f"load {self.name}", dofs, self._force(x, c.depth, p, q, (0.0,) * len(t)), K))
            p = q = 0.0
        if p or q or any(t):
            parts.append(Part(f"load {self.name}", dofs, self._force(system.X, system.depth, p, q, t)))
        return Response(parts, external=True)

    def _force(self, x: Array, depth: Array | None, p: float, q: float, t: tuple[float, ...]) -> Array:
        """Forces on the nodes of the edges (or, in space, faces) of the configuration x (n, d)."""
        if len(t) == 3:  # in space there is no shear along the side
            return face_force(x, self.load.edges, p, t)
        return boundary_force(x, self.load.edges, depth, p, q, t)

    def _stiffness(self, x: Array, depth: Array | None, p: float, q: float) -> Array:
        """Tangent of a follower load in the configuration x (n, d)."""
        if len(self.load.traction) == 3:
            return pressure_stiffness(x, self.load.edges, p)
        return follower_stiffness(x, self.load.edges, depth, p, q)


@dataclass(frozen=True)
class BodyForce:
    """Force per volume of a body."""

    system: Discretisation
    body: str
    amplitudes: tuple[Amplitude, ...]

    def couplings(self) -> list[Index]:
        """None: it has no stiffness."""
        return []

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        system = self.system
        b = np.array([amplitude(c.time) for amplitude in self.amplitudes])
        nodes = system.nodes_of(self.body)
        f = system.node_volumes(self.body)[:, None] * b
        return Response([Part(f"body force {self.body}", system.dofs.displacement.dofs(nodes), f)], external=True)


@dataclass(frozen=True)
class ToolForce:
    """Force or moment on a tool along one of its motions."""

    dof: int
    amplitude: Amplitude

    def couplings(self) -> list[Index]:
        """None: it has no stiffness."""
        return []

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        at = np.array([[self.dof]])
        return Response([Part(f"tool force {self.dof}", at, np.array([[self.amplitude(c.time)]]))], external=True)


@dataclass(frozen=True)
class Spring:
    """Spring between one motion of a tool and its mount, which moves."""

    dof: int
    stiffness: float
    mount: Amplitude

    def couplings(self) -> list[Index]:
        """With itself."""
        return [np.array([[self.dof]])]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        f = np.array([[self.stiffness * (self.mount(c.time) - ask.u[self.dof])]])
        K = np.full((1, 1, 1), self.stiffness) if ask.stiffness else None
        return Response([Part(f"spring {self.dof}", np.array([[self.dof]]), f, K)], external=True)


@dataclass(frozen=True)
class Release:
    """Forces (ndof,) that are carried at the start of a step and not asked for in it, released linearly over it."""

    forces: Array

    def couplings(self) -> list[Index]:
        """None: it has no stiffness."""
        return []

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        left = c.plan.left(c.time)
        if left == 0.0:
            return Response(external=True)
        dofs = np.flatnonzero(self.forces)
        return Response([Part("release", dofs[:, None], left * self.forces[dofs, None])], external=True)


def loads_of(system: Discretisation, plan: StepPlan, state: State) -> list[Interaction]:
    """The loads, tool forces and springs of a step as interactions, and the forces of a state that it releases."""
    out: list[Interaction] = [EdgeLoad(system, name, load) for name, load in plan.loads.items()]
    out += [BodyForce(system, body, amplitudes) for body, amplitudes in plan.body_force.items()]
    out += [ToolForce(dof, amplitude) for dof, amplitude in plan.push.items()]
    release = state.release
    if plan.control is not None:
        # before springs are among them, which answer to where tools are and are no loads
        out = [Proportional(load) for load in out]
        if release is not None:
            changed = np.isin(np.arange(system.ndof), _loaded(system, plan))
            out.append(Proportional(Release(np.where(changed, release, 0.0))))
            release = np.where(changed, 0.0, release)
    out += [Spring(dof, stiffness, mount) for dof, (stiffness, mount) in plan.springs.items()]
    if release is not None:
        out.append(Release(release))
    if state.self_equilibrated is not None:
        out += [SelfEquilibrated(system, b, K) for b, K in zip(system.blocks, per_block(system, state.self_equilibrated))]
    return out


def _loaded(system: Discretisation, plan: StepPlan) -> Index:
    """Degrees of freedom on which the loads of a step act, and those of its tools: what is carried there follows its factor."""
    nodal = system.dofs.displacement
    bodies = [system.nodes_of(name) for name in plan.body_force]
    sets = [nodal.dofs(nodes) for nodes in (*(load.edges for load in plan.loads.values()), *bodies)]
    tools = np.arange(system.dofs.tool.first, system.dofs.tool.slice.stop)
    return np.concatenate([tools, *(s.ravel() for s in sets)])
