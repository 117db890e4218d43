"""Properties that every tool inherits: distance, normal, curvature, surface coordinate, rays, period and edges that fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.errors import PrensaError
from prensa.mesh.generate import mesh_of
from prensa.registry import DOORS, examples
from prensa.testing import LawError, check_tool
from prensa.tools.place import place
from prensa.tools.shapes.ellipse import Oval
from problems import pressed_block, stroke


class Round(pr.ToolShape):
    """As a user writes it: the distance alone; it takes complex numbers."""

    radius: float

    def distance(self, x):
        return np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2) - self.radius


class Real(pr.ToolShape):
    """A box of rounded corners; hypot takes real numbers only: differences stand in."""

    half: float
    fillet: float

    def distance(self, x):
        q = np.abs(x) - (self.half - self.fillet)
        return (
            np.hypot(np.maximum(q[:, 0], 0.0), np.maximum(q[:, 1], 0.0))
            + np.minimum(np.maximum(q[:, 0], q[:, 1]), 0.0)
            - self.fillet
        )


class Sharp(pr.ToolShape):
    """A box with edges."""

    half: float

    def distance(self, x):
        q = np.abs(x) - self.half
        return np.hypot(np.maximum(q[:, 0], 0), np.maximum(q[:, 1], 0)) + np.minimum(np.maximum(q[:, 0], q[:, 1]), 0)


class Endless(pr.ToolShape):
    """A strip that ends in a half circle, endless upwards: it says how far it is to be looked at."""

    radius: float
    reach = 5.0

    def distance(self, x):
        return np.sqrt(x[:, 0] ** 2 + np.where(x[:, 1] < 0, x[:, 1], 0.0) ** 2) - self.radius


class Bore(pr.ToolShape):
    """A cavity."""

    radius: float

    def distance(self, x):
        return self.radius - np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)


class Stated(pr.ToolShape):
    """Everything about the closest point stated."""

    reach = 3.0

    def closest(self, x):
        k = len(x)
        return x[:, 1] * -1.0, np.tile([0.0, -1.0], (k, 1)), np.zeros(k), x[:, 0] * 1.0


ARC = pr.Arc(through=(0.5, 0.0), to=(2.0, 0.6))
TOOLS = {
    "plane": pr.Plane(at=(0, 0)),
    "circle": pr.Circle(80.0),
    "cavity": pr.Circle(2.0, concave=True),
    "stamp": pr.Stamp(2.0, 0.3),
    "sharp stamp": pr.Stamp(2.0),
    "ring": pr.Ring(1.0, 2.5, 0.2),
    "profile": pr.Profile(points=((-1.0, 1.0), ARC, (3.0, 0.0), (4.5, 1.5)), fillet=0.3),
    "sharp profile": pr.Profile(points=((-1.0, 1.0), ARC, (3.0, 0.0), (4.5, 1.5)), fillet=0.0),
    "hole": pr.Profile(points=((-3, 1), (7, 1.05), (7, -9), (-3, -9)), fillet=3.0, closed=True),
    "polygon": pr.Polygon(points=((0.0, 0.0), (0.0, 2.0), (2.0, 1.0)), fillet=0.2),
    "sharp polygon": pr.Polygon(points=((0.0, 0.0), (0.0, 2.0), (2.0, 1.0)), fillet=0.0),
    "a user's": Round(2.0),
    "a user's of real numbers only": Real(2.0, 0.5),
    "a user's with edges": Sharp(2.0),
    "a user's without end": Endless(1.0),
    "a user's cavity": Bore(2.0),
    "a user's closest point": Stated(),
} | examples("tool")


@pytest.mark.parametrize("tool", TOOLS.values(), ids=TOOLS)
def test_every_tool_is_one(tool):
    """Distance, normal, curvature, coordinate, rays, period and edges of every tool belong together."""
    check_tool(tool)


def test_every_tool_behind_the_door_is_in_the_list():
    """A tool that is added is tested: each type of the registry has an example here."""
    assert {tool.type for tool in TOOLS.values()} >= {name for name, tool in DOORS["tool"].own().items() if 2 in tool.dimensions}


class Wrong(pr.ToolShape):
    """A circle of radius 2 that goes wrong in a given way."""

    way: str
    calls = [0]  # noqa: RUF012 (the memory that a tool must not have)
    reach = 3.0

    @property
    def period(self):
        return 4 * np.pi * (1.5 if self.way == "period" else 1.0)

    @property
    def edges(self):
        return [[0.0, -2.0, 1.0, 0.0]] if self.way == "edges" else []

    def closest(self, x):
        self.calls[0] += 1
        r = np.hypot(x[:, 0], x[:, 1]) + 1e-300
        n = x / r[:, None]
        g, c, s = r - 2.0, 1.0 / r, 2.0 * np.arctan2(n[:, 0], -n[:, 1])
        match self.way:
            case "distance":
                g = (r * r - 4.0) / 4.0
            case "normal":
                n = np.column_stack([n[:, 0], -n[:, 1]])
            case "long":
                n = 1.1 * n
            case "curvature":
                c = 0 * c + 0.5
            case "coordinate":
                s = -s
            case "scale":
                s = 0.5 * s
            case "memory":
                g = g + 1e-9 * self.calls[0]
            case "others":
                g = g + 1e-6 * (g.mean() + 1.0)
            case "shape":
                c = c[:, None]
            case "nan":
                g = np.where(x[:, 0] > 0, g, np.nan)
        return g, n, c, s

    def outline(self, depth):
        angle = np.linspace(0, 2 * np.pi, 400)[:-1]
        return [(4.0 if self.way == "outline" else 2.0) * np.column_stack([np.cos(angle), np.sin(angle)])]


@pytest.mark.parametrize(
    ("way", "said"),
    [
        ("distance", "is not a distance"), ("normal", "n differs from ∇g"), ("long", "length 1"),
        ("curvature", "∂n/∂x differs"), ("coordinate", "∂s/∂x differs"), ("scale", "∂s/∂x differs"),
        ("memory", "remember"), ("others", "other points"), ("shape", "has the shape"), ("nan", "not a finite"),
        ("period", "lead back"), ("edges", "not a sharp one"), ("outline", "the outline"),
    ],
)  # fmt: skip
def test_the_suite_says_what_is_wrong_with_a_tool(way, said):
    """Each kind of wrong tool is found, in words."""
    with pytest.raises(LawError, match=said):
        check_tool(Wrong(way))


def test_the_suite_finds_rays_that_go_wrong_and_edges_that_are_not_reported():
    """A ray that stops short, and a sharp edge that is kept secret, are found."""

    class Ray(Oval):
        factor = 1.0

        def along(self, xi, direction, limit):
            return super().along(xi, direction, limit) * self.factor

    class Own(pr.ToolShape):
        factor: float

        def shape(self, direction, rounding=0.0):
            shape = Ray(2.0, 1.0)
            object.__setattr__(shape, "factor", self.factor)
            return shape

        def outline(self, depth):
            return pr.Ellipse((2.0, 1.0)).outline(depth)

    check_tool(Own(1.0))
    with pytest.raises(LawError, match="'along' ends"):
        check_tool(Own(0.9))
    with pytest.raises(LawError, match="not in 'edges'"):
        check_tool(Hidden(2.0))


class Hidden(pr.ToolShape):
    half: float

    @property
    def edges(self):
        return []

    def distance(self, x):
        return Sharp(self.half).distance(x)


# -------------------------------------------------------------------------------------------------------------- ellipse
@pytest.mark.parametrize("semi", [(3.0, 1.0), (1.0, 3.0), (2.0, 2.0), (50.0, 1.0)])
def test_the_foot_on_an_ellipse_is_the_nearest_of_a_million_points(semi):
    """Distance to 1e-9 outside and inside, on both axes, and in the centre; the foot is on the ellipse to round-off."""
    a, b = semi
    rng = np.random.default_rng(2)
    x = rng.uniform(-1.3, 1.3, (40, 2)) * semi
    x = np.vstack(
        [x, [[0, 0], [0.3 * a, 0], [0, 0.3 * b], [1.5 * a, 0], [0, 1.5 * b], [0.3 * a, 1e-12], [-a, 0], [0, -b]]]
    )
    phi = np.linspace(0, 2 * np.pi, 1_000_001)
    on = np.column_stack([a * np.sin(phi), -b * np.cos(phi)])
    close = Oval(a, b).closest(x)
    for k, point in enumerate(x):
        near = phi[int(np.argmin(((on - point) ** 2).sum(axis=1)))] + np.linspace(-1e-5, 1e-5, 20001)
        nearest = np.hypot(a * np.sin(near) - point[0], -b * np.cos(near) - point[1]).min()
        assert abs(abs(close.g[k]) - nearest) <= 1e-9 * max(semi)
        assert (close.g[k] < 0) == ((point[0] / a) ** 2 + (point[1] / b) ** 2 < 1) or abs(close.g[k]) < 1e-14 * a
    foot = x - close.g[:, None] * close.n
    assert np.abs((foot[:, 0] / a) ** 2 + (foot[:, 1] / b) ** 2 - 1).max() < 1e-12 * (a / b if a > b else b / a)


def test_lengths_along_an_ellipse_are_integrals():
    """S is the arc length from the lowest point by quadrature; a circle drawn as an ellipse is a circle."""
    shape = Oval(3.0, 1.0)
    phi = np.array([0.1, 1.0, 2.0, 3.0, -1.5])
    x = np.column_stack([3 * np.sin(phi), -np.cos(phi)])
    wanted = [quad(lambda t: np.hypot(3 * np.cos(t), np.sin(t)), 0, p, epsabs=1e-12)[0] for p in phi]
    assert np.allclose(shape.closest(x).s, wanted, atol=1e-10)
    assert np.isclose(shape.period, quad(lambda t: np.hypot(3 * np.cos(t), np.sin(t)), 0, 2 * np.pi, epsabs=1e-12)[0])
    y = np.random.default_rng(0).normal(size=(200, 2)) * 3
    down = np.array([0.0, -1.0])
    one, two = pr.Ellipse((2.0, 2.0)).shape(down, 0.0).closest(y), pr.Circle(2.0).shape(down, 0.0).closest(y)
    for u, v in zip(one, two):
        assert np.allclose(u, v, rtol=1e-12, atol=1e-12)


# --------------------------------------------------------------------------------------------------------- users' tools
def test_what_is_derived_from_a_distance_is_what_is_known():
    """A circle by its distance alone has the normal, curvature, coordinate, period and rays of the circle that comes along."""
    down = np.array([0.0, -1.0])
    one, two = Round(2.0).shape(down, 0.0), pr.Circle(2.0).shape(down, 0.0)
    x = np.random.default_rng(0).normal(size=(300, 2)) * 2
    a, b = one.closest(x), two.closest(x)
    assert np.abs(a.n - b.n).max() < 1e-12
    away = np.hypot(*x.T) > 0.2
    assert np.abs(a.c - b.c)[away].max() < 1e-6
    ds = a.s - b.s - (a.s - b.s)[0]
    assert np.abs(ds - two.period * np.round(ds / two.period)).max() < 1e-8
    assert abs(one.period - two.period) < 1e-9
    ray = np.array([0.6, 0.8])
    outside = a.g > 0
    assert np.allclose(one.along(x[outside], ray, 50.0), two.along(x[outside], ray, 50.0), atol=1e-10)
    assert len(Sharp(2.0).shape(down, 0.0).edges) == 4
    assert abs(Sharp(2.0).shape(down, 0.0).period - 16.0) < 1e-4


def case(tool):
    return pressed_block(
        stroke(-0.1, increments=2, tool="punch"), pr.Step("drag", move={"punch": pr.Motion(x=0.2)}, increments=2),
        tools={"punch": tool}, size=(8, 4), n=(16, 8), body="block", friction=pr.Coulomb(0.3), kinematics="small",
    )  # fmt: skip


def test_a_tool_by_its_distance_pushes_like_the_one_that_comes_along():
    """Forces and slip under a circle of one's own, pressed and dragged, are those of the circle; placed in the same place."""
    ends = [
        list(pr.solve(case(t)))[-1]
        for t in (Round(6.0, at=(4, 0), touching="block.top"), pr.Circle(6.0, at=(4, 0), touching="block.top"))
    ]
    a, b = (e.force("punch") for e in ends)
    assert np.allclose(a[:2], b[:2], rtol=1e-7)
    assert np.allclose(ends[0].tools["punch"].at, ends[1].tools["punch"].at, atol=1e-9)


