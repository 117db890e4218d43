"""Quality warnings: what a converged run deserves less trust for than its residual says."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.checks.after.between_nodes import BetweenNodes
from prensa.checks.check import Committed, Failed, Finished, warning
from prensa.checks.force_share import ForceShare
from prensa.checks.thresholds import NOTABLE_DEPTH, SLIGHT
from prensa.contact.forces import ContactForces, Scale
from prensa.contact.record import magnitude
from prensa.errors import Finding, coordinates, per_cent
from prensa.linear.rigid_modes import CLOSED
from prensa.model.fields import motions_in
from prensa.model.problem import Problem, Step
from prensa.system.system import System

HIDDEN_FORCE_RATIO = 100.0
"""A tool force below this multiple of the residual allowed is no result."""
GIVE_WAY = "the penalties of the contacts give way"
"""How the warning of `PenaltyShare` begins, by which those who judge warnings know it."""


def penetrations(system: System, given: Committed) -> Iterator[Finding]:
    """Contact points that lie deep in their tool at the end of a step."""
    for s, f, scale in zip(system.surfaces, given.evaluation.contacts, given.context.scales):
        depth = np.where(f.p > 0, -f.g / scale.h, 0.0)
        k = int(np.argmax(depth))
        if depth[k] > NOTABLE_DEPTH:
            x, node = s.X[k], s.points.support[k, np.argmax(s.points.N[k])]
            into, other = ("the tool", ", or use 'augmented'") if s.opposite is None else (repr(s.against), "")
            yield warning(
                f"contact {s.name}: node {node - system.offsets[s.body]} (initially at {coordinates(x)}) lies "
                f"{-f.g[k]:.3g} inside {into}, {depth[k]:.2g} of an element: raise its stiffness 'beta'{other}"
            )


class PenaltyShare:
    """Forces that are too low because the penalties of the contacts give way, where most work had been done.

    A spring of stiffness k that carries f gives way by f/k, and that gap lowers the force F over a prescribed travel d by f/k
    df/dd: gaps and travels are reciprocal (Betti). Of all springs that is a share Σ f df / (k F dd) = dE/dW of F: what their
    energy gains over what the work does (`ForceShare`). In a linear body that is E/W; a body that stiffens loses more, metal
    that yields at a constant force nothing. Steps of little work, in which a sheet is clamped, have large shares that mean
    nothing for what is asked of the run.
    """

    def __init__(self, system: System) -> None:
        self.system, self.softest, self.of_springs = system, "", ForceShare()

    def go_on_from(self, before: PenaltyShare) -> None:
        """Take over what was seen of the run on an earlier system."""
        self.softest = before.softest
        self.of_springs.go_on_from(before.of_springs)

    def __call__(self, given: Committed) -> tuple[()]:
        """Note an increment; there is nothing to say before the end of the run."""
        stored = self._stored(given)
        self.of_springs.note(given, sum(stored.values()))
        if stored and self.of_springs.most == len(self.of_springs.rows) - 1:
            self.softest = max(stored, key=lambda name: stored[name])
        return ()

    def _stored(self, given: Committed) -> dict[str, float]:
        """Energy in the springs of each contact that has some."""
        contacts = zip(self.system.surfaces, given.evaluation.contacts, given.context.scales)
        return {s.name: _gives_way(f, scale) for s, f, scale in contacts if s.description.enforcement.sinks}

    def warnings(self, _: Finished | Failed) -> Iterator[Finding]:
        """The share, where it shows."""
        share = self.of_springs.at_most_work()
        if share > SLIGHT:
            yield warning(
                f"{GIVE_WAY}, that of {self.softest!r} most, and forces of prescribed travels are "
                f"too low by an estimated {per_cent(share)}; raise 'beta' and 'beta_T', or use "
                "'enforcement: {type: exact}'"
            )


def _gives_way(f: ContactForces, scale: Scale) -> float:
    """Energy in the springs of a contact through which forces of prescribed travels depend on them: not of those that slide."""
    held = np.where(f.slip, 0.0, f.area * magnitude(f.t) ** 2 / scale.k_t)
    return float(0.5 * (f.weight * f.p**2 / scale.k_n + held).sum())


def hidden_forces(system: System, given: Committed) -> Iterator[Finding]:
    """Forces of tools that are no larger than what convergence leaves open."""
    e = given.evaluation
    forces = system.dofs.tool.of(e.contact_forces())[:, : system.dofs.dimension]
    for t, tool in enumerate(system.tools[: len(system.tools) - system.mirrors]):  # planes of symmetry may carry nothing
        size = float(np.hypot.reduce(forces[t]))
        noise = HIDDEN_FORCE_RATIO * given.residual * e.scale
        # Exactly zero is a tool that touches nothing, which is another warning.
        if 0 < size < noise:
            yield warning(
                f"the force on tool {tool.name!r}, {size:.3g}, is not above the tolerance of equilibrium ({noise:.3g}): much "
                f"larger forces are at work elsewhere (supports or tools that press against each other, Σ|f| = {e.scale:.3g}); "
                "remove them or lower 'tolerance'"
            )


def soft_springs(system: System, given: Committed) -> Iterator[Finding]:
    """Springs that take nearly all of the way of their mounts in a run that nothing else drives.

    One that is to preload a tool does that too, beside what else is moved.
    """
    plan, u = given.context.plan, given.state.u
    # A soft spring beside other motions may be a preload; where nothing else drives the run a force was meant.
    if not plan.springs or not _by_springs_alone(system):
        return
    for t, tool in enumerate(system.tools):
        for axis, dof in zip(system.dofs.tool.components, system.dofs.tool.dofs(t).tolist()):
            stiffness, mount = plan.springs.get(dof, (0.0, None))
            way = mount(plan.t1) if mount is not None and mount(plan.t1) != mount(plan.t0) else 0.0
            if abs(u[dof]) < SLIGHT * abs(way):
                yield warning(
                    f"tool {tool.name!r} moved by {u[dof]:.3g} along {axis} while the mount of its spring moved by {way:.3g}: "
                    f"the spring, {stiffness:.4g}, took up the rest, and nothing else drives the run; is its stiffness in the "
                    "units of the case? To press with a force use 'push'"
                )


def _by_springs_alone(system: System) -> bool:
    """Whether all that a problem moves or loads are mounts of springs."""
    p = system.problem
    owners: list[Problem | Step] = [p, *p.steps]
    for owner in owners:
        held = [v for f in owner.fixed.values() for v in (f.x, f.y, f.z)]
        if owner.loads or owner.body_force or any(v not in (None, "held") for v in held):
            return False
    for step in p.steps:
        if step.crank or step.feed or step.push or p.driven(step):
            return False
        for kind in ("move", "by", "velocity"):
            for name, motion in getattr(step, kind).items():
                spring = p.tools[name].spring
                given = [axis for axis in motions_in(p.space) if getattr(motion, axis)]
                if any(getattr(spring, axis, None) is None for axis in given):
                    return False
    return True


class UntouchedTools:
    """Tools of contacts that met nothing, or pressed nothing, in a whole run."""

    def __init__(self, system: System, between: BetweenNodes) -> None:
        self.system, self.between = system, between
        self.reached: set[str] = set()

    def note(self, given: Committed) -> tuple[()]:
        """Note what comes near in an increment: there is nothing to say before the end."""
        for s, f in zip(self.system.tool_contacts, given.evaluation.contacts):
            if s.against not in self.reached and (f.g <= CLOSED * float(s.points.depth.min())).any():
                self.reached.add(s.against)
        return ()

    def warnings(self, given: Finished) -> Iterator[Finding]:
        """Of each such tool, once; one that went in between nodes has been reported."""
        for tool in self.system.tools:
            own = [] if tool.name in given.planes else self.system.against(tool.name)
            # Planes that stand for lines of symmetry are put there by the run, and may never be touched.
            if own and tool.name not in given.touched and self.between.reported.isdisjoint(s.name for s in own):
                surfaces = ", ".join(repr("+".join(s.description.surface)) for s in own)
                near = tool.name in self.reached
                does = f"touched {surfaces} and never pressed" if near else f"never touched {surfaces}"
                yield warning(f"tool {tool.name!r} {does}, so its forces are zero")
