"""What a contact of few nodes misses of its force: its surroundings computed once more, on elements a quarter as long."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from prensa.checks.check import Check, Committed, Refusal
from prensa.contact.surface import Surface
from prensa.errors import PrensaError
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.solver.reporting import Given, Messages
from prensa.solver.time_stepping import TimeStepping
from prensa.system.discretise import discretise
from prensa.system.failure import Failure
from prensa.system.finer_part import may_part, part_of
from prensa.system.system import System
from prensa.timer import Timer
from prensa.types import Index


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

    At a given force F the tool goes deeper by (1/k' − 1/k) F where the part has a stiffness k' for k. Only the part of the work
    that is done in it feels that, the rest of the body, of which it is ``share`` of the work, goes the same way.
    """
    if not may_part(system, s):
        return None
    try:
        fine, own = (part_of(system, given.context, given.state, s, nodes, layers, halvings) for halvings in (2, 0))
        if fine is None or own is None:
            return None
        there, here = (_force(s, part.problem, numerics, policy) for part in (fine, own))
    except PrensaError:  # what has no answer as a part says nothing of the whole
        return None
    return own.share * (1.0 - here / there) if there > 0.0 else None


def _force(s: Surface, problem: model.Problem, numerics: model.Numerics, policy: Policy) -> float:
    """Size of the force of a contact's tool at the end of the problem of a part.

    Raises
    ------
    PrensaError
        If that has no answer.

    """
    own = discretise(problem)
    stepping = TimeStepping(own, numerics, policy, _Silent(own, None), Timer(), condense=False)
    *_, last = stepping.run(own.initial())
    force = last.force(s.against)
    # about the axis forces along the radius cancel
    return abs(force.y) if own.axisymmetric else float(np.hypot(force.x, force.y))
