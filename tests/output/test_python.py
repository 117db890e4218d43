"""Views of results in Python: lines, cards, pictures, tables, grids, films, one live line, residual and tangent."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.model.problem import Output
from prensa.output.progress import ProgressBar
from problems import single_block, stroke, upset_block


def pressed(last: float = -0.2, **more) -> pr.Problem:
    """A plastic block under a plane with friction, pressed in three increments; the last ends at *last*."""
    return upset_block(
        stroke(-0.18, increments=3, tool="punch"), stroke(last, increments=1, tool="punch", name="more"),
        material=pr.J2(70e3, 0.3, pr.Linear(100, 500)), size=(4, 3), n=(4, 3), body="block", plane="punch",
        friction=pr.Coulomb(0.1), **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return pr.run(pr.Case(pressed(), output=Output(pictures=False, report=False)), tmp_path_factory.mktemp("python"), quiet=True)


@pytest.fixture(scope="module")
def increment():
    return list(pr.solve(pressed()))[-1]


# --------------------------------------------------------------------------------------------------- names, lines, cards
def test_completion_lists_the_public_names():
    """dir(prensa) has what users call, laws included, and every name of it is there."""
    names = dir(pr)
    assert {"Problem", "Coulomb", "solve", "run", "results", "evaluate", "load", "ProgressBar"} <= set(names)
    assert all(getattr(pr, name) is not None for name in names)


def test_results_fit_on_a_line(increment, result):
    """The representation of whatever a session shows is a line, not its arrays; cards are small tables."""
    contact, body = increment.contacts["block.top-punch"], increment.bodies["block"]
    for shown in (increment, increment.problem, contact, contact.points, body, result, result.increments, pr.evaluate(increment),
                  pr.evaluate(increment).contacts["block.top-punch"]):  # fmt: skip
        assert "\n" not in repr(shown) and 10 < len(repr(shown)) < 260, repr(shown)
    assert repr(increment).startswith("<Increment 4: step more, time 2, forces punch")
    for shown in (increment, contact, body, result):
        text = shown._repr_html_()
        assert text.startswith("<table") and 100 < len(text) < 6000
    assert "largest pressure" in result._repr_html_() and "punch" in increment._repr_html_()


# --------------------------------------------------------------------------------------------------------------- pictures
def test_an_increment_draws_itself(increment):
    """Fields and contact pressures are one call; notebooks get them as PNG."""
    figure = increment.plot("plastic_strain", mirror=("left",))
    assert figure.axes[0].get_title(loc="left") == "more, time 2 (increment 4)"
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert increment.plot("pressure").axes[0].get_title(loc="left") == "block.top-punch\nmore, time 2 (increment 4)"
    reference = {"mean": lambda x: 0 * x + 100.0}
    assert "mean" in increment.plot("pressure", reference=reference).axes[0].get_legend_handles_labels()[1]


def test_what_cannot_be_drawn_is_refused(increment, result):
    """Unknown fields, contacts and moments are named with the nearest there is."""
    with pytest.raises(PrensaError, match="did you mean 'mises'"):
        increment.plot("misses")
    with pytest.raises(PrensaError, match=r"did you mean 'block.top-punch'"):
        increment.plot("pressure", contact="block.top-punsh")
    with pytest.raises(PrensaError, match="'contact' belongs to 'pressure'"):
        increment.plot("mises", contact="block.top-punch")
    with pytest.raises(PrensaError, match="a step that ended: 'press', 'more'"):
        result.plot(at="pres")
    with pytest.raises(PrensaError, match="there is no increment 9"):
        result.plot(at=9)
    with pytest.raises(PrensaError, match="takes no options"):
        result.plot("energy", mesh=True)
    with pytest.raises(PrensaError, match="endings"):
        result.animate(path="film.avi")


def test_a_run_draws_any_moment_and_its_curves(result):
    """Number, step, last and largest force choose the increment; curves are those of the report."""
    assert result.plot(at="press").axes[0].get_title(loc="left") == "press, time 1 (increment 3)"
    assert result.plot("stress.yy", at=1).axes[0].get_title(loc="left") == "press, time 0.3333 (increment 1)"
    assert result.at("largest force").number == result.at("last").number == 4
    for what in ("force_stroke", "energy", "convergence"):
        assert result.plot(what).axes
    assert result.plot("pressure", at="last").axes


def test_a_film_has_a_picture_of_each_increment(result, tmp_path):
    """The GIF has as many pictures as increments, all alike in size and different in content, and a notebook shows it."""
    from PIL import Image

    film = result.animate("mises", tmp_path / "film.gif", fps=5)
    with Image.open(film.path) as image:
        assert image.n_frames == 4
        pictures = []
        for k in range(4):
            image.seek(k)
            pictures.append(np.asarray(image.convert("RGB")))
    assert all((a != b).any() for a, b in pairwise(pictures))
    assert film._repr_html_().startswith("<img")


# ----------------------------------------------------------------------------------------------------- tables and grids
def test_tables_are_those_of_the_files(result, increment):
    """History, contact and body as tables of pandas hold the same numbers as the arrays."""
    frame = result.to_frame()
    assert frame.index.name == "increment" and len(frame) == 4
    assert frame["punch.fy"].to_numpy() == pytest.approx(result.history["punch.fy"], abs=0)
    contact = increment.contacts["block.top-punch"].to_frame()
    assert list(contact.index) == increment.contacts["block.top-punch"].node.tolist()
    assert contact["pressure"].max() == increment.contacts["block.top-punch"].pressure.max()
    assert set(contact["status"]) <= {"open", "stick", "slip"}
    body = increment.bodies["block"].to_frame()
    assert body["mises"].max() == increment.bodies["block"].mises.max() and {"x", "uy", "stress.xy"} <= set(body)
    assert len(result.iterations["residual"]) >= sum(result.history["iterations"])


def test_columns_say_their_units(result):
    """Every column of a table that is not a plain number or word has a unit, beside the table and in the summary."""
    pytest.importorskip("pandas")
    frame, units = result.to_frame(), result.summary["units"]
    assert frame.attrs["units"] == units["history"] and set(units["history"]) <= set(frame.columns)
    plain = {"step", "time", "seconds", "iterations", "cutbacks", "remeshings"}
    assert set(frame.columns) - set(units["history"]) <= plain
    assert units["history"]["punch.fy"] == "N/mm" and units["history"]["punch.rz"] == "rad"
    assert units["contact"]["pressure"] == units["contact"]["error"] == "MPa" and units["contact"]["slip"] == "mm"


def test_a_grid_opens_in_pyvista(increment):
    """The grid has the deformed places, the cells and the fields of the bodies; its area is that of the deformed block."""
    pyvista = pytest.importorskip("pyvista")
    grid = increment.grid()
    body = increment.bodies["block"]
    assert isinstance(grid, pyvista.UnstructuredGrid) and grid.n_cells == 12
    assert np.array_equal(np.asarray(grid.points)[:, :2], body.x)
    assert np.array_equal(np.asarray(grid["mises"]), body.mises)
    outer = body.x[[0, *range(1, 5), 9, 14, *range(19, 14, -1), 10, 5]]  # round the outline, corner by corner
    x, y = outer.T
    shoelace = 0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    assert float(grid.compute_cell_sizes()["Area"].sum()) == pytest.approx(shoelace, rel=1e-6)


def test_what_is_not_installed_is_named_with_its_extra(increment, result, monkeypatch):
    """Without pandas or pyvista the message says what to install."""
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(PrensaError, match=r"pip install prensa\[notebook\]"):
        result.to_frame()
    with pytest.raises(PrensaError, match=r"pip install prensa\[view\]"):
        increment.grid()


# ------------------------------------------------------------------------------------------------------------ progress
def test_a_notebook_shows_one_line(monkeypatch):
    """In a notebook every event replaces the text of one line: one display, any number of updates."""
    import IPython
    from IPython import display as module

    shown: list[str] = []
    updates: list[str] = []

    class Handle:
        def update(self, text, raw):
            updates.append(text["text/plain"])

    def display(text, raw, display_id):
        shown.append(text["text/plain"])
        return Handle()

    monkeypatch.setattr(IPython, "get_ipython", lambda: type("Shell", (), {"kernel": object()})())
    monkeypatch.setattr(module, "display", display)
    with ProgressBar() as bar:
        for _ in pr.solve(pressed(), monitor=bar):
            pass
        bar.say("completed")
    assert len(shown) == 1 and len(updates) >= 4 and updates[-1] == "completed"
    assert "increment 4, time 2 of 2" in updates[-2] and "left 0:00:00" in updates[-2]


# ------------------------------------------------------------------------------------------------- residual and tangent
def test_a_linear_body_has_its_stiffness(tmp_path):
    """Of one elastic block pulled without contact, K u gives the reactions, which are E' ε times the area."""
    E, nu = 1000.0, 0.25
    problem = single_block(
        pr.Step("pull", increments=1), material=pr.Elastic(E, nu), size=(2, 1), n=(2, 1), element="q4",
        fixed={"b.left": "x", "b.bottom": "y", "b.right": pr.Fixed(x=0.01)}, kinematics="small",
    )  # fmt: skip
    (increment,) = pr.solve(problem, pr.Numerics(condense=False))
    e = pr.evaluate(increment)
    assert e.residual < 1e-12 and e.K.shape == (12, 12)
    assert e.r == pytest.approx(e.K @ e.u, abs=1e-10)
    right = e.nodes["b"][increment.bodies["b"].X[:, 0] == 2.0, 0]
    assert e.r[right].sum() == pytest.approx(E / (1 - nu**2) * 0.005, rel=1e-12)  # plane strain, free above
    assert abs(e.K - e.K.T).max() < 1e-9


