"""A run read back from its folder, its largest values, and the pictures made of it."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

import prensa as pr
from prensa.errors import CaseError, PrensaError
from prensa.model.problem import Output
from prensa.output import plot
from prensa.output.maxima import leading_tool, maxima, thinning
from prensa.output.packing import Packer
from prensa.output.report import stored_run
from prensa.output.run import run
from prensa.result.increment import BodyState
from problems import single_block, stroke, upset_block


def strip() -> pr.Problem:
    """A thin strip that is stretched by 10 %, then held, while a roll turns on it."""
    return upset_block(
        pr.Step("stretch", fixed={"strip.right": pr.Fixed(x=1.0)}, increments=3),
        stroke(-0.15, increments=2, tool="roll"),
        pr.Step("turn", move={"roll": pr.Motion(y=-0.15, rz=0.05)}, increments=2),
        tools={"roll": pr.Circle(radius=4, touching="strip.top")}, material=pr.J2(70e3, 0.3, pr.Linear(100, 500)),
        size=(10, 1), n=(10, 2), body="strip", friction=pr.Coulomb(0.2),
    )  # fmt: skip


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    directory = tmp_path_factory.mktemp("strip")
    kept = list(pr.solve(strip()))
    result = run(pr.Case(strip(), output=Output(pictures=True, report=False)), directory, quiet=True)
    return result, kept


def test_what_is_read_back_is_what_was_solved(done):
    """Tools, energies, supports, bodies and contacts of every increment are those that solve yields, bit for bit."""
    stored = stored_run(done[0].directory)
    assert len(stored) == len(done[1]) and stored[-1].number == len(stored)
    for ours, solved in zip(stored, done[1], strict=True):
        for name in ("step", "step_number", "number", "time", "energy", "supports", "end_of_step"):
            assert getattr(ours, name) == getattr(solved, name), name
        assert ours.force("roll") == solved.force("roll") and ours.tools["roll"].place == solved.tools["roll"].place
        a, b = ours.bodies["strip"], solved.bodies["strip"]
        for name in ("x", "cells", "stress", "mises", "plastic_strain", "reaction"):
            assert np.array_equal(getattr(a, name), getattr(b, name)), name
        assert np.abs(a.X - b.X).max() < 1e-14
        p, q = ours.contacts["strip.top-roll"], solved.contacts["strip.top-roll"]
        for name in ("node", "X", "x", "gap", "pressure", "shear", "slip", "status", "pressure_from_stress", "error", "area"):
            assert np.array_equal(getattr(p, name), getattr(q, name)), name
    with pytest.raises(PrensaError, match="no committed state"):
        stored[0].state  # noqa: B018
    with pytest.raises(IndexError):
        stored[99]


def test_fields_that_were_not_written_say_so(tmp_path):
    """Asking for the shape of an increment without fields names those that have them and the key that writes all."""
    result = run(pr.Case(synthetic_like(), output=Output(fields=0, pictures=False, report=False)), tmp_path, quiet=True)
    stored = stored_run(result.directory)
    assert stored.with_fields == (2,)
    with pytest.raises(PrensaError, match=r"fields of increment 1 were not written; 1 increments have theirs: 2; .*fields: 1"):
        stored[0].bodies  # noqa: B018


def synthetic_like() -> pr.Problem:
    return single_block(
        pr.Step("press", increments=2), size=(2, 1), n=(2, 1), body="block",
        fixed={"block.bottom": "y", "block.left": "x", "block.top": pr.Fixed(y=-0.01)}, kinematics="small",
    )  # fmt: skip


def test_largest_values_are_those_of_the_increments(done):
    """Each row of the table is the largest value over what solve yielded, in its increment and at its place."""
    found = {(m.what, m.of): m for m in maxima(stored_run(done[0].directory))}
    kept = done[1]
    pressure = max(kept, key=lambda i: i.contacts["strip.top-roll"].pressure.max())
    row, contact = found["pressure", "strip.top-roll"], pressure.contacts["strip.top-roll"]
    assert (row.value, row.increment) == (contact.pressure.max(), pressure.number)
    assert row.place == tuple(contact.x[np.argmax(contact.pressure)])
    assert found["moment", "roll"].value == max((i.force("roll").m for i in kept), key=abs)
    assert found["force y", "roll"].value == max(i.force("roll").y for i in kept)
    strain = max(kept, key=lambda i: i.bodies["strip"].plastic_strain.max())
    assert found["plastic strain", "strip"].increment == strain.number
    assert found["thinning", "strip"].value > 5.0  # 10 % longer at nearly constant volume, and pressed


def test_thinning_of_a_sheet_is_exact():
    """A sheet made uniformly thinner by 7 % and bent round a quarter circle thins by 7 %; a block is no sheet."""
    s, t = np.meshgrid(np.linspace(0, 10, 21), np.linspace(0, 1, 3), indexing="ij")
    X = np.column_stack([s.ravel(), t.ravel()])
    radius, angle = 20 / np.pi + 0.93 * X[:, 1], X[:, 0] * np.pi / 20
    x = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    cells = np.zeros((1, 4), dtype=np.int64)
    zeros = np.zeros(len(X))
    thinned = thinning(BodyState(X, x, cells, x, np.zeros((len(X), 4)), zeros, zeros))
    assert thinned is not None and thinned[0] == pytest.approx(0.07, abs=1e-12) and len(thinned[0]) == 21
    block = BodyState(X * (0.1, 1.0), x, cells, x, np.zeros((len(X), 4)), zeros, zeros)
    assert thinning(block) is None


def test_the_tool_that_works_leads():
    """The abscissa of forces belongs to the tool with the largest work, not to the one that goes furthest."""
    problem = single_block(
        pr.Step("a"), tools={"far": pr.Plane(touching="b.top"), "strong": pr.Plane(touching="b.right")},
        material=pr.Elastic(1, 0.3), size=(1, 1), n=(1, 1), fixed={"b.bottom": "xy"},
    )  # fmt: skip
    zero, one = np.zeros(3), np.arange(1.0, 4.0)
    table = {f"{t}.{c}": zero for t in ("far", "strong") for c in ("ux", "uy", "rz", "fx", "fy", "mz")} | {"time": one}
    assert leading_tool(table, problem) is None
    table |= {"far.uy": -10 * one, "far.fy": 0.01 * one, "strong.ux": -one, "strong.fx": 5 * one}
    assert leading_tool(table, problem) == "strong"


def test_a_tool_that_stands_still_makes_no_spike(done):
    """No piece of a force curve is vertical: what happens without travel is left out."""
    figure = plot.force_stroke(done[0].history, strip())
    for axes in figure.axes:
        for line in axes.get_lines():
            x, y = (np.asarray(v, dtype=float) for v in line.get_data())
            if len(x) > 2:
                assert not ((np.diff(x) == 0) & (np.diff(y) != 0)).any()
    s, f = plot.broken(np.array([0.0, 1, 2, 2, 2, 3, 4]), np.array([0.0, 5, 6, 99, 1, 2, 3]))
    assert np.array_equal(f[~np.isnan(f)], [0, 5, 6, 1, 2, 3]) and np.isnan(f[3:]).any() and len(s) == len(f)


def test_rolls_have_a_panel_for_their_moments(done):
    """A tool that turns has its moment drawn below the forces."""
    labels = [a.get_ylabel() for a in plot.force_stroke(done[0].history, strip()).axes]
    assert labels == ["force on the tool (N/mm)", "moment (N mm/mm)"]


def test_pictures_show_the_ends_of_steps_and_the_largest_force(done):
    """Earlier steps and the largest force have pictures of their own."""
    names = {p.name for p in (done[0].directory / "pictures").glob("*.png")}
    assert {"deformed_step1_stretch.png", "deformed_step2_press.png", "deformed.png", "pressure_strip.top-roll.png"} <= names


@pytest.mark.parametrize("mirror", [("left",), ("bottom",), ("left", "bottom")])
def test_half_models_are_mirrored_on_request(mirror):
    """The picture spans the whole part, shear stress and the displacement across change sign in the image."""
    increment, problem = synthetic.increment(n=(8, 4)), synthetic.problem()
    box = plot.limits(increment, problem, mirror)
    plain = plot.limits(increment, problem)
    if "left" in mirror:
        assert box[0] == pytest.approx(-box[1]) and box[1] >= plain[1] - 1e-9
    if "bottom" in mirror:
        assert box[2] + box[3] == pytest.approx(-80.0)
    copies = plot.images(plot.mirror_lines(increment, problem, mirror))
    assert len(copies) == 2 ** len(mirror) and copies[0].sign("stress.xy", problem) == 1
    assert copies[1].sign("stress.xy", problem) == -1 and copies[1].sign("mises", problem) == 1
    assert copies[1].sign(f"displacement.{'x' if mirror[0] == 'left' else 'y'}", problem) == -1
    assert plot.deformed(increment, problem, "stress.xy", mirror=mirror).axes


def test_mirrors_that_make_no_sense_are_refused():
    """Two sides of one direction, a side that is none, and the axis a second time are refused with the reason."""
    from prensa.model.schema import dump, loads

    increment = synthetic.increment(n=(4, 2))
    with pytest.raises(PrensaError, match="left side too"):
        plot.deformed(increment, synthetic.problem(space="axisymmetric"), mirror=("left",))
    with pytest.raises(PrensaError, match="no side 'up'"):
        plot.deformed(increment, synthetic.problem(), mirror=("up",))
    text = dump(pr.Case(synthetic.problem(space="axisymmetric")))
    with pytest.raises(CaseError, match="in axisymmetry, whose axis mirrors"):
        loads(text + "output: {mirror: left}\n")
    with pytest.raises(CaseError, match="one side of"):
        loads(dump(pr.Case(synthetic.problem())) + "output: {mirror: [left, right]}\n")


def test_packed_arrays_are_small_and_keep_their_ends():
    """Smooth fields in time need about a byte a number, whatever the range; constants and empty arrays are possible."""
    packer = Packer()
    x = np.linspace(0, 6, 4000)
    frames = [np.sin(x + 0.05 * k) * (1 + 0.1 * k) for k in range(30)]
    reference = packer.quantised(frames, 12, -4.0, 4.0)
    assert reference["shape"] == [30, 4000] and reference["scale"] == 8 / 4095
    assert len(packer.text()) < 1.3 * 30 * 4000
    for values in ([np.zeros(0)], [np.full(5, 3.0)]):
        packer.quantised(values, 12, 3.0, 3.0)
    packer.whole(np.zeros((0, 4), dtype=int))
    packer.floats(np.zeros((2, 0)))
    packer.text()
