"""Ties: two bodies behave as one across matching and non-matching meshes; impossible ties are refused."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

import prensa as pr
from prensa import NeoHooke
from prensa.linear.reduction import Reduced
from prensa.mesh.generate import mesh_of
from prensa.mesh.mesh import MeshError, sides
from prensa.system.ties import make_ties
from problems import tied_blocks, upset_billet

TIE = (pr.Tie(slave="upper.bottom", master="lower.top"),)
MESHES = {"matching": ((4, 2), (4, 3)), "nested": ((3, 2), (6, 3)), "free": ((5, 2), (3, 3)), "finer": ((4, 2), (7, 3))}


def stack(n1, n2, materials, *, space="plane strain", kinematics="small", fixed=(), **more) -> pr.Problem:
    """A rectangle 4 × 2 with another 4 × 3 tied on top of it, both held on the left and below."""
    held = {"lower.bottom": "y", "lower.left": "x", "upper.left": "x"} | {name: "x" for name in fixed}
    steps = more.pop("steps", (pr.Step("load", loads={"upper.top": pr.Load(pressure=10.0)}, increments=1),))
    return tied_blocks(
        *steps, sizes=((4, 2), (4, 3)), n=(n1, n2), materials=materials, fixed=held, space=space, kinematics=kinematics, **more
    )


def last(problem: pr.Problem):
    *_, inc = pr.solve(problem)
    return inc


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("space", ["plane strain", "axisymmetric"])
@pytest.mark.parametrize("swapped", [False, True])
def test_constant_stress_passes_between_any_two_meshes(kind, space, swapped):
    """Patch test: a pressed stack of one material has one stress everywhere, corners on a symmetry line included."""
    material = pr.Elastic(E=1000.0, nu=0.3)
    tie = (pr.Tie("lower.top", "upper.bottom"),) if swapped else TIE
    inc = last(stack(*MESHES[kind], (material, material), space=space, kinematics="finite", ties=tie))
    stress = np.concatenate([b.stress for b in inc.bodies.values()])
    assert np.ptp(stress, axis=0).max() < 1e-9 * 10.0
    assert abs(stress[:, 0]).max() < 1e-9 * 10.0 and abs(stress[:, 3]).max() < 1e-9 * 10.0


@pytest.mark.parametrize("kind", MESHES)
def test_a_bar_of_two_materials_shortens_by_the_sum_of_both(kind):
    """Held at the sides, each layer has the strain p / M with M = E (1 − ν) / ((1 + ν)(1 − 2 ν)): exact in small strain."""
    materials = pr.Elastic(E=1000.0, nu=0.3), pr.Elastic(E=4000.0, nu=0.2)
    inc = last(stack(*MESHES[kind], materials, fixed=("lower.right", "upper.right")))
    moduli = [m.E * (1 - m.nu) / ((1 + m.nu) * (1 - 2 * m.nu)) for m in materials]
    exact = 10.0 * (2 / moduli[0] + 3 / moduli[1])
    top = inc.bodies["upper"]
    assert np.allclose((top.X - top.x)[top.X[:, 1] > 4.999, 1], exact, rtol=1e-10)
    for body, m in zip(inc.bodies.values(), materials, strict=True):
        assert np.allclose(body.stress[:, 1], -10.0, rtol=1e-9)
        assert np.allclose(body.stress[:, 0], -10.0 * m.nu / (1 - m.nu), rtol=1e-9)


def test_a_matching_tie_is_the_mesh_in_one_piece():
    """A billet of two halves, pressed with friction into the plastic range, gives the force of the billet in one piece."""
    steel = pr.J2(E=70e3, nu=0.33, flow=pr.Voce(60.0, 120.0, 8.0))
    steps = (pr.Step("press", move={"punch": pr.Motion(y=-0.5)}, increments=4),)
    tool = {"punch": pr.Plane(touching="upper.top")}

    def contacts(*names):
        return (pr.Contact(names, "punch", friction=pr.Coulomb(0.2)),)

    two = stack(
        (4, 2), (4, 3), (steel, steel), space="axisymmetric", kinematics="finite", tools=tool, steps=steps,
        contacts=contacts("upper.top", "upper.right"),
    )  # fmt: skip
    one = upset_billet(*steps, size=(4, 5), n=(4, 5), material=steel, body="upper", tools=tool, sides=("top", "right"),
                       friction=pr.Coulomb(0.2))  # fmt: skip
    for a, b in zip(pr.solve(two), pr.solve(one), strict=True):
        assert a.force("punch").y == pytest.approx(b.force("punch").y, rel=1e-9)
        assert a.energy["imbalance"] == pytest.approx(b.energy["imbalance"], abs=1e-9 * b.energy["external"])
    radius = max(body.x[:, 0].max() for body in a.bodies.values())
    assert radius == pytest.approx(b.bodies["upper"].x[:, 0].max(), rel=1e-9)


@pytest.mark.parametrize("kind", ["nested", "free"])
def test_the_matrix_without_tied_nodes_is_the_derivative_of_the_residual(kind):
    """Tᵀ K T agrees with central differences of Tᵀ r(T x) at a deformed state, in finite strain."""
    system = pr.discretise(stack(*MESHES[kind], (NeoHooke(1000.0, 0.3), NeoHooke(3000.0, 0.2)), kinematics="finite"))
    from prensa.system.planning import plan_step

    state = system.initial()
    c = system.context(state, plan_step(system, 0, state.step_start), 1.0)
    reduced = Reduced.of(system, c.plan.fixed, pr.Numerics())
    rng = np.random.default_rng(0)
    x = 0.05 * rng.standard_normal(len(reduced.free))
    tied = reduced.restriction
    e = system.evaluate(c, tied.whole(x, system.ndof), state.lam)
    from scipy.sparse import csc_matrix

    K = csc_matrix((tied.values(e.data), tied.indices, tied.indptr), (len(x), len(x)))
    for _ in range(3):
        d = rng.standard_normal(len(x))
        r = [tied.part(system.evaluate(c, tied.whole(x + s * d, system.ndof), state.lam).r) for s in (1e-6, -1e-6)]
        assert np.abs(K @ d - (r[0] - r[1]) / 2e-6).max() < 1e-7 * np.abs(K @ d).max()


@pytest.mark.parametrize("element", ["q4", "q8", "t6"])
@pytest.mark.parametrize("held", [False, True])
def test_conditions_on_curved_edges_carry_rigid_motions_and_constant_traction(element, held):
    """On an arc between different meshes: slaves follow a rotation, and traction goes over with its resultant and moment."""
    inner = mesh_of(pr.Annulus(inner=1, outer=2, n=(7, 2), angles=(0, math.pi / 2)), element)
    outer = mesh_of(pr.Annulus(inner=2, outer=3, n=(9, 2), angles=(0, math.pi / 2)), element)
    meshes, offsets = {"a": inner, "b": outer}, {"a": 0, "b": len(inner.points)}
    problem = SimpleNamespace(ties=(pr.Tie("b.inner", "a.outer"),), space="plane strain")
    X = np.concatenate([inner.points, outer.points])
    supports = np.zeros(X.shape, dtype=bool)
    if held:
        supports[X[:, 0] < 1e-12, 0] = supports[X[:, 1] < 1e-12, 1] = True
    ties, X = make_ties(problem, meshes, offsets, X, supports)
    turn = np.array([[math.cos(0.3), math.sin(0.3)], [-math.sin(0.3), math.cos(0.3)]])
    rotation = (X @ turn - X).ravel()
    assert np.allclose(ties.matrix @ rotation, rotation, atol=1e-9 if not held else 2e-3)
    assert np.abs(X[offsets["b"] :] - outer.points).max() < 0.02 if element == "q4" else 2e-3
    load = np.zeros_like(X)
    load[outer.nodes("inner") + offsets["b"]] = (1.0, 2.0)
    passed = ties.to_masters(load.ravel()).reshape(-1, 2)
    assert np.allclose(passed.sum(axis=0), load.sum(axis=0), rtol=1e-12)
    if not held:
        assert _moment(X, passed) == pytest.approx(_moment(X, load), rel=1e-9)
    assert sides(outer.cells).shape[2] == (2 if element == "q4" else 3)


def _moment(x, force) -> float:
    return float((x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]).sum())


def test_three_bodies_meet_in_a_point():
    """Two columns on a plate, tied to it and to each other: their common foot is a slave of both and moves with the plate."""
    material = pr.Elastic(E=1000.0, nu=0.3)

    def bodies(n):
        return {
            "plate": pr.Body(pr.Rectangle(size=(4, 1), n=(4, 1)), material),
            "a": pr.Body(pr.Rectangle(size=(2, 2), n=(n, 2), origin=(0, 1)), material),
            "b": pr.Body(pr.Rectangle(size=(2, 2), n=(2, 2), origin=(2, 1)), material),
        }

    ties = (pr.Tie("a.bottom", "plate.top"), pr.Tie("b.bottom", "plate.top"), pr.Tie("a.right", "b.left"))
    for n in (2, 3):
        problem = pr.Problem(
            "three", kinematics="small", bodies=bodies(n), ties=ties,
            fixed={"plate.bottom": "y", "plate.left": "x", "a.left": "x"},
            steps=(pr.Step("pull", loads={"a.top": pr.Load(pressure=-1.0), "b.top": pr.Load(pressure=-1.0)}, increments=1),),
        )  # fmt: skip
        stress = np.concatenate([b.stress for b in last(problem).bodies.values()])
        assert np.allclose(stress[:, 1], 1.0, atol=1e-9)


@pytest.mark.parametrize(
    ("upper", "ties", "words"),
    [
        (pr.Rectangle(size=(5, 3), n=(3, 3), origin=(0, 2)), TIE, r"tie of upper.bottom to lower.top: at \(4.* nothing lies opp"),
        (pr.Rectangle(size=(4, 3), n=(3, 3), origin=(0, 2.1)), TIE, "the other side is 0.1 away"),
        (pr.Rectangle(size=(4, 3), n=(3, 3), origin=(0, 2)), (*TIE, pr.Tie("lower.top", "upper.bottom")), "swap|circle"),
        (pr.Rectangle(size=(4, 3), n=(3, 3), origin=(0, 2)), (pr.Tie("upper.top-left", "lower.top"),), "a tie joins boundaries"),
    ],
)  # fmt: skip
def test_ties_that_cannot_hold_are_refused_with_a_remedy(upper, ties, words):
    """Sides that do not lie on each other, circles and points."""
    material = pr.Elastic(E=1000.0, nu=0.3)
    problem = pr.Problem(
        "p", bodies={"lower": pr.Body(pr.Rectangle(size=(4, 2), n=(4, 2)), material), "upper": pr.Body(upper, material)},
        ties=ties, steps=(pr.Step("s"),),
    )  # fmt: skip
    with pytest.raises(MeshError, match=words):
        pr.discretise(problem)


def test_names_of_ties_are_checked():
    """Unknown boundaries are reported with the nearest one, and a body is not tied to itself."""
    body = {"b": pr.Body(pr.Rectangle(size=(4, 2), n=(4, 2)), pr.Elastic(E=1000.0, nu=0.3))}
    with pytest.raises(ValueError, match=r"ties.0.slave: unknown boundary 'tpo' of body 'b'; did you mean 'top'"):
        pr.Problem("p", bodies=body, ties=(pr.Tie("b.tpo", "b.bottom"),), steps=(pr.Step("s"),))
    with pytest.raises(ValueError, match="joins two bodies"):
        pr.Problem("p", bodies=body, ties=(pr.Tie("b.top", "b.bottom"),), steps=(pr.Step("s"),))