def test_the_tangent_is_the_slope_of_the_force():
    """dF/dδ of a plastic block with friction, from K alone, is the difference of two solved problems."""
    ends = [list(pr.solve(pressed(last)))[-1] for last in (-0.2, -0.2 - 1e-6, -0.2 + 1e-6)]
    slope = (ends[2].force("punch").y - ends[1].force("punch").y) / 2e-6
    e = pr.evaluate(ends[0])
    assert e.residual < 1e-9
    moved = np.zeros(len(e.u))
    moved[e.tools["punch"][1]] = 1.0
    change = moved + e.solve(-(e.K @ moved))
    assert -(e.K @ change)[e.tools["punch"][1]] == pytest.approx(slope, rel=1e-5)


def test_contact_blocks_are_the_contacts_share(increment):
    """Summed into the tool's degrees of freedom, the blocks are the force on it; pairs share the tool."""
    e = pr.evaluate(increment)
    block = e.contacts["block.top-punch"]
    r = np.zeros(len(e.r))
    np.add.at(r, block.dofs, block.r)
    assert -r[e.tools["punch"]] == pytest.approx(np.array(increment.force("punch")), rel=1e-12, abs=1e-9)
    assert block.K.shape == (5, 5, 5) and block.closed.all()
    assert e.r[e.tools["punch"][1]] == pytest.approx(-increment.force("punch").y)


