"""Folds are reported before they close, and `until` meets the moment at which one begins, however long increments are."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

import prensa as pr
from prensa.checks.during.closing import FOLDS
from prensa.mesh.mesh import segments
from prensa.mesh.overlap import overlaps
from prensa.result import whole_outline as whole_outlines
from prensa.result.folding import UNFOLDED, Fold, Folding, Outlined, folding
from prensa.solver.before_folds import before_it_closes
from prensa.system.failure import Folded
from problems import pressed_block, stroke

INCREMENTS = (12, 4, 1)  # of a step in which the fold begins after 0.29 and has closed after 0.53 of it


def notched(*notches: float, until: pr.Until | None = None, increments: int | None = None, **more) -> pr.Problem:
    """A soft block with notches of 64° in its free side, at these heights, which close when it is pressed."""
    points, sides = [[0.0, 0.0], [4.0, 0.0]], ["bottom"]
    for y in notches:
        points += [[4.0, y - 0.5], [3.2, y], [4.0, y + 0.5]]
        sides += ["right"] * 3
    points += [[4.0, notches[-1] + 1.5], [0.0, notches[-1] + 1.5]]
    step = replace(stroke(-0.7 * len(notches), increments=increments), until=until)
    return pressed_block(
        step, material=pr.Elastic(1000.0, 0.3), mesh=pr.Outline(points=points, sides=[*sides, "right", "top", "left"], size=0.35),
        element="t6", fixed={"b.bottom": "y", "b.left": "x"}, **more,
    )  # fmt: skip


def followed(problem: pr.Problem, caplog, **options) -> tuple[list[tuple[pr.Increment, int]], list[str], pr.SolveError | None]:
    """Increments, each with the number of folds that were reported by then; the words of all reports; and what ended the run."""
    done, error = [], None

    def said() -> list[str]:
        return [r.getMessage() for r in caplog.records if FOLDS in r.getMessage()]

    with caplog.at_level(logging.WARNING, "prensa"):
        try:
            for i in pr.solve(problem, **options):
                done.append((i, len(said())))
        except pr.SolveError as caught:
            error = caught
    return done, said(), error


def through(i: pr.Increment) -> bool:
    """Whether the outline has passed through itself at all."""
    shape = i.shapes["b"]
    return bool(overlaps(shape.x, segments(pr.discretise(i.problem).meshes["b"].boundary)))


@pytest.mark.parametrize("increments", INCREMENTS)
def test_a_fold_is_reported_while_it_is_open(increments: int, caplog) -> None:
    """In a converged increment whose outline crosses nowhere, and once; then the run ends as the flanks meet."""
    done, said, error = followed(notched(1.5, increments=increments), caplog)
    assert len(said) == 1 and "have met" not in said[0]
    first = next(i for i, reports in done if reports)
    assert first.measure("b.folds") == 1 and 0.0 < first.measure("b.fold_opening") < 1.0 and not through(first)
    assert first.folding["b"].folds[0].gap > 0.0 and 0.29 < first.time < 0.53
    assert error is not None and isinstance(error.reason, Folded) and first.number <= error.last.number
    for i, _ in done:
        assert (i.measure("b.folds") >= 1) == (i.measure("b.fold_opening") < 1.0) and (i.time > 0.29 or not i.folding["b"].folds)


def test_where_the_ends_of_increments_are_given_it_is_reported_all_the_same(caplog) -> None:
    """The increment is not cut, since nobody may; what is between its ends is looked at for the report."""
    done, said, error = followed(notched(1.5), caplog, times=[0.25, 1.0])
    assert [i.time for i, _ in done] == [0.25] and error is not None and isinstance(error.reason, Folded)
    assert len(said) == 1 and "in increment 2" in said[0] and "have met" not in said[0]


@pytest.mark.parametrize("increments", INCREMENTS)
def test_the_moment_at_which_a_fold_begins_is_met(increments: int) -> None:
    """By the count and by the opening, at the same stroke: what decides is the shape, of a body without history."""
    ends = []
    for measure in ("b.folds", "b.fold_opening"):
        *_, last = pr.solve(notched(1.5, until=pr.Until(measure={measure: 1}), increments=increments))
        assert measure in last.stopped and last.measure("b.fold_opening") == pytest.approx(1.0, abs=2e-8)
        ends.append(last)
    by_count, by_opening = ends
    assert by_count.measure("b.folds") == 1 and by_opening.measure("b.fold_opening") >= by_count.measure("b.fold_opening")
    assert by_count.time == pytest.approx(by_opening.time, abs=1e-7) == pytest.approx(0.29111, abs=2e-5)


METAL = pr.J2(1000.0, 0.3, pr.Swift(50.0, 0.01, 0.2))


@pytest.mark.parametrize("increments", [12, 1])
def test_a_fold_of_metal_is_met_where_no_other_place_forms(increments: int) -> None:
    """Metal bends at the notch alone: a count of one stays one until the flanks meet, and is met where it becomes one."""
    ends = []
    for measure in ("b.folds", "b.fold_opening"):
        problem = notched(1.5, until=pr.Until(measure={measure: 1}), increments=increments)
        *_, last = pr.solve(replace(problem, bodies={"b": replace(problem.bodies["b"], material=METAL)}))
        assert last.measure("b.fold_opening") == pytest.approx(1.0, abs=2e-8) and "jumps" not in last.stopped
        ends.append(last)
    assert ends[0].measure("b.folds") == 1 and ends[0].time == pytest.approx(ends[1].time, abs=1e-7)


def of_metal_on_new_meshes(problem: pr.Problem, travel: float) -> pr.Problem:
    """A problem whose body flows, on a new mesh after each ``travel`` of the tool."""
    remesh = pr.Remesh(pr.Sizes(far=0.35, near_tools=0.35, per_strain=0.0), pr.When(travel=travel))
    return replace(problem, bodies={"b": replace(problem.bodies["b"], material=METAL)}, remesh=remesh)


@pytest.mark.parametrize(("symmetric", "travel"), [(False, 0.02), (True, 0.02)])
def test_a_fold_is_reported_once_on_however_many_meshes(symmetric: bool, travel: float, caplog) -> None:
    """Of a whole model and of a half: what is known of the old outline is known of the new one."""
    done, said, _ = followed(of_metal_on_new_meshes(half() if symmetric else notched(1.5), travel), caplog)
    folded = [i.remeshings for i, reports in done if reports]
    assert len(said) == 1 and folded[-1] - folded[0] >= 4


def test_folds_of_an_increment_are_computed_once(monkeypatch) -> None:
    """Those that may shorten it are those that are reported; the outline is found once for a mesh."""
    folds, outlines = [], []
    found = Outlined.folding
    monkeypatch.setattr(Outlined, "folding", lambda at, below: folds.append(at.u.copy()) or found(at, below))
    monkeypatch.setattr(whole_outlines, "_whole", lambda *given, of=whole_outlines._whole: outlines.append(given) or of(*given))
    done = list(pr.solve(notched(1.5, until=pr.Until(travel={"t": pr.ToolTravel(y=-0.15)}), increments=10)))
    assert len(done) == 3 and len(outlines) == 1
    assert len(folds) == len(done) + 1  # the increment that is ended early was looked at as a whole
    assert len({u.tobytes() for u in folds}) == len(folds)


def test_each_place_is_reported(caplog) -> None:
    """Two notches in one side are two folds, in one long increment too; a count of two is met where the second begins."""
    done, said, _ = followed(notched(1.5, 3.5, increments=2), caplog)
    assert len(said) == 2 and all("have met" not in words for words in said)
    assert {round(i.folding["b"].folds[0].y) for i, reports in done if reports} <= {1, 2, 3}
    *_, one = pr.solve(notched(1.5, 3.5, until=pr.Until(measure={"b.folds": 1}), increments=4))
    *_, two = pr.solve(notched(1.5, 3.5, until=pr.Until(measure={"b.folds": 2}), increments=4))
    assert one.measure("b.folds") == 1 and two.measure("b.folds") == 2 and one.time < two.time
    assert two.folding["b"].folds[1].opening == pytest.approx(1.0, abs=3e-8)


def test_openings_change_little_from_one_increment_to_the_next() -> None:
    """From 2 on a straight side down to where the flanks all but meet, steadily and without jumps: a step can end there too."""
    problem = notched(1.5, until=pr.Until(measure={"b.fold_opening": 0.1}), increments=50)
    openings = [UNFOLDED, *(i.measure("b.fold_opening") for i in pr.solve(problem))]
    steps = -np.diff(openings)
    assert (steps > 0.0).all() and steps.max() < 0.1 and openings[-1] == pytest.approx(0.1, rel=1e-7)


def test_what_locates_a_count_grows_continuously_to_each_number() -> None:
    """The next place that forms counts by its share: none when straight, all where its fold begins."""

    def place(opening: float) -> Fold:
        return Fold(np.arange(3), np.arange(3), 0.0, 0.0, 1.0, opening)

    assert Folding(180.0, ()).counted(1) == 0.0 and Folding(180.0, ()).opening == UNFOLDED
    assert Folding(90.0, (), (place(1.25), place(1.5))).counted(1) == 0.75
    assert Folding(90.0, (place(0.5),), (place(1.75),)).counted(2) == 1.25
    assert Folding(90.0, (), (place(1.0),)).counted(1) == 1.0 < Folding(90.0, (place(1.0 - 1e-12),)).counted(1) < 1.0 + 2e-12
    assert Folding(90.0, (place(0.25),)).counted(1) == 1.75  # it goes on as the fold closes


@pytest.mark.parametrize(
    ("begins", "closes", "fails", "ends"),
    [
        (0.3, 0.5, 2.0, (0.3, 0.5)), (0.05, 0.1, 0.6, (0.05, 0.1)), (0.4, 0.4, 2.0, None), (0.3, 0.9, 0.2, None),
        (0.5, 2.0, 2.0, None),
    ],
)
def test_increments_are_halved_until_the_fold_is_open(begins: float, closes: float, fails: float, ends: tuple | None) -> None:
    """Past attempts that fail; what jumps, or cannot be computed in between, leaves the increment as long as it was."""
    tried = []

    def solve(time: float):
        tried.append(time)
        context = SimpleNamespace(time=time, state=SimpleNamespace(clock=SimpleNamespace(time=0.0)))
        return context, SimpleNamespace(converged=time < fails or time == 1.0)

    def new(outcome) -> list[Fold]:
        time, none = outcome[0].time, np.arange(3)
        gap = 0.0 if time >= closes else 1.0
        return [Fold(none, none, 0.0, 0.0, gap, 0.5 * gap)] if time >= begins else []

    whole = solve(1.0)
    found = before_it_closes(new, whole, solve, 1e-5)
    assert len(tried) < 20 and found.found is (ends is not None)
    if ends is None:
        assert found.outcome is whole
    else:
        assert ends[0] <= found.outcome[0].time < ends[1] and found.outcome[1].converged


# ------------------------------------------------------------------------------------------------------------- half models
OUTLINE = ((0.0, 0.0), (3.2, 0.0), (4.0, 0.5), (4.0, 1.5), (0.0, 1.5))
NAMES = ("bottom", "right", "right", "top", "left")


def half(axis: int = 1, **more) -> pr.Problem:
    """The half of a block with one notch of 64° that lies across y = 0, or with the axes changed across x = 0."""
    points, names = OUTLINE, NAMES
    if axis == 0:
        points, names = tuple(p[::-1] for p in OUTLINE[::-1]), ("right", "top", "top", "left", "bottom")
    given = {
        "fixed": {"b.bottom": "y", "b.left": "x"}, "mesh": pr.Outline(points=points, sides=names, size=0.35),
        "material": pr.Elastic(1000.0, 0.3), "element": "t6",
    }  # fmt: skip
    return pressed_block(stroke(-0.35, increments=10), **given | more)


def whole(of: pr.Problem, axis: int, folder: Path) -> pr.Problem:
    """The whole of a half, on its mesh and the mirror image of that."""
    mesh = pr.discretise(of).meshes["b"]
    n, on = len(mesh.points), mesh.points[:, axis] == 0.0
    image = np.where(on, np.arange(n), n + np.cumsum(~on) - 1)
    points = np.concatenate([mesh.points, mesh.points[~on] * ([1.0, -1.0] if axis == 1 else [-1.0, 1.0])])
    cells = np.concatenate([mesh.cells, image[mesh.cells[:, [0, 2, 1, 5, 4, 3]]]])
    meshio.write(folder / "whole.vtu", meshio.Mesh(np.c_[points, np.zeros(len(points))], [("triangle6", cells)]))
    tools = {"t": pr.Plane(touching="b.top"), "d": pr.Plane(touching="b.bottom", normal=(0, 1))}
    contacts = [pr.Contact("b.top", "t"), pr.Contact("b.bottom", "d")]
    step = replace(of.steps[0], move={"t": pr.Motion(y=-0.35), "d": pr.Motion(y=0.35)})
    body = pr.Body(pr.File(str(folder / "whole.vtu")), of.bodies["b"].material, "t6")
    return replace(of, bodies={"b": body}, tools=tools, contacts=contacts, fixed={"b.left": "x"}, steps=(step,))


def test_a_half_model_has_the_opening_and_the_count_of_the_whole(tmp_path: Path, caplog) -> None:
    """In each increment until the flanks meet, and `until` ends both at one time; the report names the line."""
    one = half()
    both = whole(one, 1, tmp_path)
    done, said, _ = followed(one, caplog)
    caplog.clear()
    reference, words, error = followed(both, caplog)
    assert error is not None and len(said) == 1 == len(words) and "mirror image across y = 0" in said[0]
    compared = 0
    for (i, reports), (j, known) in zip(done, reference, strict=False):
        if j.measure("b.fold_opening") > 0.0:
            for name in ("fold_opening", "folding_angle"):
                assert i.measure(f"b.{name}") == pytest.approx(j.measure(f"b.{name}"), rel=1e-6)
            assert (i.measure("b.folds"), reports) == (j.measure("b.folds"), known) and i.time == j.time
            compared += 1
    assert compared >= 5 and reference[compared - 1][1] == 1
    until = pr.Until(measure={"b.folds": 1})
    ends = [list(pr.solve(replace(p, steps=(replace(p.steps[0], until=until),))))[-1] for p in (one, both)]
    assert ends[0].time == pytest.approx(ends[1].time, abs=1e-8) and ends[0].measure("b.folds") == 1
    # where the flank lies on the line the fold has closed, and it stays one
    last, _ = done[-1]
    assert last.time == 1.0 and last.measure("b.fold_opening") == 0.0 and last.measure("b.folds") == 1


@pytest.mark.parametrize(("axis", "space"), [(0, "plane strain"), (0, "axisymmetric"), (1, "axisymmetric")])
def test_the_axis_and_lines_of_both_directions_are_looked_across(axis: int, space: str, tmp_path: Path) -> None:
    """Of the same motion of half and whole, the axis of revolution being one of symmetry of the section."""
    one = half(axis, space=space)
    system, other = pr.discretise(one), pr.discretise(whole(half(axis), axis, tmp_path))
    seen = []
    for closed in (0.5, 0.9, 0.99):

        def moved(system: pr.System, by: float = closed) -> np.ndarray:
            u = system.initial().u.copy()
            along = system.X[:, 1 - axis] / 4.0
            u[system.dofs.displacement.dof(np.arange(len(system.X)), "xy"[axis])] = -by * along * system.X[:, axis]
            return u

        found, reference = (folding(s, moved(s), s.initial().u)["b"] for s in (system, other))
        assert found.opening == pytest.approx(reference.opening, rel=1e-9)
        assert found.angle == pytest.approx(reference.angle, rel=1e-9)
        assert len(found.folds) == len(reference.folds)
        seen.append(found.opening)
    assert seen[0] > 1.0 > seen[-1]


def test_a_straight_side_is_none_at_a_line_nor_where_there_is_no_line() -> None:
    """A smooth block stays straight; of a body that may go beyond its lines (`no_contact`) no mirror image is looked at."""
    *_, flat = pr.solve(half(mesh=pr.Rectangle((4.0, 1.5), (8, 3)), element="q8"))
    assert flat.measure("b.fold_opening") == pytest.approx(UNFOLDED, rel=1e-9) and flat.measure("b.folds") == 0
    system = pr.discretise(half(no_contact=[pr.NoContact("b", "symmetry")]))
    u = system.initial().u.copy()
    u[system.dofs.displacement.dof(np.arange(len(system.X)), "y")] = -0.9 * system.X[:, 0] / 4.0 * system.X[:, 1]
    found = folding(system, u, system.initial().u)["b"]
    assert not found.folds and all(f.across is None for f in found.forming)
