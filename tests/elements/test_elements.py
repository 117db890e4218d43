"""Properties that every element inherits: no stress from rotation, purity, recovery, output; and claims of the enhanced one."""

from __future__ import annotations

from dataclasses import replace

import meshio
import numpy as np
import pytest

import prensa as pr
from compressed import stiffnesses
from prensa.contact.recovery import recover
from prensa.output.vtk import write_fields
from prensa.system.state import State
from prensa.verify.drive import Drive
from prensa.verify.elements import SPACES, elements_in, quadrilaterals
from problems import pressed_block, stroke

STEEL = pr.Elastic(200e3, 0.3)
COMBINATIONS = [(e, s) for s in SPACES for e in elements_in(s)]


@pytest.mark.parametrize(("element", "space"), [c for c in COMBINATIONS if c[1] != "axisymmetric"])
def test_a_rigid_rotation_gives_no_stress(element, space):
    """A distorted body turned by 70° is free of stress, and of forces, to 1e-10 of the modulus."""
    drive = Drive(pr.Body(quadrilaterals((3, 2), (3.0, 2.0), bent=0.2), STEEL, element), space, "finite")
    c, s = np.cos(1.2), np.sin(1.2)
    u = (drive.X @ np.array([[c, s], [-s, c]]) - drive.X).ravel()
    drive.to(1.0, np.arange(drive.system.ndof), u)
    assert np.abs(drive.cauchy()).max() <= 1e-10 * STEEL.E
    assert np.abs(drive.reaction).max() <= 1e-10 * STEEL.E


@pytest.mark.parametrize(("element", "space"), COMBINATIONS)
def test_a_response_is_pure(element, space):
    """The same arguments give the same residual, stiffness and history, bit for bit, whatever was evaluated before."""
    material = pr.J2(200e3, 0.3, pr.Swift(565.0, 0.007, 0.26))
    drive = Drive(pr.Body(quadrilaterals((2, 2), (2.0, 2.0), bent=0.2, x0=1.0), material, element), space, "finite")
    rng = np.random.default_rng(0)
    drive.to(0.5, np.arange(drive.system.ndof), 0.01 * rng.normal(size=drive.system.ndof))
    c = drive.system.context(drive.state, drive.plan, 1.0)
    u, v = (drive.state.u + 0.01 * rng.normal(size=drive.system.ndof) for _ in range(2))
    first = drive.system.evaluate(c, u, drive.state.lam)
    assert not first.failed
    drive.system.evaluate(c, v, drive.state.lam)
    # a state that went through a file is the same state
    c = drive.system.context(State.from_arrays(drive.state.arrays()), drive.plan, 1.0)
    again = drive.system.evaluate(c, u, drive.state.lam)
    assert np.array_equal(first.r, again.r)
    assert np.array_equal(first.data, again.data)
    assert np.array_equal(first.history[0], again.history[0])
    assert np.array_equal(drive.system.evaluate(c, u, drive.state.lam, stiffness=False).r, first.r)


@pytest.mark.parametrize("element", ["t3", "q4", "t6", "q8", "q8_full"])
def test_recovery_returns_polynomials_of_the_elements_order(element):
    """Point values of a field that is linear (T3), bilinear (Q4) or quadratic are recovered at every node to 1e-9."""
    drive = Drive(pr.Body(quadrilaterals((5, 4), (5.0, 2.0), bent=0.2), STEEL, element), "plane strain", "small")
    (block,) = drive.system.blocks

    def field(x):
        s, t = x[..., 0], x[..., 1]
        linear = 1.0 + 2.0 * s - 3.0 * t
        if element == "t3":
            return linear
        return linear + s * t if element == "q4" else linear + s * t - 0.5 * s**2 + 0.7 * t**2

    nodal = recover(drive.X, block.cells, block.positions(drive.X), field(block.positions(drive.X))[..., None])
    assert np.abs(nodal[:, 0] - field(drive.X)).max() <= 1e-9 * 30


