import dataclasses
import struct
from contextlib import closing

import numpy as np
import pytest
import synthetic

import prensa as pr
from prensa.errors import PrensaError
from prensa.geometry.outline import nearest_to_box
from prensa.output import history, plot
from prensa.output.outline import outlines
from prensa.result.increment import Force, Place, ToolState


def picture_of(figure, tmp_path) -> np.ndarray:
    """Pixels (h, w, 4) of the figure as it is written."""
    path = plot.save(figure, tmp_path / "a.png")
    assert struct.unpack(">II", path.read_bytes()[16:24]) > (300, 200)
    canvas = figure.canvas
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


@pytest.mark.parametrize("field", plot.FIELDS)
def test_every_field_gives_a_picture(tmp_path, field):
    """Each field name draws something in more than a few colours."""
    pixels = picture_of(plot.deformed(synthetic.increment(n=(8, 4)), synthetic.problem(), field), tmp_path)
    assert len(np.unique(pixels.reshape(-1, 4), axis=0)) > 50


def test_an_unknown_field_is_answered_with_the_nearest(tmp_path):
    """A misspelt field is refused with a suggestion."""
    with pytest.raises(PrensaError, match="did you mean 'mises'"):
        plot.deformed(synthetic.increment(n=(4, 2)), synthetic.problem(), "misses")


def test_lines_leave_room_for_colours():
    """Edges of elements are drawn where they can be distinguished or are asked for; seen from afar an outline is thinner."""
    increment, problem = synthetic.increment(n=(8, 4)), synthetic.problem()

    def lines(**options) -> tuple[bool, float]:
        found = plot.deformed(increment, problem, **options).axes[0].collections
        widths = [float(c.get_linewidth()[0]) for c in found if c.zorder == 3]
        return any(type(c).__name__ == "PolyCollection" for c in found), min(widths)

    afar = (0.0, 8000.0, -4000.0, 100.0)
    assert lines() == (True, plot.OUTLINE)
    assert not lines(box=afar)[0] and lines(box=afar)[1] < 0.5 * plot.OUTLINE
    assert lines(box=afar, mesh=True)[0] and not lines(mesh=False)[0]


def test_axisymmetric_sections_are_mirrored():
    """In axisymmetry the picture reaches as far to the left of the axis as to the right."""
    figure = plot.deformed(synthetic.increment(n=(8, 4)), synthetic.problem(space="axisymmetric"))
    low, high = figure.axes[0].get_xlim()
    assert low == pytest.approx(-high) and figure.axes[0].get_xlabel() == "r (mm)"


def test_labels_carry_the_units_of_the_case():
    """Axes name quantity and unit of the case, whatever they are."""
    problem = synthetic.problem(units=pr.Units(length="m", force="kN"))
    axes = plot.pressure(synthetic.increment().contacts[synthetic.CONTACT], problem).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (m)", "traction (kPa)")


def test_a_profile_shows_both_pressures_and_the_reference():
    """Nodal forces, recovered stress, smoothed stress, shear and a given reference are labelled curves."""
    contact = synthetic.increment().contacts[synthetic.CONTACT]
    axes = plot.pressure(contact, synthetic.problem(), {"Hertz": lambda x: 1e3 + 0 * x}).axes[0]
    labels = axes.get_legend_handles_labels()[1]
    assert labels == ["p, nodal forces", "p, recovered stress", "p, smoothed stress", "|shear|, nodal forces", "Hertz"]


def test_a_profile_without_contact_says_so(tmp_path):
    """An open contact still gives a picture, which says that nothing touches."""
    contact = synthetic.increment(touching=False).contacts[synthetic.CONTACT]
    figure = plot.pressure(dataclasses.replace(contact, pressure_from_stress=0 * contact.gap), synthetic.problem())
    assert "no contact" in [t.get_text() for t in figure.axes[0].texts]
    picture_of(figure, tmp_path)


@pytest.mark.parametrize("count", [1, 10])
def test_time_series_are_drawn_from_the_first_increment_on(tmp_path, count):
    """Force, energy and convergence pictures need no more than one increment."""
    with closing(history.History(tmp_path, synthetic.problem())) as writer:
        for n in range(1, count + 1):
            writer.append(synthetic.increment(n))
    table, iterations = history.read_history(tmp_path), history.read_convergence(tmp_path)
    problem = synthetic.problem()
    for figure in (
        plot.force_stroke(table, problem), plot.energy(table, problem), plot.convergence(table, iterations, problem, 1e-9),
    ):  # fmt: skip
        assert (picture_of(figure, tmp_path)[..., :3] < 250).any()


def test_pictures_leave_the_settings_of_matplotlib_alone():
    """Drawing changes no global setting and opens no pyplot figure."""
    import matplotlib
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    plot.deformed(synthetic.increment(n=(4, 2)), synthetic.problem())
    assert dict(matplotlib.rcParams) == before and not plt.get_fignums()


def at(x=0.0, y=0.0, direction=(0.0, -1.0), place=(0.0, 0.0, 0.0)) -> ToolState:
    return ToolState(np.array([x, y]), Place(*place), Force(0, 0, 0), direction)


