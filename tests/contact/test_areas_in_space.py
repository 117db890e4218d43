"""Friction per current area in space: its tangent, closed forms, plane strain, turned models, restarts, energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import bricks, tetrahedra
from prensa.contact.pairing import rotation
from prensa.registry import DOORS
from prensa.system.planning import plan_step
from prensa.system.state import State

RUBBER = pr.NeoHooke(100.0, 0.3)
STEEL = pr.J2(2000.0, 0.3, pr.Swift(20.0, 0.01, 0.2))
TIGHT = pr.Numerics(tolerance=1e-12)
SIDES = {"left": (0, 0.0), "right": (0, 1.0), "bottom": (1, 0.0), "top": (1, 1.0), "back": (2, 0.0), "front": (2, 1.0)}


class Users(pr.FrictionLaw):
    """A bound in NumPy that rises with the slip."""

    mu: float
    most: float

    def bound(self, p, kappa, at):
        return np.minimum(self.mu * p, self.most) + 3.0 * kappa / (1.0 + kappa)


LAWS = {
    "shear": pr.Shear(0.5, k=4.0), "ramp": pr.Shear(0.5, k=9000.0), "capped": pr.Capped(0.3, m=0.5, k=1.2),
    "rounded": pr.Capped(0.3, m=0.5, k=6.0, sharpness=2), "wanheim_bay": pr.WanheimBay(0.6, k=4.0),
    "levanov": pr.Levanov(0.6, k=4.0), "wang_osakada": pr.WangOsakada(0.2, k=2.0),
    "table": pr.FrictionTable(pressure=((0.0, 0.3), (4.0, 0.2), (12.0, 0.1)), slip=((0.0, 1.0), (3.0, 1.5))),
    "users": Users(0.3, 0.8),
}  # fmt: skip
TOOLS = {
    "plane": pr.Plane(normal=(0.2, -1.0, 0.1), at=(1.0, 1.0, 1.0)),
    "sphere": pr.Sphere(radius=5.0, at=(0.8, 5.85, 1.1)),
}


def block(X, cells, size, cls=pr.Bricks):
    """A mesh of arrays whose sides have the names of those of `Box`."""
    sides = {name: np.flatnonzero(np.abs(X[:, k] - end * size[k]) < 1e-9).tolist() for name, (k, end) in SIDES.items()}
    return cls(X.tolist(), cells.tolist(), sides)


def mesh(kind):
    """Bodies whose contact points have areas of triangles of three nodes and of six."""
    if kind == "wedges":
        return pr.Revolution(pr.Rectangle((2.0, 1.0), (2, 1)), 3, angle=0.5 * np.pi, core="wedges")
    X, cells, _ = tetrahedra((2, 1, 2), (2.0, 1.0, 2.0))
    return block(X, cells, (2.0, 1.0, 2.0), pr.Tetrahedra)


# -------------------------------------------------------------------------------------------------------------- tangents
def off_differences(system, lam, u0, u, tool):
    """Largest distance of K v from differences of the residual over the largest entry of K, states of points, their forces."""
    from scipy.sparse import csc_matrix

    state = system.initial()
    u0[tool], u[tool] = [0.02, -0.05, 0.01, 0.03, -0.02, 0.04], [0.03, -0.09, 0.03, 0.06, 0.04, -0.02]
    state = replace(state, u=system.step_begun(u0))
    plan = plan_step(system, 0, state.u)
    first = system.evaluate(system.context(state, plan, 0.3), state.u, state.lam)
    contact = state.contact.replaced(slice(None), first.contacts[0].record)
    c = system.context(replace(state, contact=contact, history=first.history, lam=lam), plan, 0.6)
    base = system.evaluate(c, u, lam)
    f = base.contacts[0]
    states = (f.p > 0).astype(int) + f.slip
    K = csc_matrix((base.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    h, rng, worst = 1e-6, np.random.default_rng(5), []
    for v in (*np.eye(system.ndof)[tool], *rng.normal(size=(4, system.ndof))):
        near = [system.evaluate(c, u + k * h * v, lam, stiffness=False) for k in (1, -1, 2, -2)]
        if any(((e.contacts[0].p > 0) + 1 * e.contacts[0].slip != states).any() for e in near):
            continue
        a, b, twice, minus = (e.r for e in near)
        worst.append(np.abs((8.0 * (a - b) - (twice - minus)) / (12.0 * h) - K @ v).max() / np.abs(K.data).max())
    assert len(worst) >= 6
    return max(worst), states, f


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
@pytest.mark.parametrize(("tool", "kind"), [("plane", "wedges"), ("plane", "tetrahedra"), ("sphere", "tetrahedra")])
def test_the_tangent_is_the_derivative(tool, kind, enforcement):
    """Every law within 1e-6 of the largest entry, by the tool's motions and along random directions; points stick and slip.

    Quadrilaterals are in test_tangents_of_tools_in_space.
    """
    seen, parts = np.zeros(3, dtype=np.int64), []
    for law in LAWS.values():
        system = pr.discretise(pr.Problem(
            "t", space="solid", tools={"t": TOOLS[tool]}, bodies={"b": pr.Body(mesh(kind), RUBBER)},
            contacts=(pr.Contact("b.top", "t", friction=law, enforcement=enforcement),), fixed={"b.bottom": "xyz"},
            steps=(pr.Step("s"),),
        ))  # fmt: skip
        rng = np.random.default_rng(1)
        u0 = 0.01 * rng.normal(size=system.ndof)
        lam = np.array([1.0, 0.1, 0.1]) * rng.normal((1.0, 0.0, 0.0), (0.0, 1.0, 1.0), system.initial().lam.shape)
        u = u0 + 0.01 * rng.normal(size=system.ndof)
        worst, states, f = off_differences(system, lam, u0, u, system.dofs.tool.dofs(0))
        assert worst <= 1e-6
        seen += np.bincount(states, minlength=3)
        parts.append(np.abs(f.stretched).max())
    assert seen[1] > 0
    assert seen[2] > 0
    assert min(parts) > 0.01


def test_all_laws_of_the_plane_are_tried():
    """None of those in the door is left out: a bound that is proportional to the pressure has no area."""
    own = {cls for cls in DOORS["friction"].own().values() if not cls.proportional}
    assert len(own) >= 6
    assert own <= {type(law) for law in LAWS.values()}


# ----------------------------------------------------------------------------------------------------------- closed forms
BOX = pr.Box((2.0, 1.0, 1.0), (2, 1, 1))


def drawn(body=BOX, law=pr.Shear(0.6, k=2.0), enforcement=pr.Penalty(), increments=4):  # noqa: B008
    """A block that is stretched by a quarter while a plate on it is drawn over it the other way; all points slip along x."""
    return pr.Problem(
        "drawn", space="solid", friction=law, bodies={"b": pr.Body(body, RUBBER)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t", enforcement=enforcement),),
        fixed={"b.bottom": "y", "b.left": "x", **dict.fromkeys(("b.back", "b.front", "b.top"), "z")},
        steps=(
            pr.Step("press", move={"t": pr.Motion(x=-0.3, y=-0.1)}, increments=1),
            pr.Step("draw", by={"t": pr.Motion(x=-1.5)}, fixed={"b.right": pr.Fixed(x=0.5)}, increments=increments),
        ),
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["penalty", "augmented", "exact", "tetrahedra"])
def test_friction_is_m_k_times_the_area_now(kind):
    """To 1e-9, on a side that grows in every increment, by the table's areas; those at the end are known: it is 2.5 long then."""
    X, cells, _ = tetrahedra((2, 1, 1), (2.0, 1.0, 1.0))
    given = {
        "penalty": {}, "augmented": {"enforcement": pr.Augmented()}, "exact": {"enforcement": pr.Exact()},
        "tetrahedra": {"body": block(X, cells, (2.0, 1.0, 1.0), pr.Tetrahedra)},
    }[kind]  # fmt: skip
    found = list(pr.solve(drawn(**given), TIGHT))
    for inc in found:
        (contact,) = inc.contacts.values()
        assert inc.force("t").x == pytest.approx(0.6 * 2.0 * contact.area, rel=1e-9)
        assert abs(inc.force("t").z) <= 1e-9 * inc.force("t").x
        assert (contact.status == 2).all()
        assert np.allclose(contact.shear, 1.2, rtol=1e-12)
    assert found[-1].force("t").x == pytest.approx(0.6 * 2.0 * 2.5, rel=1e-5 if kind == "tetrahedra" else 1e-9)
    assert contact.area > 1.2 * found[0].contacts["b.top-t"].area