def test_evaluate_says_what_it_cannot_do(result):
    """An increment read back from a folder has no committed state, and the message says so."""
    with pytest.raises(PrensaError, match="was not solved here"):
        pr.evaluate(pr.results(result.directory).increments[-1])


def test_a_run_is_read_back_by_its_folder(result, tmp_path):
    """results(folder) has status, last increment and history; a folder without a run is refused."""
    again = pr.results(result.directory)
    assert again.status == "completed" and again.increment.force("punch") == result.increment.force("punch")
    assert again.increments[1].contacts["block.top-punch"].pressure.max() > 0
    with pytest.raises(PrensaError, match="there is no summary"):
        pr.results(tmp_path)


@pytest.mark.parametrize("kinematics", ["finite", "small"])
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
def test_equations_balance_with_every_enforcement(enforcement, kinematics):
    """Whatever enforces contact, and with bodies condensed in the solver, the equations assembled again are those solved."""
    small = kinematics == "small"
    problem = upset_block(
        stroke(-0.1, increments=2, tool="punch"), tools={"punch": pr.Circle(radius=6, touching="b.top")}, size=(4, 3),
        n=(4, 3), enforcement=enforcement, friction=pr.Coulomb(0.2), kinematics=kinematics,
        contact_geometry="reference" if small else "current",
    )  # fmt: skip
    for increment in pr.solve(problem, pr.Numerics(condense=True if small else "auto")):
        e = pr.evaluate(increment)
        assert e.residual < 1e-9
        assert -e.r[e.tools["punch"][1]] == pytest.approx(increment.force("punch").y, rel=1e-12)


def test_equations_of_tied_bodies_balance_in_their_masters():
    """With a tie the transformation hands the slaves' forces to their masters, and those vanish."""
    upper = pr.Body(pr.Rectangle((4, 2), (4, 2)), pr.J2(1e3, 0.3, pr.Linear(5, 10)))
    lower = pr.Body(pr.Rectangle((4, 2), (3, 2), origin=(0, -2)), pr.Elastic(2e3, 0.3))
    problem = pr.Problem(
        "tied", bodies={"a": upper, "b": lower}, ties=(pr.Tie("a.bottom", "b.top"),), tools={"punch": pr.Plane(touching="a.top")},
        friction=pr.Coulomb(0.1), contacts=(pr.Contact("a.top", "punch"),), fixed={"b.bottom": "xy"},
        steps=(pr.Step("press", move={"punch": {"y": -0.05}}, increments=2),),
    )  # fmt: skip
    e = pr.evaluate(list(pr.solve(problem))[-1])
    assert e.residual < 1e-9 < float(np.abs(e.r[e.nodes["a"]]).max())
