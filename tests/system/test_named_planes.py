"""Planes of symmetry that a case names: what is free and comes to them, or lies in them at first, does not go through."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import dump, loads
from prensa.sensitivity.parameters import with_values
from prensa.system.symmetry_planes import guard_of, with_planes
from stopped import goes_on_bit_for_bit

SOFT = pr.Elastic(1000.0, 0.3)


def beam(space: str, drop: float, held: str, pressure: float = 0.3, **more: Any) -> pr.Problem:
    """A beam on a foot, its free underside ``drop`` above the foot's plane, pressed down from above."""
    n, step = 7, [(0.0, 0.0), (1.0, 0.0)] if drop else []
    points = [*step, *((float(x), drop) for x in range(n)), *((float(x), 1.0) for x in range(n))]
    low, high = len(step), len(step) + n
    cells: list[tuple[int, ...]] = [(low + k, low + k + 1, high + k + 1, high + k) for k in range(n - 1)]
    cells += [(0, 1, low + 1, low)] * bool(drop)
    top = tuple(range(high + n - 1, high - 1, -1))
    under, end = tuple(range(low + 1, low + n)), (low + n - 1, high + n - 1)
    sides = {"foot": (0, 1), "back": (*([0] if drop else []), low, high), "top": top, "under": under, "end": end}
    sides |= {"step": (1, low + 1)} if drop else {}
    section, solid = pr.Points(tuple(points), tuple(cells), sides), space == "solid"
    mesh = pr.Extrusion(section, axis="z", length=1.0, n=1) if solid else section
    fixed: dict[str, Any] = {"b.foot": held, "b.back": "x"} | ({"b.base": "z", "b.cap": "z"} if solid else {})
    press = pr.Step("press", loads={"b.top": pr.Load(pressure=pressure)}, increments=6)
    return pr.Problem("beam", **({
        "space": space, "bodies": {"b": pr.Body(mesh, SOFT)}, "fixed": fixed, "steps": (press,),
    } | more))  # fmt: skip


def case(problem: pr.Problem, *mirror: str) -> pr.Case:
    return pr.Case(problem, output=pr.Output(mirror=mirror))


def lowest(increments: list[pr.Increment]) -> float:
    return min(float(i.bodies["b"].x[:, 1].min()) for i in increments)


@pytest.mark.parametrize("space", ["plane strain", "solid"])
@pytest.mark.parametrize(("drop", "held"), [(0.05, "xy"), (0.0, "y"), (0.0, "xy")])
def test_a_named_plane_stops_what_comes_to_it(space: str, drop: float, held: str) -> None:
    """As a smooth plane that is written by hand does; without the name, what is held along itself is a clamped side."""
    free = list(pr.solve(beam(space, drop, held)))
    assert lowest(free) < -0.05 and not free[-1].tools
    found = list(pr.solve(case(beam(space, drop, held), "b.foot").problem))
    assert list(found[-1].tools) == ["symmetry_x", "symmetry_y"] and lowest(found) > -1e-3
    d = 3 if space == "solid" else 2
    plane = {"mirror": pr.Plane(normal=(0.0, 1.0, 0.0)[:d], at=(0.0, 0.0, 0.0)[:d])}
    free_sides = ("b.under", "b.end", "b.top", *(["b.step"] if drop else []))
    *_, by_hand = pr.solve(beam(space, drop, held, tools=plane, contacts=(pr.Contact(free_sides, "mirror"),)))
    assert abs(found[-1].tools["symmetry_y"].force.y) > 0.1
    assert found[-1].tools["symmetry_y"].force.y == pytest.approx(by_hand.tools["mirror"].force.y, rel=1e-6)
    np.testing.assert_allclose(found[-1].bodies["b"].x, by_hand.bodies["b"].x, rtol=0, atol=1e-8)


def test_what_lies_in_a_named_plane_may_lift_off() -> None:
    """No tool is added then."""
    pulled = beam("plane strain", 0.0, "y", -0.3)
    found, free = list(pr.solve(case(pulled, "b.foot").problem)), list(pr.solve(pulled))
    assert not found[-1].tools
    np.testing.assert_array_equal(found[-1].bodies["b"].x, free[-1].bodies["b"].x)


def test_names_stay_with_the_problem() -> None:
    """When it is written and read, with other numbers in it, and with the planes themselves; a press names planes too."""
    made = case(beam("plane strain", 0.05, "xy"), "b.foot")
    for problem in (made.problem, loads(dump(made)).problem, with_values(made.problem, {"bodies.b.material.E": 900.0})):
        guard = guard_of(pr.discretise(problem))
        assert guard is not None and [str(m) for m in guard.mirrors] == ["x = 0", "y = 0"]
        assert with_planes(guard).problem.mirrored == ("b.foot",)
    guard = guard_of(pr.discretise(beam("plane strain", 0.05, "xy")))
    assert guard is not None and [str(m) for m in guard.mirrors] == ["x = 0"]
    punch = {"punch": pr.Plane(touching="b.top", press=pr.Press(1e3, mirror="bottom"))}
    step = pr.Step("press", by={"punch": pr.Motion(y=-0.1)})
    guard = guard_of(pr.discretise(beam("plane strain", 0.05, "xy", tools=punch, steps=(step,), thickness=2.0)))
    assert guard is not None and [str(m) for m in guard.mirrors] == ["x = 0", "y = 0"]


def test_a_run_with_a_named_plane_goes_on_bit_for_bit(tmp_path: Path) -> None:
    """Stopped before and after the beam came to it; the names are in the case that a checkpoint holds."""
    made = replace(case(beam("plane strain", 0.5, "xy", 0.06), "b.foot"), output=pr.Output(1, False, False, ("b.foot",)))
    touched = [bool(i.tools) for i in pr.solve(made.problem)]
    assert not touched[0] and touched[-2]
    goes_on_bit_for_bit(made, tmp_path, 1)