def test_outlines_lie_behind_the_face():
    """A flat tool is drawn behind its face, whichever way it looks, however it has moved and turned."""
    for direction in ((0.0, -1.0), (0.0, 1.0), (1.0, 0.0), (0.6, 0.8)):
        (polygon,) = outlines(pr.Stamp(width=4, fillet=1, touching="b.t"), at(1, 2, direction, (0.5, 0, 0)), depth=3)
        height = (polygon - (1.5, 2)) @ np.array(direction)
        assert height.max() == pytest.approx(0) and height.min() == pytest.approx(-3)
    (turned,) = outlines(pr.Plane(normal=(0, 1), at=(0, 0)), at(direction=(0, 1), place=(0, 0, np.pi / 2)), depth=1)
    assert turned[:, 0].max() == pytest.approx(1) and turned[:, 0].min() == pytest.approx(0)


def test_rings_are_drawn_on_both_sides_of_the_axis():
    """A ring has two sections in axisymmetry, a centred circle one."""
    ring = outlines(pr.Ring(inner=2, outer=3, touching="b.t"), at(), 1.0, axisymmetric=True)
    assert sorted(round(float(p[:, 0].mean())) for p in ring) == [-2, 2]
    assert len(outlines(pr.Circle(radius=1, touching="b.t"), at(), 1.0, axisymmetric=True)) == 1


@pytest.mark.parametrize(("scale", "text"), [(2e6, "×10⁶"), (3e-7, "×10⁻⁷"), (4.0, "")])
def test_a_common_power_of_ten_stands_at_the_end_of_an_axis(tmp_path, scale, text):
    """Large and small numbers have their power of ten in plain text; others have none."""
    figure, axes = plot._figure(3, 2)
    axes.plot([0.0, 1.0], [0.0, scale])
    plot.save(figure, tmp_path / "a.png")
    assert axes.yaxis.get_major_formatter().get_offset() == text


def test_ticks_of_logarithmic_axes_are_powers_of_ten(tmp_path):
    """Every labelled tick of a residual's axis says its own power."""
    figure, axes = plot._figure(3, 2)
    axes.semilogy([0.0, 1.0], [1e-13, 1e2])
    plot.save(figure, tmp_path / "a.png")
    format = axes.yaxis.get_major_formatter()
    assert [format(x) for x in (1e-13, 1e-5, 1.0, 100.0)] == ["10⁻¹³", "10⁻⁵", "10⁰", "10²"]


def test_tools_end_at_the_axis():
    """A profile that begins on the axis goes on beyond it, where its mirror image stands: it does not cover the other wall."""
    corners, sides = [(0, 0), (10, 0), (10, 12), (6, 12), (6, 4), (0, 4)], ["bottom", "right", "rim", "in", "top", "left"]
    can = pr.Outline(points=corners, sides=sides, size=2.0)
    punch = pr.Profile(points=[(0, 4), (5, 4), (5, 20)], at=(0, 0))
    problem = pr.Problem(
        "can", space="axisymmetric", bodies={"can": pr.Body(can, pr.Elastic(1e3, 0.3))}, tools={"punch": punch},
        contacts=[pr.Contact("can.top", "punch")], fixed={"can.bottom": "y"},
        steps=[pr.Step("press", move={"punch": {"y": -0.01}}, increments=1)], kinematics="small",
    )  # fmt: skip
    (increment,) = pr.solve(problem)
    figure = plot.deformed(increment, problem, "displacement", mesh=False)
    figure.canvas.draw()
    pixels, axes = np.asarray(figure.canvas.buffer_rgba()), figure.axes[0]

    def grey(x: float, y: float) -> bool:
        column, row = axes.transData.transform((x, y))
        r, g, b, _ = pixels[len(pixels) - int(row), int(column)].tolist()
        return max(r, g, b) - min(r, g, b) < 25

    assert grey(2.0, 8.0) and grey(-2.0, 8.0)
    assert not (grey(8.0, 8.0) or grey(-8.0, 8.0))


def test_a_tool_of_one_straight_side_needs_no_more_room_than_the_body():
    """It has no end: where its points lie along the line does not matter."""
    problem = synthetic.problem()
    wall = dataclasses.replace(problem, tools={"cylinder": pr.Profile(points=[(80, 500), (80, 0)], at=(0, 0))}, contacts=())
    increment = synthetic.increment(n=(4, 2))
    state = dataclasses.replace(increment.tools["cylinder"], at=np.zeros(2), place=Place(0.0, 0.0, 0.0))
    low, high = plot.limits(dataclasses.replace(increment, tools={"cylinder": state}), wall)[2:]
    assert low > -60.0 and high < 20.0


def test_the_nearest_place_of_a_polygon_to_a_box():
    """Ends of sides, feet of corners and crossings: no point close together with others on the sides is nearer."""
    rng, share = np.random.default_rng(3), np.linspace(0.0, 1.0, 2001)[:, None, None]
    for _ in range(50):
        polygon, (low, high) = rng.uniform(-3.0, 3.0, (5, 2)), np.sort(rng.uniform(-1.0, 1.0, (2, 2)), axis=0)
        points = (polygon + share * (np.roll(polygon, -1, axis=0) - polygon)).reshape(-1, 2)
        best = np.hypot(*(points - np.clip(points, low, high)).T).min()
        x = nearest_to_box(polygon, low, high)
        found = np.hypot(*(x - np.clip(x, low, high)))
        assert best - 5e-3 <= found <= best + 1e-12
