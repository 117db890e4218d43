"""The matrix of a run's first step, made and its pattern analysed by a thread of its own while the description is looked at."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

from prensa.linear.condensation import to_be_condensed
from prensa.linear.reduction import Reduced
from prensa.model import problem as model
from prensa.policy import Policy
from prensa.system.matrix_symmetry import is_symmetric
from prensa.system.planning import plan_step
from prensa.system.system import System


class Ahead:
    """What another thread makes of a ``system`` from its description alone: the matrix of the first step, analysed."""

    def __init__(self, system: System, numerics: model.Numerics, policy: Policy) -> None:
        self.system = system
        pool = ThreadPoolExecutor(1, "analysis")
        self._made: Future[Reduced | None] | None = pool.submit(first_matrix, system, numerics, policy)
        pool.shutdown(wait=False)

    def matrix(self) -> Reduced | None:
        """The matrix, waited for and handed over: it is held nowhere else.

        None where bodies are condensed, or making it failed, which it will again where that is reported.
        """
        made, self._made = self._made, None
        return None if made is None or made.exception() is not None else made.result()


def first_matrix(system: System, numerics: model.Numerics, policy: Policy) -> Reduced | None:
    """The matrix of the first step of a run from its beginning, its pattern analysed; None where bodies are condensed."""
    if to_be_condensed(system, numerics, policy):
        return None
    plan = plan_step(system, 0, system.initial().step_start)
    out = Reduced.of(system, plan.fixed, numerics, is_symmetric(system, plan), policy, plan.control)
    out.factorisation.analyse()
    return out