def test_tools_by_their_distance_are_placed_like_those_that_come_along():
    """A cavity and a box of one's own, moved to a boundary, stand where the cavity and the polygon do; pictures agree."""
    mesh = {"block": mesh_of(pr.Rectangle((2, 2), (8, 8)))}
    box = pr.Polygon(points=((-2, -2), (2, -2), (2, 2), (-2, 2)), fillet=0.0, at=(1, 0), below="block.bottom")
    pairs = [
        (Bore(3.0, at=(1, 0), touching="block.top"), pr.Circle(3.0, True, at=(1, 0), touching="block.top")),
        (Sharp(2.0, at=(1, 0), below="block.bottom"), box),
    ]
    for ours, theirs in pairs:
        a, b = place("a", ours, mesh), place("b", theirs, mesh)
        assert np.allclose(a.at, b.at, atol=1e-8)
        (one,), (two,) = ours.outline(1.0), theirs.outline(1.0)
        assert np.allclose(one.min(axis=0), two.min(axis=0), atol=1e-3)
        assert np.allclose(one.max(axis=0), two.max(axis=0), atol=1e-3)


MODULE = """
import numpy as np
import prensa as pr


class Roll(pr.ToolShape):
    radius: float

    def distance(self, x):
        return np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2) - self.radius
"""
CASE = """
name: users
space: plane strain
bodies: {block: {mesh: {type: rectangle, size: [8, 4], n: [16, 8]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {punch: {type: "rolls:Roll", radius: 6, at: [4, 0], touching: block.top}}
contacts: [{surface: block.top, against: punch}]
fixed: {block.bottom: xy}
steps: [{name: press, move: {punch: {y: -0.1}}, increments: 1}]
"""