def test_what_the_energy_balance_misses_falls_with_the_increments():
    """The work of friction is counted on areas that change: with four times as many increments a quarter is missed, or less."""

    def missed(increments):
        found = list(pr.solve(drawn(increments=increments)))
        first, last = found[0].energy, found[-1].energy
        return (last["imbalance"] - first["imbalance"]) / (last["friction"] - first["friction"])

    coarse, fine = missed(4), missed(16)
    assert abs(fine) < min(abs(coarse) / 4, 2e-3)


def test_friction_that_a_step_lowers_is_released_over_it():
    """From one shear factor to a third of it while the plate goes on: the force is that of the lower bound at the end."""
    problem = drawn(increments=2)
    lower = pr.Step("lower", by={"t": pr.Motion(x=-0.5)}, friction={"b.top-t": pr.Shear(0.2, k=2.0)}, increments=4)
    *_, before, one, two, three, after = pr.solve(replace(problem, steps=(*problem.steps, lower)), TIGHT)
    forces = [inc.force("t").x for inc in (before, one, two, three, after)]
    assert forces[0] == pytest.approx(3.0, rel=1e-9)
    assert forces[-1] == pytest.approx(1.0, rel=1e-9)
    assert np.allclose(np.diff(forces), -0.5, rtol=1e-6)


