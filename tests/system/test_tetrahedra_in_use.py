"""What acts on bodies of tetrahedra, and what is asked of them: as of bricks, and against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import tetrahedra
from prensa.mesh.bricks import outside
from prensa.system.face_loads import face_force, pressure_stiffness
from prensa.tools.tool import rotation_of

ELASTIC = pr.Elastic(1000.0, 0.3)
STEEL = pr.J2(200000.0, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2))
SIDES = {"left": (0, 0.0), "right": (0, 1.0), "bottom": (1, 0.0), "top": (1, 1.0), "back": (2, 0.0), "front": (2, 1.0)}


def box(size=(3.0, 1.0, 2.0), n=(2, 2, 2), skew=0.2, turn=None) -> pr.Tetrahedra:
    """A box of tetrahedra whose sides have the names of those of `Box`; ``turn``: about z."""
    X, cells, _ = tetrahedra(n, size, skew)
    sides = {name: np.flatnonzero(np.abs(X[:, k] - end * size[k]) < 1e-9).tolist() for name, (k, end) in SIDES.items()}
    if turn is not None:
        c, s = np.cos(turn), np.sin(turn)
        X = X @ np.array([(c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)]).T
    return pr.Tetrahedra(X.tolist(), cells.tolist(), sides)


def loaded(mesh=None, material=ELASTIC, **more) -> pr.Problem:
    """A small box that is held at the left."""
    given = {
        "bodies": {"b": pr.Body(mesh or box(), material)}, "fixed": {"b.left": "xyz"}, "steps": (pr.Step("load", increments=1),)
    }  # fmt: skip
    return pr.Problem("box", space="solid", **given | more)


def test_forces_of_pressures_on_six_nodes():
    """All around they are in balance, with warped faces; the tangent is their derivative to 1e-9 of its largest entry."""
    X, cells, _ = tetrahedra((1, 1, 1), (2.0, 2.0, 2.0))
    x, faces = X + np.random.default_rng(4).uniform(-0.1, 0.1, X.shape), outside(cells)
    f = face_force(x, faces, 2.0).reshape(-1, 3)
    at = x[faces].reshape(-1, 3)
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    assert np.abs(np.cross(at, f).sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    one, h = faces[:1], 1e-6
    K = pressure_stiffness(x, one, 3.0)[0]
    for k, node in enumerate(one[0]):
        for axis in range(3):
            step = np.zeros_like(x)
            step[node, axis] = h
            slope = (face_force(x + step, one, 3.0) - face_force(x - step, one, 3.0))[0] / (2 * h)
            assert np.abs(slope + K[:, 3 * k + axis]).max() < 1e-9 * np.abs(K).max()


def test_a_uniform_pressure_gives_a_uniform_stress():
    """On three sides of a skew mesh whose others are planes of symmetry: −p, and the strain −p (1 − 2ν)/E."""
    *_, last = pr.solve(loaded(
        fixed={"b.left": "x", "b.bottom": "y", "b.back": "z"}, kinematics="small",
        loads={f"b.{side}": pr.Load(pressure=6.0) for side in ("right", "top", "front")},
    ))  # fmt: skip
    body = last.bodies["b"]
    assert np.allclose(body.stress, [-6.0] * 3 + [0.0] * 3, atol=1e-9)
    assert np.allclose(body.displacement, -6.0 * 0.4 / 1000.0 * body.X, atol=1e-12)


def test_supports_carry_what_acts():
    """Resultants at the end: pressure, traction on a side, and weight, by statics."""
    *_, last = pr.solve(loaded(
        box((3.0, 1.0, 1.0)),
        loads={"b.top": pr.Load(pressure=0.01, follower=False), "b.front": pr.Load(traction=(0.02, 0.0, 0.03))},
        body_force={"b": (0.0, -0.01, 0.005)},
    ))  # fmt: skip
    assert last.supports["b.left"] == pytest.approx((-0.06, 0.03 + 0.03, -0.09 - 0.015), rel=1e-8)


def test_a_plane_of_symmetry_at_any_angle():
    """A bar held along the normal of an inclined side, pulled along its axis: the stress and force of the straight one."""
    ends = []
    for turn in (None, 0.4):
        fixed = {"b.left": pr.Fixed(normal="held"), "b.bottom": pr.Fixed(normal="held"), "b.back": "z"}
        way = np.array([1.0, 0.0]) if turn is None else np.array([np.cos(turn), np.sin(turn)])
        pulled = {"b.right": pr.Load(traction=(5.0 * way[0], 5.0 * way[1], 0.0))}
        *_, last = pr.solve(loaded(box(turn=turn), fixed=fixed, loads=pulled, kinematics="small"))
        u = last.bodies["b"].displacement[:, :2] @ way
        assert u.max() == pytest.approx(5.0 / 1000.0 * 3.0, rel=1e-8)
        ends.append(last.energy["elastic"])
    assert ends[1] == pytest.approx(ends[0], rel=1e-8)


def test_a_block_springs_back_freely():
    """Pressed between two plates with friction and released: no force is left, and no more elastic energy than before."""
    tools = {"t": pr.Plane(touching="b.top"), "table": pr.Plane(touching="b.bottom", normal=(0.0, 1.0, 0.0))}
    problem = loaded(
        box((1.0, 1.0, 1.0), (1, 1, 1)), STEEL, fixed={}, tools=tools, friction=pr.Coulomb(0.2),
        contacts=(pr.Contact("b.top", "t"), pr.Contact("b.bottom", "table")),
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.05)}, increments=2), pr.Step("off", remove_tools=True, increments=1)),
    )  # fmt: skip
    pressed, last = [i for i in pr.solve(problem) if i.time in (1.0, 2.0)]
    body = last.bodies["b"]
    assert np.abs(body.reaction).max() < 1e-6 * 500.0
    assert body.plastic_strain.min() > 0.02
    assert last.energy["elastic"] < 0.2 * pressed.energy["elastic"]


def test_places_between_the_nodes_of_tetrahedra():
    """On a side, inside, and all over a plane: a linear field is exact there, and so is the place."""
    problem = loaded(
        fixed={"b.left": "x", "b.bottom": "y", "b.back": "z"}, kinematics="small",
        loads={"b.right": pr.Load(traction=(10.0, 0.0, 0.0))},
    )
    *_, last = pr.solve(problem)
    strain = 0.01
    for text, value in {
        "b.top.ux at X=1.3, Z=0.7": 1.3 * strain,
        "b.top.uy at X=1.3, Z=0.7": -0.3 * strain,
        "b.ux at X=1.1, Y=0.35, Z=0.9": 1.1 * strain,
        "b.max.stress.xx at X=1.7": 10.0,
        "b.max.ux at X=1, Y=0.5": strain,
        "b.volume": 6.0 * (1.0 + strain) * (1.0 - 0.3 * strain) ** 2,
        "b.top.min.y at Z=1": 1.0 - 0.3 * strain,
    }.items():
        assert last.measure(text) == pytest.approx(value, rel=1e-8, abs=1e-9), text


def stacked(lower, upper, **more):
    """A block on another one, tied; `pr.Box`, or numbers of tetrahedra along the axes."""
    meshes = {}
    for name, n, y in (("a", lower, 0.0), ("b", upper, 2.0)):
        size = (4.0, 2.0 if name == "a" else 1.0, 3.0)
        if isinstance(n, list):
            meshes[name] = pr.Box(size, tuple(n), origin=(0.0, y, 0.0))
            continue
        plain = box(size, n, 0.15)
        points = (np.array(plain.points) + y * np.eye(3)[1]).tolist()
        meshes[name] = pr.Tetrahedra(points, plain.cells, plain.boundaries)
    given = {"kinematics": "small", "steps": (pr.Step("s", increments=1),), "ties": (pr.Tie("b.bottom", "a.top"),)}
    bodies = {name: pr.Body(mesh, ELASTIC) for name, mesh in meshes.items()}
    return pr.Problem("tied", space="solid", bodies=bodies, **given | more)


@pytest.mark.parametrize(
    ("lower", "upper"), [((2, 1, 2), (3, 1, 2)), ([2, 2, 2], (3, 1, 2)), ((3, 1, 2), [2, 1, 2]), ((2, 1, 2), (2, 1, 2))], ids=str
)
def test_an_even_stress_passes_a_tie(lower, upper):
    """Of tetrahedra on tetrahedra and on bricks, with planes of symmetry through the tie: to round-off."""
    fixed = {"a.left": "x", "a.bottom": "y", "a.back": "z", "b.left": "x", "b.back": "z"}
    *_, last = pr.solve(stacked(lower, upper, fixed=fixed, loads={"b.top": pr.Load(traction=(0.0, -5.0, 0.0))}))
    for name in "ab":
        assert np.allclose(last.bodies[name].stress, [0.0, -5.0, 0.0, 0.0, 0.0, 0.0], atol=1e-9)
        assert last.bodies[name].displacement[:, 1] == pytest.approx(-5e-3 * last.bodies[name].X[:, 1], abs=1e-11)


def test_forces_go_through_a_tie_of_tetrahedra():
    """A shear on top is carried at the bottom, with its moment; both turned by 20°, slaves go where the turn takes them."""
    shear = {"b.top": pr.Load(traction=(2.0, 0.0, 1.0))}
    problem = stacked((2, 1, 2), (3, 1, 2), fixed={"a.bottom": "xyz"}, loads=shear)
    *_, last = pr.solve(problem)
    assert last.supports["a.bottom"] == pytest.approx((-24.0, 0.0, -12.0), abs=1e-8)
    assert last.support_moments["a.bottom"].mz == pytest.approx(24.0 * 3.0, rel=1e-8)
    system = pr.discretise(problem)
    turn = rotation_of([0.0, 0.0, np.radians(20.0)])
    u = np.zeros(system.ndof)
    system.displacement(u)[:] = system.X @ (turn - np.eye(3)).T
    assert np.allclose(system.with_slaves(u), u, atol=1e-12)
