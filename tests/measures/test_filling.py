"""Filling of dies and folds: volumes against arithmetic, a fold before it closes and none elsewhere."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.closed_dies import closed_dies
from prensa.checks.during.closing import FOLDS
from prensa.measures import MeasureError, parse
from prensa.measures.filling import filling, section_of, walls
from prensa.output import answer
from prensa.output.run import resume
from prensa.system.discretise import discretise
from problems import pressed_block, stroke, upset_billet, upset_block

ALUMINIUM = pr.J2(70e3, 0.33, pr.Swift(200, 0.01, 0.2))


def in_a_box(space: str, *, depth: float = -0.6, width: float = 3.0, element: str = "q8", **more) -> pr.Problem:
    """A block 2 × 2 on a smooth base in a box with a straight wall, pressed by a plane."""
    walled = {"wall": pr.Plane(normal=(-1, 0), at=(width, 0)), "t": pr.Plane(touching="b.top")}
    return pressed_block(
        stroke(depth, increments=6), space=space, material=ALUMINIUM, size=(2.0, 2.0), n=(4, 4), element=element,
        tools=walled, contacts=[pr.Contact(("b.top", "b.right"), "t"), pr.Contact("b.right", "wall")],
        fixed={"b.bottom": "y", "b.left": "x"}, **more,
    )  # fmt: skip


def volume(i) -> float:
    """Of a section of straight elements, by the theorem of Pappus on the triangles of its outline."""
    from prensa.measures.outline import in_order
    from prensa.mesh.mesh import boundary_edges, segments

    s = i.shapes["b"]
    a, b = (s.x[e] for e in segments(in_order(boundary_edges(s.cells))).T)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    round_ = i.problem.space == "axisymmetric"
    return float((cross / 2 * (2 * np.pi * (a[:, 0] + b[:, 0]) / 3 if round_ else 1.0)).sum())


@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_what_a_closed_die_misses_is_its_volume_less_that_of_the_billet(space: str) -> None:
    """The box is base, wall, punch and axis or symmetry: its volume by hand; missing = die − billet to 0.2 % of the billet."""
    width = 3.5
    *_, i = pr.solve(in_a_box(space, width=width))
    height, billet = 2.0 + i.tools["t"].place.y, volume(i)
    die = width * height if space == "plane strain" else math.pi * width**2 * height
    assert i.measure("b.die_volume") == pytest.approx(die, rel=1e-9)
    assert i.measure("b.missing_volume") == pytest.approx(die - billet, abs=2e-3 * billet)
    assert i.measure("b.fill") == pytest.approx(billet / die, rel=2e-3)
    assert parse("b.missing_volume", i.problem).unit == ("mm²" if space == "plane strain" else "mm³")
    # between punch, wall and base there is one place, which the body encloses with them
    found = filling(i.problem, i.tools, section_of(i), "b", walls(i.problem))
    assert i.measure("b.pockets") == len(found.places) == 1 and 2.3 < found.places[0].x < width
    assert found.places[0].volume == pytest.approx(die - billet, rel=0.01)
    assert found.places[0].volume == pytest.approx(i.measure("b.trapped_volume"), rel=1e-12)


def test_a_step_ends_at_a_share_of_the_die() -> None:
    """`until` waits for the fill, which is met to the tolerance of all criteria."""
    p = in_a_box("axisymmetric", measures={"fill": "b.fill"})
    p = replace(p, steps=(pr.Step("press", move={"t": pr.Motion(y=-0.6)}, until=pr.Until(measure={"fill": 0.55})),))
    *_, i = pr.solve(p)
    assert i.time < 1.0 and i.measure("fill") == pytest.approx(0.55, rel=1e-3)


def test_dies_that_nothing_closes_are_refused_with_a_remedy() -> None:
    """Without a wall no die is closed: refused before the run, in one line; an increment has no value; no tools, no measure."""
    p = upset_block(stroke(-0.2, increments=1), measures={"fill": "b.fill"})
    with pytest.raises(pr.PrensaError, match=r"measures\.fill: no closed die surrounds 'b'.*add the tool or support") as error:
        next(iter(pr.solve(p)))
    assert "\n" not in str(error.value)
    *_, i = pr.solve(replace(p, measures={}))
    with pytest.raises(MeasureError, match=r"opening.*trapped_volume"):
        i.measure("b.fill")
    assert i.measure("b.pockets") == 0
    bare = replace(p, tools={}, contacts=(), measures={}, steps=(pr.Step("rest"),))
    with pytest.raises(MeasureError, match="has no tools; describe the tools"):
        parse("b.fill", bare)
    assert not list(closed_dies(discretise(in_a_box("axisymmetric", measures={"fill": "b.fill"}))))


def test_a_die_that_nothing_closes_on_the_way_of_a_step_is_refused_too() -> None:
    """Where `until` may end it: open all the way; not one that closes on the way, nor where a force moves the tool."""
    until = pr.Until(measure={"b.fill": 0.9})
    step = replace(stroke(-0.2, increments=1), until=until)
    (found,) = closed_dies(discretise(upset_block(step)))
    assert found.fatal and found.path == "steps.0.until.measure.b.fill"
    assert "or on the way of one that may end there" in found.message
    boxed = in_a_box("axisymmetric")
    assert not list(closed_dies(discretise(replace(boxed, steps=(replace(boxed.steps[0], until=until),)))))
    pushed = pr.Step("press", push={"t": {"y": -1.0}}, until=until)
    assert not list(closed_dies(discretise(upset_block(pushed))))


@pytest.mark.parametrize("lowest", [-0.6, -0.3])
def test_a_die_that_closes_on_the_way_alone_is_left_to_the_run(lowest: float) -> None:
    """A punch that goes down to a low wall (1 of 2 high) and back: closed where less than an element is between them."""
    low = pr.Polygon(points=((0, 0), (1, 0), (1, 1), (0, 1)), at=(3.0, 0))
    there_and_back = pr.Motion(y=((0, 0), (0.5, lowest), (1, 0)))
    step = pr.Step("press", move={"t": there_and_back}, until=pr.Until(measure={"b.fill": 0.9}))
    tools = {"wall": low, "t": pr.Plane(touching="b.top")}
    p = replace(in_a_box("plane strain"), tools=tools, steps=(step,))
    assert bool(list(closed_dies(discretise(p)))) == (lowest > -0.5)


def test_a_die_that_is_open_in_the_end_has_no_number_but_a_sentence() -> None:
    """Of a step that a force drives nothing is known before: what is said in the end is that no closed die was there."""
    until = pr.Until(measure={"b.fill": 0.9}, required=True)
    p = upset_block(pr.Step("press", push={"t": {"y": -1.0}}, increments=1, until=until))
    said = r"b\.fill \(no closed die surrounds 'b', and it was to reach 0\.9\) was not met; ask for what has a value"
    with pytest.raises(pr.SolveError, match=said):
        list(pr.solve(p))


def test_the_answer_of_a_run_says_how_far_the_die_is_filled(tmp_path: Path) -> None:
    """Summary, terminal and report have the share, the volume and the place of what is missing, resumed or not."""
    case = pr.Case(in_a_box("axisymmetric"), output=pr.Output(pictures=False, report=True))
    run = pr.run(case, tmp_path / "r", quiet=True)
    found = run.summary["fill"]["b"]
    assert found["missing"] == pytest.approx(found["die"] * (1 - found["fill"])) and found["unit"] == "mm³"
    line = next(text for text in run.summary["answer"] if text.startswith("die filled to"))
    assert f"{100 * found['fill']:.4g} %" in line and "missing at (2." in line
    assert line in (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert resume(tmp_path / "r", quiet=True).summary["fill"] == run.summary["fill"]


@pytest.mark.parametrize(
    ("drawn", "pockets"), [({"fixed": {"b.right": {"x": 0.01}}}, 0), ({"by": {"b.right": {"x": 0.01}}}, 0), ({}, 1)]
)
def test_what_draws_a_strip_is_no_wall_of_the_die(drawn: dict, pockets: int) -> None:
    """Behind the throat the die stands open: a flank and the drawn end enclose nothing, a flank and a side held at rest do."""
    die = pr.Polygon(points=((0.6, 2.0), (1.0, 1.99), (7.0, 8.0), (0.0, 8.0)), fillet=0.0, at=(0, 0))
    held = {"b.bottom": "y", **({} if drawn else {"b.right": "x"})}
    p = pressed_block(
        pr.Step("draw", increments=1, **drawn), size=(2.0, 2.0), n=(5, 4), element="q4", tools={"t": die},
        material=pr.Elastic(1000.0, 0.3), contacts=[pr.Contact("b.top", "t")], fixed=held,
    )  # fmt: skip
    *_, i = pr.solve(p)
    assert i.measure("b.pockets") == pockets
    assert [w.at for w in walls(p) if w.axis == 0] == [2.0] * (not drawn)


def test_walls_of_a_die_are_where_supports_have_stayed_up_to_the_step() -> None:
    """Held at rest from the first step on, or from a later one; not what was moved or released before, and held again."""
    motions = [{}, {"by": {"b.left": {"x": 0.1}}}, *({"fixed": {"b.right": how}} for how in ("x", "free", "x"))]
    steps = tuple(pr.Step(f"s{k}", **m) for k, m in enumerate(motions))
    p = replace(in_a_box("plane strain"), steps=steps)
    assert [sorted(w.at for w in walls(p, k)) for k in range(5)] == [[0.0, 0.0], [0.0], [0.0, 2.0], [0.0], [0.0]]


def test_pockets_of_open_dies_are_in_the_answer() -> None:
    """Without a closed die there is no share: number, volume and place of the pockets, the largest of several."""
    places = [{"x": 1.0, "y": 2.0, "volume": 3.0}, {"x": 4.0, "y": 5.0, "volume": 1.0}]
    found = {"fill": None, "die": 0.0, "missing": 0.0, "unit": "mm³", "places": places}
    text = answer._filled("b", found, {"bodies": {"b": {}}})
    assert text == "2 closed pockets between tools and body: 4 mm³, most at (1, 2): 3 mm³"


# ---------------------------------------------------------------------------------------------------------------- folds
def notched(depth: float = 0.8, half: float = 0.5, *, y: float = -0.3, **more) -> pr.Problem:
    """A block with a notch in its free side, which closes when the block is pressed."""
    points = [[0, 0], [4, 0], [4, 1.5 - half], [4 - depth, 1.5], [4, 1.5 + half], [4, 3], [0, 3]]
    sides = ["bottom", "right", "right", "right", "right", "top", "left"]
    return pressed_block(
        stroke(y), material=pr.J2(70e3, 0.33, pr.Linear(100, 50)), mesh=pr.Outline(points=points, sides=sides, size=0.35),
        element="t6", fixed={"b.bottom": "y", "b.left": "x"}, **more,
    )  # fmt: skip


def test_a_fold_is_reported_before_it_closes(caplog) -> None:
    """A notch of 64°: its opening falls, the warning names place and increment while there is a gap, and `until` stops there."""
    p, said = notched(), None
    with caplog.at_level(logging.WARNING, "prensa"):
        angles = [math.degrees(2 * math.atan(0.5 / 0.8))]
        try:
            for i in pr.solve(p):
                angles.append(i.measure("b.folding_angle"))
                if said is None and (text := [r.getMessage() for r in caplog.records if FOLDS in r.getMessage()]):
                    said = i.number, text[0]
        except pr.SolveError as error:
            assert "crosses itself" in str(error)
    assert said is not None and f"in increment {said[0]}, step 'press'" in said[1] and "'b.right'" in said[1]
    assert said[0] < i.number - 2 and 15 < angles[said[0]] < 45
    assert all(b < a for a, b in pairwise(angles[: said[0] + 1]))
    step = pr.Step("press", move={"t": pr.Motion(y=-0.3)}, until=pr.Until(measure={"b.folds": 1}))
    *_, last = pr.solve(replace(p, steps=(step,)))
    assert last.measure("b.folds") == 1 and "b.folds" in last.stopped and last.number <= said[0] + 1
    (fold,) = last.folding["b"].folds
    assert 3.0 < fold.x < 4.0 and abs(fold.y - 1.45) < 0.15 and fold.gap > 0.0


def others() -> dict[str, pr.Problem]:
    """Bodies that deform much and do not fold."""
    step, hard = stroke(-0.9, increments=6), pr.J2(1000, 0.3, pr.Linear(10, 50))
    blocks = {
        f"block, μ {mu}, {space}": upset_block(step, material=hard, friction=pr.Coulomb(mu), sides=("top", "right"), space=space)
        for mu in (0.0, 0.15, 0.4) for space in ("plane strain", "axisymmetric")
    }  # fmt: skip
    return blocks | {
        "t6": upset_billet(step, material=hard, friction=pr.Coulomb(0.3), sides=("top", "right"), element="t6"),
        "box": in_a_box("plane strain", depth=-0.7),
        "wide notch": notched(0.4, 1.2, y=-0.1),
        "roll": upset_block(stroke(-0.3, increments=6), material=hard, tools={"t": pr.Circle(0.7, touching="b.top")}),
    }  # fmt: skip


@pytest.mark.parametrize("name", others())
def test_ten_others_are_not_reported(name: str, caplog) -> None:
    """Barrels, faces that sides fold onto, a full box, a wide notch and the imprint of a tool are no folds."""
    with caplog.at_level(logging.WARNING, "prensa"):
        for i in pr.solve(others()[name]):
            assert i.measure("b.folds") == 0
    assert not [r for r in caplog.records if FOLDS in r.getMessage()]


@pytest.mark.parametrize("name", others())
def test_nor_are_they_in_a_single_increment(name: str, caplog) -> None:
    """As long as it can be: no fold is passed over, and none is seen where there is none."""
    p = others()[name]
    with caplog.at_level(logging.WARNING, "prensa"):
        for i in pr.solve(replace(p, steps=tuple(replace(step, increments=1) for step in p.steps))):
            assert i.measure("b.folds") == 0 and i.measure("b.fold_opening") > 1.5
    assert not [r for r in caplog.records if FOLDS in r.getMessage()]