def test_a_case_file_names_a_tool_of_ones_own(tmp_path):
    """``type: rolls:Roll`` is found beside the case; dump and load give it back; ``prensa check`` places it."""
    (tmp_path / "rolls.py").write_text(MODULE)
    (tmp_path / "case.yaml").write_text(CASE)
    problem = pr.load(tmp_path / "case.yaml").problem
    (tmp_path / "again.yaml").write_text(pr.dump(problem))
    assert pr.load(tmp_path / "again.yaml").problem == problem
    said = CliRunner().invoke(app, ["check", str(tmp_path / "case.yaml")]).output
    assert "rolls.py:Roll, reference point at (4, 10)" in said
    (tmp_path / "case.yaml").write_text(CASE.replace("radius: 6", "radius: six"))
    with pytest.raises(pr.CaseError, match="radius"):
        pr.load(tmp_path / "case.yaml")


def test_a_tool_without_a_shape_says_what_to_define():
    """No distance, or no end and no reach: the message names what to give."""

    class Nothing(pr.ToolShape):
        pass

    with pytest.raises(NotImplementedError, match="define distance"):
        Nothing(at=(0, 0)).shape(np.array([0.0, -1.0]), 0.0)

    class Half(pr.ToolShape):
        def distance(self, x):
            return -x[:, 1]

    with pytest.raises(PrensaError, match="give 'reach'"):
        Half(at=(0, 0)).outline(1.0)
