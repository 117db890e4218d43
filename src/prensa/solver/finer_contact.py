"""What a contact of few nodes misses of its force: its surroundings computed once more, on elements a quarter as long."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np

from prensa.checks.check import Check, Committed, Refusal
from prensa.contact.passage import WORTH_SAYING
from prensa.contact.surface import Surface
from prensa.errors import PrensaError
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.precision import SMALLEST
from prensa.result.increment import Increment
from prensa.solver.reporting import Given, Messages
from prensa.solver.time_stepping import TimeStepping
from prensa.system.assembly import scatter_vector
from prensa.system.discretise import discretise
from prensa.system.failure import Failure
from prensa.system.finer_part import may_part, part_of, work_in
from prensa.system.system import System
from prensa.timer import Timer
from prensa.types import Array, Index


class _Silent(Messages):
    """No messages: what there is to say of a part is said of the whole."""

    def report(self, checks: Iterable[Check[Given]], given: Given) -> Failure | None:
        """See `Messages`."""
        return next((f.reason for check in checks for f in check(given) if isinstance(f, Refusal)), None)

    def warn(self, sentences: Iterable[str]) -> None:
        """Nothing."""


def missed_on_finer(
    system: System, s: Surface, given: Committed, nodes: Index, layers: int, numerics: model.Numerics, policy: Policy
) -> float | None:
    """See `prensa.checks.after.between_nodes.OnFiner`: the same part of the body on its own elements, and on quarters of them.

    At a given force F the tool goes less deep by F/k − F/k' where the part, with its border held as it is, has a stiffness k' for
    k. The rest of the body goes the same way, so that of the whole, of stiffness K, a share K/k (1 − F/F') is missed. By
    Clapeyron's theorem F²/2K is the work done in all, F²/2k that in the part less what its border alone does in it.

    The part knows its border at the ends of the steps, not on the way there: its own elements, which went there the same way, are
    compared, unless it is the whole body: then the force of the run is. Where its own elements do not give the force of the
    whole, as in metal that is bent round its tool, it stands for nothing, and quarters of them are spared. A tool whose corner is
    pushed aside may have a force of the right size along a wrong direction: the share is the larger one of the size and of what
    does the work, along the way of the tool in the step.
    """
    if not may_part(system, s):
        return None
    solved = partial(_solved, numerics=numerics, policy=policy)
    try:
        if (own := part_of(system, given.context, given.state, s, nodes, layers, 0)) is None:
            return None
        way = _way(system, s, given)
        coarse = solved(own.problem)
        here, whole = _force(s, way, coarse), _carried(system, s, given, own.nodes, way)
        known = np.abs(here - whole) <= WORTH_SAYING * whole
        if not known[0]:
            return None
        alone = 0.0
        if len(own.nodes) < len(system.meshes[s.body].points):
            bare = solved(own.without(s.against))
            alone, _ = work_in(bare.system, bare.last.state, s.body)
        else:  # its border is held by supports, as that of the run, whose force is the one that is asked about
            here = whole
        share = max(own.work - alone, 0.0) / own.total if own.total > 0.0 else 1.0
        if share <= WORTH_SAYING:  # what may be missed, too, unless the force is several times too large
            return 0.0
        # In the same increments, or what differs would be theirs too: contact elements a quarter as long ask for shorter ones.
        fine = part_of(system, given.context, given.state, s, nodes, layers, 2, coarse.increments)
        there = np.zeros(2) if fine is None else _force(s, way, solved(fine.problem))
    except PrensaError:  # what has no answer as a part says nothing of the whole
        return None
    if not there[0] > 0.0:
        return None
    known &= there > 0.0
    missed = share * (1.0 - here[known] / there[known])
    return float(missed[np.argmax(np.abs(missed))])


def _way(system: System, s: Surface, given: Committed) -> Array:
    """Unit vector (2,) along the way of a contact's tool in the step, 0 if it has none."""
    master, state = system.tool_masters[s.against], given.state
    way = (master.place(state.u) - master.place(given.context.state.step_start))[:2]
    return np.asarray(way / max(float(np.hypot(*way)), SMALLEST))


def _carried(system: System, s: Surface, given: Committed, nodes: Index, way: Array) -> Array:
    """The force of a contact's tool on nodes of its body, as `_sizes` has it."""
    force = np.zeros(system.ndof)
    for i, o in enumerate(system.tool_contacts):
        if (o.body, o.against) == (s.body, s.against):
            f, there = given.evaluation.contacts[i], np.isin(o.points.support, nodes).any(axis=1)
            scatter_vector(f.F[there], f.stencils.dofs[there], force)
    return _sizes(system, force[system.tool_masters[s.against].dofs[:2]], way)


class _Solved(NamedTuple):
    """The ``system`` of a part, its ``last`` increment, and how many ``increments`` each of its steps took."""

    system: System
    last: Increment
    increments: list[int]


def _solved(problem: model.Problem, numerics: model.Numerics, policy: Policy) -> _Solved:
    """The problem of a part, solved.

    Raises
    ------
    PrensaError
        If it has no answer.

    """
    own = discretise(problem)
    stepping = TimeStepping(own, numerics, policy, _Silent(own, None), Timer(), condense=False)
    increments = [0] * len(problem.steps)
    for last in stepping.run(own.initial()):
        increments[last.step_number - 1] += 1
    return _Solved(own, last, increments)


def _force(s: Surface, way: Array, part: _Solved) -> Array:
    """The force of a contact's tool, as `_sizes` has it."""
    force = part.last.force(s.against)
    return _sizes(part.system, np.array([force.x, force.y]), way)


def _sizes(system: System, force: Array, way: Array) -> Array:
    """Size of a force (2,) and of its component along a way (2,); about the axis its parts along the radius cancel."""
    along = abs(float(force @ way))
    return np.array([abs(float(force[1])) if system.axisymmetric else float(np.hypot(*force)), along])
