"""What follows from a problem alone is found once for all checks before a run."""

import gc
import weakref

import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.system import moments
from prensa.system.moments import stages
from prensa.system.once import once
from problems import pressed_block, stroke


def test_steps_are_planned_once_for_all_checks(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many plans as steps, however many checks look at them."""
    planned, plan_step = [], moments.plan_step

    def counted(system, number, *args):
        planned.append(number)
        return plan_step(system, number, *args)

    monkeypatch.setattr(moments, "plan_step", counted)
    p = pressed_block(stroke(-0.1), stroke(-0.05, name="back"))
    system = pr.discretise(p)
    preflight(system)
    assert planned == list(range(len(p.steps)))
    preflight(pr.discretise(p))  # another problem has its own
    assert len(planned) == 2 * len(p.steps)
    assert stages(system) is stages(system)


def test_what_is_known_of_a_problem_goes_with_it() -> None:
    """Nothing keeps a problem in memory that nobody else holds."""
    sizes = once(lambda system: system.ndof)
    system = pr.discretise(pressed_block(stroke(-0.1)))
    assert sizes(system) == system.ndof and len(stages(system)) == 1
    gone = weakref.ref(system)
    del system
    gc.collect()
    assert gone() is None
