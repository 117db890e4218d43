"""Identities in space: plane strain, a wedge against axisymmetry, turned and permuted models, runs and what they leave."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr

STEEL = pr.J2(200000.0, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2))
TIGHT = pr.Numerics(tolerance=1e-11)
SECTION = pr.Rectangle((8.0, 4.0), (8, 4))
ROLL = pr.Circle(6.0)


def plane_and_space(element, layer, kinematics="finite"):
    """A roll pressed on a block and moved along it, in plane strain and as one layer of bricks of a thickness."""
    steps = [{"move": {"roll": pr.Motion(y=-0.3)}}, {"by": {"roll": pr.Motion(x=0.4)}}]
    made = []
    for solid in (False, True):
        tool = {"touching": "block.top", "at": (4.0, 0.0, 0.0) if solid else (4.0, 0.0)}
        fixed = {"block.bottom": "xyz" if solid else "xy"} | ({"block.base": "z", "block.cap": "z"} if solid else {})
        made.append(pr.Problem(
            "roll", space="solid" if solid else "plane strain", fixed=fixed, friction=pr.Coulomb(0.2),
            bodies={"block": pr.Body(
                pr.Extrusion(SECTION, layer, 1) if solid else SECTION, STEEL, element[1] if solid else element[0])},
            tools={"roll": pr.Extruded(ROLL, **tool) if solid else pr.Circle(6.0, **tool)},
            contacts=(pr.Contact("block.top", "roll"),), kinematics=kinematics, allow_large_strain=kinematics == "small",
            steps=tuple(pr.Step(str(k), increments=10, **step) for k, step in enumerate(steps)),
        ))  # fmt: skip
    return made


@pytest.mark.parametrize(
    ("elements", "kinematics"),
    [(("q4", "h8"), "finite"), (("q4_enhanced", "h8_enhanced"), "small"), (("q4_enhanced", "h8_enhanced"), "finite")],
)
def test_one_layer_is_plane_strain(elements, kinematics):
    """Forces of a roll that presses and slides, per thickness, to 1e-8; plastic strains too."""
    plane, space = (list(pr.solve(p, TIGHT)) for p in plane_and_space(elements, 2.5, kinematics))
    assert len(plane) == len(space) == 20
    for flat, solid in zip(plane, space):
        a, b = flat.force("roll"), solid.force("roll")
        assert np.allclose([b.x / 2.5, b.y / 2.5], [a.x, a.y], rtol=1e-8, atol=1e-8 * abs(a.y))
        assert flat.energy["plastic"] == pytest.approx(solid.energy["plastic"] / 2.5, rel=1e-8)
    assert abs(solid.force("roll").x) > 0.2 * solid.force("roll").y  # it slides, and ploughs




def turned_block(axes):
    """A block under a slanted plane that slides, all with x, y, z renamed by a permutation."""
    def to(v):
        out = [0.0] * 3
        for i, k in enumerate(axes):
            out[k] = v[i]
        return tuple(out)

    names = (("left", "right"), ("bottom", "top"), ("back", "front"))
    n, size = [0] * 3, [0.0] * 3
    for i, k in enumerate(axes):
        n[k], size[k] = (3, 2, 4)[i], (3.0, 2.0, 4.0)[i]
    side = lambda i, end: f"b.{names[axes[i]][end]}"  # noqa: E731
    axis = "xyz"
    return pr.Problem(
        "turned", space="solid", friction=pr.Coulomb(0.3),
        bodies={"b": pr.Body(pr.Box(tuple(size), tuple(n)), STEEL)},
        tools={"t": pr.Plane(normal=to((0.1, -1.0, 0.05)), at=to((3.0, 2.3, 0.0)))},
        contacts=(pr.Contact(side(1, 1), "t"),),
        fixed={side(1, 0): "xyz"},
        steps=(pr.Step("press", move={"t": pr.Motion(**dict(zip((axis[k] for k in axes), (0.05, -0.5, 0.02))))}, increments=3),),
    )  # fmt: skip


@pytest.mark.parametrize("axes", [(1, 2, 0), (2, 1, 0)], ids=["cyclic", "mirrored"])
def test_renamed_axes_rename_the_answer(axes):
    """Forces and energies of a permuted model are the permuted ones to 1e-9."""
    *_, plain = pr.solve(turned_block((0, 1, 2)), TIGHT)
    *_, other = pr.solve(turned_block(axes), TIGHT)
    f, g = plain.force("t"), other.force("t")
    size = abs(f.y)
    assert size > 100.0
    assert np.allclose([g[k] for k in axes], f[:3], rtol=1e-9, atol=1e-9 * size)
    assert other.energy["plastic"] == pytest.approx(plain.energy["plastic"], rel=1e-9)
    assert other.energy["friction"] == pytest.approx(plain.energy["friction"], rel=1e-9)


def test_a_quarter_of_a_ring_is_axisymmetric():
    """The error of a quarter's force falls with the square of the angle of its layers; the whole ring has four of it."""
    section = pr.Rectangle((3.0, 2.0), (3, 3), origin=(3.0, 0.0))
    given = {
        "steps": (pr.Step("press", move={"t": pr.Motion(y=-0.05)}, increments=1),), "kinematics": "small",
        "contacts": (pr.Contact("b.top", "t"),), "tools": {"t": pr.Plane(touching="b.top")},
    }  # fmt: skip
    elastic = pr.Elastic(1000.0, 0.3)
    *_, flat = pr.solve(pr.Problem(
        "ring", space="axisymmetric", bodies={"b": pr.Body(section, elastic, "q4")}, fixed={"b.bottom": "xy"}, **given,
    ))  # fmt: skip
    exact, errors = flat.force("t").y, []
    for n in (4, 8):
        quarter = pr.Revolution(section, n, angle=np.pi / 2)
        *_, solid = pr.solve(pr.Problem(
            "ring", space="solid", bodies={"b": pr.Body(quarter, elastic, "h8")},
            fixed={"b.bottom": "xyz", "b.base": "z", "b.cap": "x"}, **given,
        ))  # fmt: skip
        errors.append(4.0 * solid.force("t").y / exact - 1.0)
    assert abs(errors[1]) < 0.01
    assert 3.6 < errors[0] / errors[1] < 4.4
