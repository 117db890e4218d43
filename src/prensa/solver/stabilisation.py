"""Viscous regularisation over limit points: forces on the velocity of every node, scaled from the work of the step so far.

f = −c V (u − u_n)/Δt on the displacements of a node with the volume V of its share of the elements around it (of equal shares:
row sums of quadratic elements are negative at corners). Short increments make their stiffness c V/Δt large, so that one of
them always follows a stable equilibrium. c is what would have had the forces dissipate a given share of the work of the
step so far, were the motion always the one so far; it never falls within a step, so that a jump does not use it up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from prensa.errors import per_cent
from prensa.model.problem import ever_stabilised, stabilised
from prensa.policy import Policy
from prensa.result.energy_balance import energies_after, nodal_work
from prensa.system.interaction import Context, Part, Request, Response
from prensa.system.outcome import NewtonResult
from prensa.system.state import Energy, Stability
from prensa.system.system import System
from prensa.types import Array, Index


def nodal_volumes(system: System) -> Array:
    """Volumes (n,) of the nodes: equal shares of the elements around them, initial configuration."""
    out = np.zeros(system.nodes)
    for block in system.blocks:
        share = block.volume.sum(axis=1) / block.cells.shape[1]
        np.add.at(out, block.cells, share[:, None])
    return out


def _own_dofs(system: System) -> Index:
    """Degrees of freedom (n, dimension) of the displacements of the nodes."""
    return system.dofs.displacement.dofs(np.arange(system.nodes))


@dataclass(frozen=True)
class Drag:
    """Forces −k (u − from) on the displacements of nodes, of ``stiffness`` k (n,) each, towards dofs ``start`` (ndof,)."""

    system: System
    stiffness: Array
    start: Array

    def couplings(self) -> list[Index]:
        """Of each node with itself."""
        return [_own_dofs(self.system)]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        dofs = _own_dofs(self.system)
        r = self.stiffness[:, None] * (ask.u - self.start)[dofs]
        K = self.stiffness[:, None, None] * np.eye(dofs.shape[1]) if ask.stiffness else None
        return Response([Part("viscous", dofs, r, K)], float(np.abs(r).sum()))


@dataclass(frozen=True)
class Viscous:
    """Viscous forces of a ``viscosity`` on nodes of ``volumes`` (n,)."""

    system: System
    viscosity: float
    volumes: Array

    def couplings(self) -> list[Index]:
        """Of each node with itself."""
        return [_own_dofs(self.system)]

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        return Drag(self.system, self.viscosity * self.volumes / c.dt, c.state.u).respond(c, ask)


class Stabilisation:
    """The viscous forces of a run; there are none in steps that do not ask for them."""

    def __init__(self, system: System, policy: Policy) -> None:
        self.system, self.policy = system, policy
        self.volumes = nodal_volumes(system) if ever_stabilised(system.problem) else np.zeros(0)
        self.shares = [self._share(number) for number in range(len(system.problem.steps))]

    def _share(self, number: int) -> float:
        """Share of the work that the viscous forces of step *number* may dissipate; 0 without."""
        asked = stabilised(self.system.problem, number)
        return self.policy.viscous_work_share if asked == "auto" else 0.0 if asked == "off" else float(asked)

    def forces(self, c: Context) -> list[Viscous]:
        """The viscous forces of an increment, as interactions."""
        viscosity = c.state.stability.viscosity
        if not (viscosity > 0 and self.shares[c.plan.number]):
            return []
        return [Viscous(self.system, viscosity, self.volumes)]

    def motion(self, c: Context, du: Array) -> float:
        """∫∫ |v|² dV dt of an increment of the displacements du (ndof,)."""
        if not self.shares[c.plan.number]:
            return 0.0
        return float(self.volumes @ (self.system.displacement(du) ** 2).sum(axis=1)) / c.dt

    def dissipated(self, c: Context, du: Array) -> float:
        """Work of the viscous forces in an increment; no velocity changes within one."""
        return c.state.stability.viscosity * self.motion(c, du)

    def energies(self, c: Context, result: NewtonResult) -> Energy:
        """The energy balance after a converged increment, found once."""
        if result.energy is None:
            u, e = result.u, result.evaluation
            assert e is not None
            work = nodal_work(self.system, c, e)
            result.energy = energies_after(self.system, c, u, e, work, self.dissipated(c, u - c.state.u))
        return result.energy

    def jumped_over(self, c: Context, result: NewtonResult) -> bool:
        """Whether an increment under viscous forces is too long for a jump: what these dissipate on the way is not seen then.

        At the end of a jump that a single increment takes there is hardly any motion left: forces and velocities of both ends
        say little of the way between, and the energy balance misses most of what is set free. In a jump a surface goes far, or
        viscous forces take more than is put in; elsewhere the energy balance misses what comes from edges that are cut anew, of
        which shorter increments do not see more.
        """
        if not self.forces(c) or result.evaluation is None:
            return False
        policy, old, du = self.policy, c.state.energy, result.u - c.state.u
        way = [np.abs(self.system.displacement(du)[s.points.nodes]).max() / s.points.depth.min() for s in self.system.surfaces]
        # Without this look edges that are cut anew were followed: 2211 increments for 20, and 43 % of the work viscous.
        new, dissipated = self.energies(c, result), self.dissipated(c, du)
        missed, put_in = new.imbalance - old.imbalance, abs(new.external - old.external)
        if not (dissipated > put_in or any(far > policy.jump_travel_in_elements for far in way)):
            return False
        return missed > max(policy.jump_imbalance_share * abs(new.external), policy.jump_increment_share * (put_in + dissipated))

    def warnings(self, energy: Energy, stability: Stability) -> list[str]:
        """What there is to say of the viscous forces at the end of a step."""
        work = max(abs(energy.external), stability.work)
        if not energy.viscous > self.policy.viscous_warning_share * work:
            return []
        return [
            f"the viscous forces of 'stabilise' have dissipated {per_cent(energy.viscous / work)} of the work: part of it "
            "is energy released by a jump; a smaller number for 'stabilise' shows how much these forces affect results"
        ]

    def after(self, c: Context, du: Array, work: float, negative: int) -> Stability:
        """What the next increment goes by; ``work`` of the loads in this one, ``negative`` modes of its end."""
        old, share = c.state.stability, self.shares[c.plan.number]
        first = not c.state.dt_last > 0  # of the step: until then the viscosity of the step before is the best guess
        motion = self.motion(c, du) + (0.0 if first else old.motion)
        work = abs(work) + (0.0 if first else old.work)
        if not motion > 0:
            return Stability(negative, old.viscosity if share else 0.0)
        return Stability(negative, max(share * work / motion, 0.0 if first else old.viscosity), motion, work)