# ------------------------------------------------------------------------------------------------------------- identities
@pytest.mark.parametrize("law", [pr.Shear(0.5), pr.Capped(0.2, m=0.6)], ids=["shear", "capped"])
def test_one_layer_is_plane_strain(law):
    """A plate that presses a plastic block and slides, friction by the metal's strength: forces, work to 1e-8 per thickness."""
    section, made = pr.Rectangle((4.0, 2.0), (4, 2)), []
    for solid in (False, True):
        fixed = {"b.bottom": "xyz" if solid else "xy"} | ({"b.base": "z", "b.cap": "z"} if solid else {})
        made.append(list(pr.solve(pr.Problem(
            "plate", space="solid" if solid else "plane strain", fixed=fixed, friction=law,
            bodies={"b": pr.Body(pr.Extrusion(section, 2.5, 1), STEEL, "h8") if solid else pr.Body(section, STEEL, "q4")},
            tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
            steps=(
                pr.Step("press", move={"t": pr.Motion(y=-0.1)}, increments=3),
                pr.Step("slide", by={"t": pr.Motion(x=0.2)}, increments=4),
            ),
        ), TIGHT)))  # fmt: skip
    plane, space = made
    assert len(plane) == len(space) == 7
    for flat, solid in zip(plane, space, strict=True):
        a, b = flat.force("t"), solid.force("t")
        assert np.allclose([b.x / 2.5, b.y / 2.5], [a.x, a.y], rtol=1e-8, atol=1e-8 * abs(a.y))
        for part in ("plastic", "friction", "external"):
            assert solid.energy[part] / 2.5 == pytest.approx(flat.energy[part], rel=1e-8)
    (contact,) = solid.contacts.values()
    assert {2} <= set(contact.status.tolist())


def turned(Q):
    """A plastic block under a slanted plate that presses and slides, all of it turned by Q (3, 3)."""
    X, cells, _ = bricks((2, 2, 2), (2.0, 1.0, 2.0))
    named = block(X, cells, (2.0, 1.0, 2.0)).boundaries
    mesh = pr.Bricks((X @ Q.T).tolist(), cells.tolist(), named)
    ways = [Q @ [0.0, -0.1, 0.0], Q @ [0.15, -0.02, 0.1]]
    return pr.Problem(
        "turned", space="solid", friction=pr.Shear(0.5), bodies={"b": pr.Body(mesh, STEEL)},
        tools={"t": pr.Plane(normal=tuple(Q @ [0.05, -1.0, 0.02]), at=tuple(Q @ [1.0, 1.0, 1.0]))},
        contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
        steps=tuple(
            pr.Step(str(k), by={"t": pr.Motion(**dict(zip("xyz", way.tolist())))}, increments=2) for k, way in enumerate(ways)
        ),
    )  # fmt: skip


@pytest.fixture(scope="module")
def upright():
    return list(pr.solve(turned(np.eye(3)), TIGHT))


def test_a_turned_model_has_turned_forces(upright):
    """Forces turn along, energies and states of the points stay, to 1e-9; points stick and slip."""
    Q = rotation(np.array([0.4, -0.9, 0.6]))
    *_, plain = upright
    *_, other = pr.solve(turned(Q), TIGHT)
    f, g = np.array(plain.force("t")), np.array(other.force("t"))
    assert np.abs(g[:3] - Q @ f[:3]).max() < 1e-9 * np.linalg.norm(f[:3])
    for part in ("plastic", "friction", "contact"):
        assert other.energy[part] == pytest.approx(plain.energy[part], rel=1e-9)
    (a,), (b,) = plain.contacts.values(), other.contacts.values()
    assert np.array_equal(a.status, b.status)
    assert np.allclose(a.slip, b.slip, rtol=1e-8, atol=1e-10)


def test_a_run_goes_on_from_its_arrays_bit_for_bit(upright):
    """From the arrays of a state in the middle every later state has the same bits."""
    states = [inc.state for inc in upright]
    rest = [inc.state for inc in pr.solve(turned(np.eye(3)), TIGHT, start=State.from_arrays(states[1].arrays()))]
    assert len(rest) == len(states) - 2
    for a, b in zip(rest, states[2:], strict=True):
        x, y = a.arrays(), b.arrays()
        assert list(x) == list(y)
        assert all(x[k].tobytes() == y[k].tobytes() for k in x)
