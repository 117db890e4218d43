"""Profiles, polygons and cavities in use: forces and moments in balance, equal tools drawn in two ways, placing."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.tools.shapes.circle import Hollow
from prensa.verify.balance import Balance
from problems import pressed_block

ELASTIC = pr.Elastic(1000.0, 0.3)
MODES = [("small", "reference"), ("small", "current"), ("finite", "current")]
WAVE = ((-9.0, 3.0), (-5.0, 0.0), pr.Arc(through=(-3.0, -0.6), to=(-1.0, 0.0)), (1.0, 0.3), (3.0, -0.4), (9.0, 2.0))


def pressed(tool, steps, *, mode=("finite", "current"), friction=None, space="plane strain", n=(12, 4), **more):
    return pressed_block(
        *steps, tools={"tool": tool}, material=ELASTIC, size=(6.0, 2.0), n=n, body="block", friction=friction,
        space=space, kinematics=mode[0], contact_geometry=mode[1], allow_large_strain=mode[0] == "small", **more,
    )  # fmt: skip


def down(depth=0.15, **more):
    return pr.Step("press", move={"tool": {"y": -depth, **more}}, increments=2)


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("fillet", [0.5, None], ids=["fillet", "automatic"])
def test_a_block_dragged_under_a_profile_is_in_balance(mode, fillet):
    """Tool force and moment equal the sums over the nodes and answer the supports, to 1e-8, all along a drag with a turn."""
    tool = pr.Profile(points=WAVE, fillet=fillet, at=(3.0, 0.0), above="block.top")
    steps = [down(), pr.Step("drag", move={"tool": {"x": 1.3, "rz": 0.03}}, increments=6)]
    balance, slid = Balance(), 0
    for inc in balance.watch(pressed(tool, steps, mode=mode, friction=pr.Coulomb(0.2))):
        slid += int((inc.contacts["block.top-tool"].status == 2).sum())
        assert inc.force("tool").y > 0
    assert balance.force <= 1e-8
    assert balance.moment <= 1e-8
    assert slid > 0


@pytest.mark.parametrize("mode", MODES, ids="-".join)
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
def test_tools_drawn_as_chains_push_like_those_they_draw(space, mode):
    """A stamp and its profile, a cylinder and its closed profile: the same force to 1e-10 in a press with a drag."""
    axi = space == "axisymmetric"
    steps = [down(), pr.Step("on", move={"tool": {"y": -0.2} if axi else {"x": 0.3}}, increments=2)]
    centre = 0.0 if axi else 2.0
    face = ((-1.6, 1.0), (-1.6, 0.0), (1.6, 0.0), (1.6, 1.0))
    circle = ((0.0, -4.0), pr.Arc(through=(4.0, 0.0), to=(0.0, 4.0)), pr.Arc(through=(-4.0, 0.0), to=(0.0, -4.0)))
    for one, two in (
        (pr.Stamp(width=3.2, fillet=0.4, at=(centre, 2.0)), pr.Profile(points=face, fillet=0.4, at=(centre, 2.0))),
        (pr.Circle(radius=4.0, at=(centre, 6.0)), pr.Profile(points=circle, closed=True, at=(centre, 6.0))),
    ):
        forces = []
        for tool in (one, two):
            *_, inc = pr.solve(pressed(tool, steps, mode=mode, space=space, friction=pr.Coulomb(0.3)))
            forces.append(inc.force("tool"))
        assert forces[0].y > 0
        assert np.allclose(*forces, rtol=1e-10, atol=1e-10 * forces[0].y)


def test_a_closed_tool_turns_more_than_once():
    """A roll of lines and arcs that turns by 3 revolutions on the spot rubs at μ times its force: nothing jumps at the seam."""
    roll = ((0.0, -4.0), pr.Arc(through=(4.0, 0.0), to=(0.0, 4.0)), pr.Arc(through=(-4.0, 0.0), to=(0.0, -4.0)))
    tool = pr.Profile(points=roll, closed=True, at=(3.0, 6.0))
    steps = [down(0.05), pr.Step("turn", move={"tool": {"rz": 6 * np.pi}}, increments=12)]
    for inc in pr.solve(pressed(tool, steps, friction=pr.Coulomb(0.2))):
        if inc.step == "turn":
            f, c = inc.force("tool"), inc.contacts["block.top-tool"]
            assert f.m == pytest.approx(-0.2 * 4.0 * (c.pressure * c.weight).sum(), rel=1e-2)
    assert c.slip.max() == pytest.approx(6 * np.pi * 4.0, rel=1e-2)


def test_a_press_fit_in_a_cavity_is_the_plane_strain_solution():
    """A disc held all around by a cavity that is e smaller has the uniform pressure E e/((1 + ν)(1 − 2ν) R), to 1e-3."""
    R, e, n = 5.0, 0.01, 12
    # a quarter of a disc without its middle: free inside, so the closed form of the tube with a rigid jacket
    a, k = 2.0, 6
    angle, radius = np.linspace(0, np.pi / 2, n + 1), np.linspace(a, R, k + 1)
    points = [(r * np.cos(t), r * np.sin(t)) for t in angle for r in radius]
    cells = [(i * (k + 1) + j, i * (k + 1) + j + 1, (i + 1) * (k + 1) + j + 1, (i + 1) * (k + 1) + j)
             for i in range(n) for j in range(k)]  # fmt: skip
    names = {
        "outside": tuple(i * (k + 1) + k for i in range(n + 1)),
        "bottom": tuple(range(k + 1)),
        "left": tuple(n * (k + 1) + j for j in range(k + 1)),
    }
    mesh = pr.Points(points=tuple(points), cells=tuple(cells), boundaries=names)
    p = pr.Problem(
        "fit", kinematics="small", bodies={"tube": pr.Body(mesh, ELASTIC)},
        tools={"die": pr.Circle(radius=R - e, concave=True, at=(0.0, 0.0))},
        contacts=[pr.Contact("tube.outside", "die", enforcement=pr.Augmented())],
        fixed={"tube.bottom": "y", "tube.left": "x"}, steps=[pr.Step("fit", increments=1)],
    )  # fmt: skip
    *_, inc = pr.solve(p)
    # Lamé: u(R) = −e with σ_r(a) = 0
    nu, E = 0.3, 1000.0
    pressure = E * e * (R**2 - a**2) / ((1 + nu) * R * ((1 - 2 * nu) * R**2 + a**2))
    assert np.allclose(inc.contacts["tube.outside-die"].pressure, pressure, rtol=2e-2)
    assert inc.contacts["tube.outside-die"].pressure.mean() == pytest.approx(pressure, rel=5e-3)


# ------------------------------------------------------------------------------------------------------------- placing
def placed(tool):
    return pr.discretise(pressed(tool, [down()])).tools[0]


def test_chains_are_placed_like_other_tools():
    """Above, below and touching bring the first node to a gap of zero and no node below."""
    for key in ("above", "touching"):
        tool = placed(pr.Profile(points=WAVE, fillet=0.3, at=(3.0, 0.0), **{key: "block.top"}))
        x = np.stack([np.linspace(0, 6, 13), np.full(13, 2.0)], axis=1)
        assert np.abs(tool.shape.closest(x - tool.at).g.min()) <= 1e-12
    die = ((9.0, 2.0), (5.0, 0.0), (-5.0, 0.0), (-9.0, 2.0))
    assert placed(pr.Profile(points=die, at=(3.0, 0.0), below="block.bottom")).at[1] == pytest.approx(0.0, abs=1e-12)
    triangle = pr.Polygon(points=((0.0, 0.0), (-2.0, 3.0), (2.0, 3.0)), at=(1.0, 0.0), above="block.top")
    # rounded with a quarter of an element, 0.125, the tip stands back
    back = 0.125 * (1 / np.sin(np.arctan(2 / 3)) - 1)
    assert placed(triangle).at == pytest.approx([1.0, 2.0 - back], abs=1e-9)
    groove = pr.Circle(radius=20.0, concave=True, at=(3.0, 0.0), touching="block.bottom")
    assert placed(groove).at[1] == pytest.approx(np.sqrt(400 - 9), abs=1e-9)
    hole = ((-4.0, -1.0), (-4.0, 5.0), (4.0, 5.0), (4.0, -1.0))
    assert placed(pr.Profile(points=hole, closed=True, at=(3.0, 0.0), fillet=0.5, touching="block.top")).at[1] == -3.0


@pytest.mark.parametrize(
    ("tool", "message"),
    [
        (pr.Polygon(points=((0.0, 0.0), (-2.0, 3.0), (2.0, 3.0)), at=(30.0, 0.0), above="block.top"), "never meets"),
        (pr.Profile(points=((5.0, 0.0), (-5.0, 0.0)), above="block.top"), "tool on the left"),
        (pr.Circle(radius=2.0, concave=True, at=(3.0, 0.0), touching="block.top"), "does not fit"),
    ],
)
def test_tools_that_cannot_be_placed_are_named(tool, message):
    """A chain walked the wrong way and a cavity too small say what to change."""
    with pytest.raises(PrensaError, match=message):
        placed(tool)


def test_a_sharp_corner_over_a_node_is_refused_and_rounded_when_nothing_is_said():
    """As for stamps: `fillet: 0` over a node is refused on the moved surface; without fillet the corner is rounded."""
    points = ((-1.0, 3.0), (0.0, 0.0), (1.0, 3.0))
    with pytest.raises(PrensaError, match=r"sharp edge lies over the node at \(3, 2\).*fillet"):
        placed(pr.Profile(points=points, fillet=0.0, at=(3.0, 2.0)))
    assert placed(pr.Profile(points=points, at=(3.0, 2.0))).shape.radius == pytest.approx(0.125)
    reference = pressed(pr.Profile(points=points, at=(3.0, 2.0)), [down()], mode=("small", "reference"))
    assert pr.discretise(reference).tools[0].shape.radius == 0.0


def test_a_sharp_corner_of_the_back_of_a_tool_is_over_no_node():
    """It looks away, and the tool lies between, though the line along which a node could slide past it passes through one."""
    block = ((0.0, 0.0), (6.0, 0.0), (6.0, 7.0), (0.0, 7.0))
    tool = pr.Polygon(points=block, fillet=(0.5, 0.5, 0.0, 0.0), at=(0.0, 2.0))
    bottom = pr.Problem(
        "b", space="plane strain", bodies={"b": pr.Body(pr.Rectangle((4.0, 2.0), (4, 2), origin=(-4.0, 0.0)), ELASTIC)},
        tools={"tool": tool}, contacts=[pr.Contact("b.bottom", "tool")], fixed={"b.left": "xy"}, steps=(down(),),
    )  # fmt: skip
    corner, normal = np.array([6.0, 9.0]), np.array([0.5, 0.5]) ** 0.5
    behind = pr.discretise(bottom).surfaces[0].X - corner
    assert (np.abs(behind @ [-normal[1], normal[0]]) < 1e-9).any() and (behind @ normal < 0.0).all()


def test_a_boundary_all_around_has_no_side_to_touch():
    """A whole ring has no mean normal: 'touching' it is refused with what says the side, and 'above' places the tool."""
    ring = pr.Body(pr.Annulus(3.0, 4.0, (32, 2)), ELASTIC)

    def on(**place):
        return pr.Problem(
            "ring", bodies={"ring": ring}, tools={"tool": pr.Plane(normal=(0.0, -1.0), **place)},
            contacts=[pr.Contact("ring.outer", "tool")], fixed={"ring.inner": "xy"}, steps=(down(),),
        )  # fmt: skip

    with pytest.raises(PrensaError, match=r"'above: ring\.outer'"):
        pr.discretise(on(touching="ring.outer"))
    assert pr.discretise(on(above="ring.outer")).tools[0].at[1] == pytest.approx(4.0)


def test_a_ray_within_a_cavity_as_large_as_numbers_go_meets_nothing_near():
    """Its square is not a number: that is an answer, not an error."""
    assert np.isinf(Hollow(1e308).along(np.array([[0.0, 1.0]]), np.array([0.0, 1.0]), 10.0)).all()
