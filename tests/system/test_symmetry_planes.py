"""Free sides that come to a line of symmetry or to the axis: what is modelled ends there, and they meet their mirror image."""

from __future__ import annotations

import contextlib
import logging
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError, SolveError
from problems import flattened_tube, pointed_disc, single_block
from stopped import goes_on_bit_for_bit

PLASTIC = pr.J2(1000.0, 0.3, pr.Linear(10.0, 20.0))
FLATTEN = pr.Step("flatten", by={"punch": pr.Motion(y=-3.98)}, increments=16)


def tube(*steps: pr.Step, **more) -> pr.Problem:
    return flattened_tube(*steps, material=PLASTIC, element="q4_enhanced", n=(8, 1), **more)


def bore(*steps: pr.Step, **more) -> pr.Problem:
    """Pressed in at its rim until the node at the lip would pass the axis."""
    return pointed_disc(*steps, material=PLASTIC, **more)


CLOSE = pr.Step("close", by={"d.right": pr.Motion(x=-0.3)}, increments=16)


def reported(caplog) -> list[str]:
    return [r.getMessage() for r in caplog.records if "line of symmetry" in r.getMessage()]


@pytest.mark.parametrize(
    ("problem", "step", "name", "axis"), [(tube, FLATTEN, "t", 1), (bore, CLOSE, "d", 0)], ids=["middle plane", "axis"]
)
def test_a_line_of_symmetry_is_a_plane_written_by_hand(problem, step, name, axis, caplog):
    """The same forces and places in every increment, no node beyond the line, and a word in the log; without it they go on."""
    with caplog.at_level(logging.INFO, "prensa"):
        found = list(pr.solve(problem(step)))
    assert len(reported(caplog)) == 1
    by_hand = list(pr.solve(problem(step, plane=True)))
    assert len(found) == len(by_hand)
    line, plane = f"symmetry_{'xy'[axis]}", "mirror" if axis else "mandrel"
    for a, b in zip(found, by_hand):
        np.testing.assert_allclose(a.bodies[name].x, b.bodies[name].x, rtol=0, atol=1e-9)
        for tool in ("punch",) if axis else ():
            assert a.force(tool) == pytest.approx(b.force(tool), rel=1e-10, abs=1e-8)
    pressed = found[-1].tools[line].force[axis]
    assert pressed == pytest.approx(by_hand[-1].tools[plane].force[axis], rel=1e-9)
    assert abs(pressed) > 0.1
    assert min(i.bodies[name].x[:, axis].min() for i in found) > -1e-3
    excepted, beyond = replace(problem(step), no_contact=(pr.NoContact(name, "symmetry"),)), 0.0
    caplog.clear()
    with contextlib.suppress(SolveError):
        for i in pr.solve(excepted):
            beyond = min(beyond, i.bodies[name].x[:, axis].min())
    assert not reported(caplog)
    assert beyond < -1e-3


def test_forces_balance_and_the_energy_adds_up():
    """What punch, middle plane and support bear is nothing together; the energy balance is that with a tool in its place."""
    *_, last = pr.solve(tube(FLATTEN))
    borne = sum(t.force.y for t in last.tools.values()) - last.supports["t.start"].y
    assert borne == pytest.approx(0.0, abs=1e-7 * last.force("punch").y)
    *_, by_hand = pr.solve(tube(FLATTEN, plane=True))
    assert last.energy["imbalance"] == pytest.approx(by_hand.energy["imbalance"], rel=1e-8)
    assert last.energy["contact"] == pytest.approx(by_hand.energy["contact"], rel=1e-8)


def test_a_run_with_planes_goes_on_bit_for_bit(tmp_path):
    """Stopped before and after a free side came to the line, its tables are those of a run that went through."""
    case = pr.Case(tube(FLATTEN, replace(FLATTEN, name="open", by={"punch": pr.Motion(y=0.3)}, increments=3)),
                   output=pr.Output(1, False, False))  # fmt: skip
    goes_on_bit_for_bit(case, tmp_path, 8)
    following = replace(tube(FLATTEN), start=pr.Start(run=str(tmp_path / "whole")))
    with pytest.raises(PrensaError, match="reached lines or planes of symmetry"):
        pr.discretise(following)


def test_nothing_is_added_where_nothing_comes_near(caplog):
    """An upset block has the tools that it was given; a plane of the description at the line is enough."""
    block = single_block(
        pr.Step("press", by={"punch": pr.Motion(y=-1.0)}), tools={"punch": pr.Plane(touching="b.top")},
        material=PLASTIC, size=(2.0, 2.0), n=(4, 4), friction=pr.Coulomb(0.3),
    )  # fmt: skip
    with caplog.at_level(logging.INFO, "prensa"):
        *_, last = pr.solve(block)
        *_, other = pr.solve(tube(FLATTEN, plane=True))
    assert list(last.tools) == ["punch"]
    assert not any(t.startswith("symmetry_y") for t in other.tools)
    assert not reported(caplog)


def test_tools_do_not_leave_a_side_that_is_pressed_on_its_line():
    """All contacts would end with 'remove_tools'; the message says what to do."""
    with pytest.raises(SolveError, match=r"pressed on a line of symmetry, which stays.*move the tools away"):
        list(pr.solve(tube(FLATTEN, pr.Step("release", remove_tools=True))))


def test_only_whole_bodies_are_excepted():
    """A side alone is refused with the body's name; a tool may be called so."""
    with pytest.raises(pr.CaseError, match="for whole bodies: write 't'"):
        tube(FLATTEN, no_contact=(pr.NoContact("t.inner", "symmetry"),))


def test_a_support_under_a_part_of_a_side_is_no_line_of_symmetry():
    """What is free beside it on the same line may sag below; with all of the side held it is one."""
    from prensa.system.symmetry_planes import guard_of

    def beam(*held: str) -> pr.Problem:
        points = [(x, y) for y in (0.0, 0.5, 1.0) for x in (0.0, 1.0, 2.0, 3.0)]
        cells = [(4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4) for j in (0, 1) for i in range(3)]
        mesh = pr.Points(tuple(points), tuple(cells), {"foot": (0, 1), "rest": (1, 2, 3)})
        return pr.Problem(
            "beam", bodies={"b": pr.Body(mesh, PLASTIC)}, steps=(pr.Step("on"),), fixed={f"b.{s}": "y" for s in held}
        )

    assert guard_of(pr.discretise(beam("foot"))) is None
    guard = guard_of(pr.discretise(beam("foot", "rest")))
    assert guard is not None and [str(line) for line in guard.mirrors] == ["y = 0"]