@pytest.mark.parametrize(
    ("element", "cell"), [("t3", "triangle"), ("t6", "triangle6"), ("q8", "quad8"), ("q4_enhanced", "quad"), ("q4_sheet", "quad")]
)
def test_fields_and_pictures_of_every_cell(element, cell, tmp_path):
    """The file of fields has the cell type of VTK and all nodes; the picture of the same increment is drawn."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from prensa.output.plot import deformed

    p = pressed_block(
        stroke(-0.01, increments=1, name="s"), material=STEEL, size=(2, 1), n=(3, 2), element=element,
        friction=pr.Coulomb(0.2), space="plane stress",
    )  # fmt: skip
    *_, inc = pr.solve(p)
    path = write_fields(tmp_path / "0001.vtu", inc)
    mesh = meshio.read(path)
    assert [c.type for c in mesh.cells] == [cell]
    assert len(mesh.points) == len(inc.bodies["b"].X)
    assert mesh.point_data["thickness"].min() > 1.0  # a pressed sheet grows thicker
    assert deformed(inc, p).axes


def test_elastic_answers_of_the_enhanced_element_do_not_depend_on_the_increments():
    """Bent and compressed neo-Hooke: one increment and seven end with the same inner nodes and forces, to 1e-9."""
    ends = []
    for steps in (1, 7):
        mesh = quadrilaterals((4, 3), (4.0, 3.0), bent=0.2)
        drive = Drive(pr.Body(mesh, pr.NeoHooke(1000.0, 0.3), "q4_enhanced"), "plane strain", "finite")
        x, y = drive.X.T
        target = np.stack([0.05 * x * y, -0.2 * y - 0.025 * x**2], axis=1).ravel()
        outline = drive.outline()
        for k in range(1, steps + 1):
            drive.to(k / steps, outline, k / steps * target[outline])
        ends.append((drive.state.u, drive.reaction))
    assert np.abs(ends[0][0] - ends[1][0]).max() <= 1e-9
    assert np.abs(ends[0][1] - ends[1][1]).max() <= 1e-9 * np.abs(ends[0][1]).max()


@pytest.mark.parametrize("material", [pr.Elastic(1000.0, 0.3), pr.NeoHooke(1000.0, 0.495)])
def test_the_enhanced_element_has_no_hourglass_in_large_compression(material):
    """A 2 × 2 block pressed homogeneously to 60 % keeps a positive definite tangent and a uniform stress."""
    drive = Drive(pr.Body(pr.Rectangle(size=(1, 1), n=(2, 2)), material, "q4_enhanced"), "plane strain", "finite")
    for K in stiffnesses(drive, 12):
        assert np.linalg.eigvalsh(0.5 * (K + K.T))[0] > 0.01 * material.E
    stress = drive.cauchy()
    assert np.abs(stress - stress.mean(axis=0)).max() <= 1e-8 * np.abs(stress).max()


def test_rules_of_straight_edges_are_refused_on_quadratic_ones():
    """Gauss points of contact on T6 or Q8 are refused with the remedy."""
    p = pressed_block(pr.Step("s"), material=STEEL, size=(2, 1), n=(3, 2), element="t6", fixed={})
    with pytest.raises(ValueError, match="'gauss2' is a rule of straight edges and t6 has quadratic ones; use 'nodal'"):
        replace(p, contacts=(replace(p.contacts[0], integration="gauss2"),))


@pytest.mark.parametrize("axisymmetric", [False, True])
def test_points_of_f_bar_resist_being_turned_through(axisymmetric):
    """Forces and stiffness are derivatives of V E/2 ln²(ρ/3), which nothing bounds; an element of 180° at a corner has none."""
    from prensa.elements import q4

    rng = np.random.default_rng(0)
    X = np.array([[[2.0, 0], [3, 0], [3, 1], [2, 1]]]) + 0.02 * rng.standard_normal((1, 4, 2))

    def pushed(s):
        d = np.zeros_like(X)
        d[0, 2] = -s
        return d

    def areas(x):
        g = 1 / 3**0.5
        corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        at = np.vstack([g * corner, [0, 0]])
        N = 0.25 * (1 + at[:, None, 0] * corner[:, 0]) * (1 + at[:, None, 1] * corner[:, 1])
        dx = 0.25 * corner[:, 0] * (1 + at[:, None, 1] * corner[:, 1])
        dy = 0.25 * corner[:, 1] * (1 + at[:, None, 0] * corner[:, 0])
        return np.linalg.det(np.stack([dx @ x, dy @ x], axis=1)), N @ x[:, 0]

    def energy(d):
        (j, _), (J, r) = areas((X + d)[0]), areas(X[0])
        excess = np.log(j[4] / j[:4] * J[:4] / J[4] / 3.0)
        return float((0.5 * 7.0 * J[:4] * (r[:4] if axisymmetric else 1.0) * np.maximum(excess, 0.0) ** 2).sum())

    def response(d):
        size, r, K = np.zeros(1), np.zeros((1, 8)), np.zeros((1, 8, 8))
        q4.unfold(X, X, d, axisymmetric, 7.0, size, True, r, K)
        return r[0], K[0]

    def slope(f, d):
        steps = 1e-6 * np.eye(8).reshape(8, 1, 4, 2)
        return np.array([(f(d + h) - f(d - h)) / 2e-6 for h in steps])

    d = pushed(0.575)
    r, K = response(d)
    assert energy(d) > 0
    assert np.abs(slope(energy, d) - r).max() <= 1e-7 * np.abs(r).max()
    assert np.abs(slope(lambda v: response(v)[0], d) - K).max() <= 1e-7 * np.abs(K).max()
    assert np.array_equal(K, K.T)
    assert not response(pushed(0.5))[0].any()
    through = next(s for s in np.linspace(0.575, 0.7, 100000) if areas((X + pushed(s))[0])[0].min() <= 0)
    assert energy(pushed(through - 2e-6)) > 20 * energy(d)
