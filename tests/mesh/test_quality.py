"""Quality of elements: known shapes have known numbers, and the worst one is found."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.cli import app
from prensa.mesh.generate import mesh_of
from prensa.mesh.quality import quality
from problems import pressed_block


def test_known_shapes_have_known_numbers():
    """Rectangle 1 and 3; rhombus of 30° sin 30°; equilateral triangle 1; right isosceles triangle √2/√3."""
    rectangle = quality(mesh_of(pr.Rectangle(size=(6, 1), n=(2, 1)), "q4"))
    assert np.allclose(rectangle.jacobian, 1) and np.allclose(rectangle.aspect, 3)
    c, s = math.cos(math.pi / 6), 0.5
    rhombus = quality(mesh_of(pr.Points(((0, 0), (1, 0), (1 + c, s), (c, s)), ((0, 1, 2, 3),), {}), "q8"))
    assert np.allclose(rhombus.jacobian, 0.5) and np.allclose(rhombus.aspect, 1)
    triangle = quality(mesh_of(pr.Points(((0, 0), (1, 0), (0.5, math.sqrt(0.75))), ((0, 1, 2),), {}), "t6"))
    assert np.allclose(triangle.jacobian, 1)
    half = quality(mesh_of(pr.Rectangle(size=(1, 1), n=(1, 1)), "t3"))
    assert np.allclose(half.jacobian, math.sqrt(0.5) / math.sqrt(0.75)) and np.allclose(half.aspect, math.sqrt(2))


def test_a_bent_side_counts():
    """A mid-side node pushed in by a quarter of the side makes corners of 45°: the tangents there rise at slope 1."""
    points = ((0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.25), (1, 0.5), (0.5, 1), (0, 0.5))
    assert quality(mesh_of(pr.Points(points, (tuple(range(8)),), {}), "q8")).jacobian[0] == pytest.approx(
        math.sqrt(0.5)
    )


def test_check_prints_the_quality_and_warns_of_the_worst_element(tmp_path, capsys):
    """`prensa check` names the least scaled Jacobian, the longest element and their places."""
    patch = pr.Patch(corners=((0, 0), (4, 0), (7.96, 0.56), (3.96, 0.56)), n=(2, 2))
    problem = pr.Problem(
        "p", {"b": pr.Body(patch, pr.Elastic(E=1e3, nu=0.3))}, (pr.Step("s"),), fixed={"b.bottom": pr.Fixed("held", "held")}
    )  # fmt: skip
    path = tmp_path / "case.yaml"

    def line(p) -> str:
        path.write_text(pr.dump(p))
        with pytest.raises(SystemExit):
            app(["check", str(path)])
        out = capsys.readouterr()
        return out.out + out.err

    text = line(problem)
    assert (
        "4 elements q4_enhanced (it is elastic and may bend), 9 nodes" in text
        and "Q4: scaled Jacobian 0.14" in text
        and "stresses are poor there" in text
    )
    thin = replace(problem, bodies={"b": pr.Body(pr.Rectangle((100, 1), (1, 1)), pr.Elastic(E=1e3, nu=0.3))})
    text = line(thin)
    assert "aspect ratio 100 … 100" in text and "100 times longer than wide" in text


@pytest.mark.parametrize(
    ("tool", "way", "said"),
    [
        (pr.Circle(radius=50, at=(0, 150)), {"y": -0.1}, False),
        (pr.Circle(radius=50, at=(0, 150)), {"x": 60.0}, True),
        (pr.Plane(touching="b.top"), {"y": -0.1}, True),
    ],
    ids=["far", "comes near", "touches"],
)  # fmt: skip
def test_needles_far_from_all_tools_are_no_harm(tool, way, said):
    """A block graded to the middle of its top: stresses vary over lengths that hold its needles, unless a tool comes there."""
    problem = pressed_block(
        pr.Step("s", move={"t": way}), tools={"t": tool}, material=pr.Elastic(E=1e5, nu=0.3),
        mesh=pr.Rectangle((100, 100), (160, 60), grade=pr.Grade(x=(0.0,), y=(100.0,), ratio=400)),
    )  # fmt: skip
    assert any("longer than wide" in str(notice) for notice in preflight(pr.discretise(problem))) is said
