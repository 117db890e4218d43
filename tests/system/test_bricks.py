"""Bricks under a rigid plane: contact, friction, Newton and time stepping are those of the plane, in three dimensions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.system.planning import plan_step
from problems import pressed_block, stroke

SWIFT = pr.J2(1000.0, 0.3, pr.Swift(20.0, 0.01, 0.2))
CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]


def bricks(n, size):
    """Points (nodes, 3), cells (elements, 8) and faces (k, 4) on top, where y is largest, of a box from the origin."""
    grid = np.stack(np.meshgrid(*(np.arange(k + 1) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(grid)).reshape([k + 1 for k in n])
    a, b, c = n
    corners = [number[i : a + i, j : b + j, k : c + k] for k in (0, 1) for i, j in CORNERS]
    top = number[:, -1]
    faces = np.stack([top[i : a + i, k : c + k] for i, k in CORNERS], axis=-1).reshape(-1, 4)
    return grid * (np.array(size) / n), np.stack(corners, axis=-1).reshape(-1, 8), faces


def where(flags) -> np.ndarray:
    return np.flatnonzero(flags)


def under_plane(X, cells, material, top, at, normal, supports, steps, friction=None, enforcement=None, **given):
    """Bricks X, cells under a plane on the faces ``top``; supports by name: nodes and axes; steps: name, way, increments."""
    sides = {"surface": np.unique(top)} | {name: nodes for name, (nodes, _) in supports.items()}
    mesh = pr.Bricks(X.tolist(), cells.tolist(), {name: nodes.tolist() for name, nodes in sides.items()})
    how = {} if enforcement is None else {"enforcement": enforcement}
    element = {"element": given.pop("element")} if "element" in given else {}
    return pr.Problem(
        "bricks", space="solid", bodies={"body": pr.Body(mesh, material, **element)},
        tools={"plane": pr.Plane(normal=normal, at=at)},
        contacts=(pr.Contact("body.surface", "plane", friction=friction, **how),),
        fixed={f"body.{name}": pr.Fixed(**dict.fromkeys(axes, "held")) for name, (_, axes) in supports.items()},
        steps=tuple(
            pr.Step(name, move={"plane": pr.Motion(**way)}, increments=next(iter(n), None)) for name, way, *n in steps
        ), **given,
    )  # fmt: skip


# ---------------------------------------------------------------------------------------- (1) a layer is the plane problem


@pytest.mark.parametrize(
    ("kinematics", "enforcement", "elements"),
    [
        *(
            pytest.param(kinematics, enforcement, ("q4", "h8"), id=f"{kinematics}-{enforcement.type}")
            for kinematics in ("small", "finite")
            for enforcement in (pr.Penalty(), pr.Augmented())
        ),
        pytest.param("finite", pr.Penalty(), ("q4_enhanced", "h8_enhanced"), id="enhanced"),
    ],
)
def test_a_layer_of_bricks_is_the_problem_in_plane_strain(kinematics, enforcement, elements):
    """Pressed and pushed sideways with stick and slip: forces to 1e-9 of the plane problem's, iterations but for one at most.

    What differs is the scale of the residual, which has the forces across the layer in it.
    """
    n, size, thickness = (6, 3), (2.0, 1.0), 0.7
    X, cells, top = bricks((*n, 1), (*size, thickness))
    problem = under_plane(
        X, cells, SWIFT, top, (1.0, 1.0, 0.3), (0.0, -1.0, 0.0),
        {"bottom": (where(X[:, 1] == 0.0), "xy"), "sides": (np.arange(len(X)), "z")},
        (("press", {"y": -0.05}, 4), ("push", {"x": 0.04}, 6)),
        pr.Coulomb(0.3), enforcement, element=elements[1], kinematics=kinematics,
    )  # fmt: skip
    plane = pressed_block(
        stroke(-0.05, increments=4), pr.Step("push", move={"t": pr.Motion(x=0.04)}, increments=6), material=SWIFT,
        size=size, n=n, element=elements[0], friction=pr.Coulomb(0.3), enforcement=enforcement, kinematics=kinematics,
        thickness=thickness,
    )  # fmt: skip
    spatial, two = list(pr.solve(problem)), list(pr.solve(plane))
    assert len(spatial) == len(two) == 10
    seen: set[int] = set()
    largest = max(max(abs(b.force("t").x), abs(b.force("t").y)) for b in two)
    for a, b in zip(spatial, two, strict=True):
        f, g = a.force("plane"), b.force("t")
        assert abs(f.x - g.x) <= 1e-9 * largest
        assert abs(f.y - g.y) <= 1e-9 * largest
        assert abs(f.z) <= 1e-12 * largest
        assert abs(a.statistics.iterations - b.statistics.iterations) <= 1
        assert np.isclose(a.energy["friction"], b.energy["friction"], rtol=1e-8, atol=1e-12)
        (contact,) = a.contacts.values()
        status = {int(v) for v in contact.status}
        assert status == {int(v) for v in b.contacts["b.top-t"].status}
        seen |= status
    assert {1, 2} <= seen


@pytest.mark.parametrize(("deep", "edges"), [(0.2, 0.2), (1.0, 1.0), (9.0, 2.0)])
def test_bricks_press_in_what_elements_of_the_plane_do(deep, edges):
    """Their depth, and two edges at most, as under points of the plane."""
    X, cells, top = bricks((6, 3, 1), (3.0, 1.5 * deep, 0.7))
    problem = under_plane(
        X, cells, SWIFT, top, (1.0, 2.0 * deep, 0.3), (0.0, -1.0, 0.0), {"bottom": (where(X[:, 1] == 0.0), "xyz")},
        (("press", {"y": -0.05}, 4),),
    )  # fmt: skip
    (s,) = pr.discretise(problem).surfaces
    assert np.allclose(s.points.depth, 0.5 * deep)
    assert np.allclose(s.unit, s.modulus / (0.5 * edges))


# ------------------------------------------------------------------------------------------------------- (2) an upset cube
def test_an_upset_cube_converges_quadratically_and_balances():
    """An eighth of a plastic cube under the plane with friction: contact forces, tool and supports agree to 1e-9."""
    X, cells, top = bricks((4, 4, 4), (1.0, 1.0, 1.0))
    supports = {name: (where(X[:, k] == 0.0), name) for k, name in enumerate("xyz")}
    problem = under_plane(
        X, cells, SWIFT, top, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), supports, (("press", {"y": -0.2}, 8),),
        pr.Coulomb(0.2),
    )  # fmt: skip
    increments = list(pr.solve(problem, pr.Numerics(tolerance=1e-11, reuse_factors=False)))
    assert len(increments) == 8
    for inc in increments:
        assert inc.statistics.cutbacks == 0
        assert inc.statistics.iterations <= 8
        f, (contact,) = inc.force("plane"), inc.contacts.values()
        total, size = contact.force.sum(axis=0), np.abs(contact.force).sum()
        assert np.abs(total + np.array(f[:3])).max() <= 1e-9 * size  # on the body, and on the tool
        held = [sum(getattr(s, axis) for s in inc.supports.values()) for axis in "xyz"]
        assert np.abs(total + held).max() <= 1e-9 * size
        # the block and its friction are the same along x and z
        assert abs(f.x - f.z) <= 1e-9 * abs(f.y)
        # r ≤ C r² from where contact has settled, down to round-off
        r = np.array(inc.statistics.residuals)
        settled = np.array(inc.statistics.changes[:-1]) == 0
        near = settled & (r[:-1] < 1e-3) & (r[1:] > 1e-12)
        assert near.any()
        assert (r[1:][near] <= 50.0 * r[:-1][near] ** 2).all()
    assert {int(v) for v in contact.status} >= {1, 2}
    assert f.y > 0.0
    assert abs(inc.energy["imbalance"]) <= 0.05 * inc.energy["external"]


# --------------------------------------------------------------------------------------------------------- (3) the tangent
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented()], ids=["penalty", "augmented"])
def test_the_tangent_is_the_derivative_in_stick_slip_and_open(enforcement):
    """Assembled stiffness against central differences to 1e-6 under an oblique plane, all three states present."""
    X, cells, top = bricks((4, 2, 4), (2.0, 1.0, 2.0))
    rng = np.random.default_rng(4)
    X = X + 0.03 * rng.normal(size=X.shape)
    problem = under_plane(
        X, cells, SWIFT, top, (1.0, 1.0, 1.0), (0.2, -1.0, 0.1), {"bottom": (where(X[:, 1] < 0.2), "xyz")},
        (("press", {"y": -0.1}),), pr.Coulomb(0.005), enforcement,
    )  # fmt: skip
    system = pr.discretise(problem)
    state, tool = system.initial(), system.dofs.tool.dofs(0)
    plan = plan_step(system, 0, state.u)
    # a first random increment gives the body and the contact a history
    u1 = 0.01 * rng.normal(size=system.ndof)
    u1[tool[3:]] = 0.0
    first = system.evaluate(system.context(state, plan, 0.3), u1, state.lam)
    contact = state.contact.replaced(slice(None), first.contacts[0].record)
    lam = 0.1 * rng.normal(size=state.lam.shape) * [0.0, 1.0, 1.0] + [1.0, 0.0, 0.0]
    state = replace(state, u=u1, history=first.history, contact=contact, lam=lam)
    c = system.context(state, plan, 0.6)
    s = system.surfaces[0]
    u = u1 + 0.003 * rng.normal(size=system.ndof)
    # half of the points hardly move along the plane
    quiet = np.arange(len(s.points)) % 2 == 0
    system.displacement(u)[s.points.nodes[quiet]] = system.displacement(u1)[s.points.nodes[quiet]] + 1e-5
    loud = s.points.nodes[~quiet]
    system.displacement(u)[loud] += 0.03 * rng.normal(size=(len(loud), 3)) * [1.0, 0.0, 1.0]
    u[tool] = u1[tool]
    base = system.evaluate(c, u, lam)
    assert not base.failed
    f = base.contacts[0]
    states = (f.p > 0).astype(int) + f.slip
    assert {int(v) for v in states} == {0, 1, 2}

    from scipy.sparse import csc_matrix

    K = csc_matrix((base.data, system.pattern.indices, system.pattern.indptr), (system.ndof, system.ndof))
    moves = np.ones(system.ndof)
    moves[tool[3:]] = 0.0  # the plane does not turn
    nodal = system.dofs.displacement.dofs(s.points.nodes).ravel()
    columns = [np.eye(system.ndof)[k] for k in (*tool[:3], *nodal)] + [
        moves * rng.normal(size=system.ndof) for _ in range(4)
    ]
    h, checked = 1e-7, 0
    for v in columns:
        plus, minus = (system.evaluate(c, u + d * v, lam, stiffness=False) for d in (h, -h))
        if any(((e.contacts[0].p > 0) + 1 * e.contacts[0].slip != states).any() for e in (plus, minus)):
            continue
        difference = (plus.r - minus.r) / (2 * h)
        assert np.abs(difference - K @ v).max() <= 1e-6 * max(np.abs(K @ v).max(), 1e-2 * np.abs(K.data).max())
        checked += 1
    assert checked > 0.9 * len(columns)


# ------------------------------------------------------------------------------------------------------ (4) the patch test
@pytest.mark.parametrize("element", ["h8", "h8_fbar", "h8_enhanced"])
def test_a_skew_patch_has_uniform_pressure(element):
    """Distorted bricks under a frictionless plane: every node's pressure is the mean one to 1e-10."""
    X, cells, top = bricks((3, 3, 3), (1.0, 1.0, 1.0))
    rng = np.random.default_rng(0)
    inside = (X > 0.0) & (X < 1.0)
    X = X + 0.06 * rng.uniform(-1, 1, size=X.shape) * inside  # nodes of a face stay in it
    supports = {name: (where(X[:, k] == 0.0), name) for k, name in enumerate("xyz")}
    problem = under_plane(
        X, cells, pr.Elastic(1000.0, 0.3), top, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), supports,
        (("press", {"y": -0.05}, 2),), enforcement=pr.Penalty(k_n=1e5), element=element,
    )  # fmt: skip
    *_, inc = pr.solve(problem)
    (contact,) = inc.contacts.values()
    # the law acts on areas of the start of the increment; the stretch of the surface is uniform
    p = contact.pressure
    assert p.min() > 0.0
    assert np.abs(p - p.mean()).max() <= 1e-10 * p.mean()
    assert np.isclose(contact.area, inc.bodies["body"].x[:, 0].max() * inc.bodies["body"].x[:, 2].max(), rtol=0.01)


# ----------------------------------------------------------------------------------------------------------- (5) isotropy
@pytest.mark.parametrize("angle", [0.0, 30.0, 200.0])
def test_friction_is_the_same_in_all_directions_of_the_plane(angle):
    """A block held on its bottom, pushed along 30 degrees: the force on the tool is along it, and |t| = mu p at every node."""
    X, cells, top = bricks((2, 1, 2), (1.0, 0.5, 1.0))
    way = np.array([np.cos(np.radians(angle)), 0.0, np.sin(np.radians(angle))])
    problem = under_plane(
        X, cells, pr.Elastic(1000.0, 0.0), top, (0.0, 0.5, 0.0), (0.0, -1.0, 0.0), {"all": (np.arange(len(X)), "xyz")},
        (("press", {"y": -0.001}, 1), ("push", {"x": 0.3 * way[0], "z": 0.3 * way[2]}, 5)), pr.Coulomb(0.25),
    )  # fmt: skip
    *_, inc = pr.solve(problem)
    (contact,) = inc.contacts.values()
    f = np.array(inc.force("plane")[:3])
    assert np.allclose(f - [0.0, f[1], 0.0], -0.25 * f[1] * way, rtol=0, atol=1e-12 * f[1])
    assert np.allclose(contact.shear, 0.25 * contact.pressure, rtol=1e-12)
    assert (contact.status == 2).all()


# -------------------------------------------------------------------------------------------------- state, and what is refused
@pytest.mark.parametrize("element", ["h8_fbar", "h8_enhanced"])
def test_a_run_in_space_is_continued_from_its_arrays_bit_for_bit(element):
    """From the arrays of a state in the middle, with (points, 2) tractions, every later state has the same bits."""
    from prensa.system.state import State

    X, cells, top = bricks((3, 2, 2), (1.0, 1.0, 1.0))
    problem = under_plane(
        X, cells, SWIFT, top, (0.0, 1.0, 0.0), (0.1, -1.0, 0.0), {"bottom": (where(X[:, 1] == 0.0), "xyz")},
        (("press", {"y": -0.06}, 3), ("push", {"x": 0.02, "z": 0.01}, 3)), pr.Coulomb(0.2), element=element,
    )  # fmt: skip
    states = [inc.state for inc in pr.solve(problem)]
    assert states[2].contact.traction.shape == (12, 2)
    again = State.from_arrays(states[2].arrays())
    rest = [inc.state for inc in pr.solve(problem, start=again)]
    assert len(rest) == len(states) - 3
    for a, b in zip(rest, states[3:], strict=True):
        x, y = a.arrays(), b.arrays()
        assert list(x) == list(y)
        assert all(x[k].tobytes() == y[k].tobytes() for k in x)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"normal": (0.0, -1.0)}, "normal has 2 components, and 'space: solid' has 3: write"),
        ({"element": "q4"}, "'q4' is an element of the plane"),
        ({"remesh": "auto"}, "'remesh' is not available in space yet"),
        ({"thickness": 2.0}, "no thickness"),
        ({"top": np.array([[0, 1, 2, 5]])}, "no face on the outside"),
    ],
)
def test_what_is_not_there_in_space_yet_is_refused(change, words):
    """Turning planes, loads, elements of the plane, faces inside are named."""
    X, cells, top = bricks((2, 1, 1), (1.0, 1.0, 1.0))
    given = {
        "top": top, "at": (0.0, 1.0, 0.0), "normal": (0.0, -1.0, 0.0), "supports": {}, "steps": (("press", {"y": -0.1}),),
    } | change  # fmt: skip
    with pytest.raises(PrensaError, match=words):
        pr.discretise(under_plane(X, cells, SWIFT, **given))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"bodies": {"b": pr.Body(pr.Box((1.0, 1.0, 1.0), (1, 1, 1)), SWIFT)}}, "bricks need 'space: solid'"),
        ({"fixed": {"b.bottom": pr.Fixed(z="held")}}, "'z' is an axis of 'space: solid'"),
        (
            {"tools": {"t": pr.Plane(normal=(0.0, -1.0, 0.0), at=(0.0, 1.0, 0.0))}},
            "at has 3 components, and 'space: plane strain' has 2: write",
        ),
    ],
)
def test_what_is_of_space_is_refused_in_the_plane(change, words):
    """Bricks, supports along z and places in space."""
    given = {
        "bodies": {"b": pr.Body(pr.Rectangle((1.0, 1.0), (1, 1)), SWIFT)}, "tools": {"t": pr.Plane(touching="b.top")},
        "steps": (pr.Step("press"),),
    } | change  # fmt: skip
    with pytest.raises(PrensaError, match=words):
        pr.Problem("plane", **given)


def test_a_box_is_graded_towards_a_place():
    """Sizes of a box shrink towards a corner; sides are those across the axes, seen from outside."""
    from prensa.mesh.generate import mesh_of

    mesh = mesh_of(pr.Box((2.0, 1.0, 3.0), (4, 2, 5), origin=(1.0, 0.0, 0.0), toward=(1.0, 1.0, 0.0), ratio=4.0), 8)
    x = np.unique(mesh.points[:, 0])
    assert (x[0], x[-1]) == (1.0, 3.0)
    assert (np.diff(np.diff(x)) > 0).all()
    assert {name: len(faces) for name, faces in mesh.edges.items()} == {
        "left": 10, "right": 10, "bottom": 20, "top": 20, "back": 8, "front": 8,
    }  # fmt: skip
    for name, axis, sign in (
        ("left", 0, -1),
        ("right", 0, 1),
        ("bottom", 1, -1),
        ("top", 1, 1),
        ("back", 2, -1),
        ("front", 2, 1),
    ):
        a, b, c, d = mesh.points[mesh.edges[name].T]
        assert (sign * np.cross(c - a, d - b)[:, axis] > 0).all()


FILE = """
name: bricks
space: solid
bodies:
  b:
    mesh: {type: box, size: [1, 1, 1], n: [2, 2, 2]}
    material: {type: elastic, E: 1000, nu: 0.3}
tools:
  t: {type: plane, normal: [0, -1, 0], at: [0, 1, 0]}
contacts:
  - {surface: b.top, against: t}
fixed:
  b.bottom: {x: held, y: held}
steps:
  - name: press
    move: {t: {y: -0.1}}
"""


def test_a_case_file_says_what_python_says():
    """The same problem read from a file, with supports along z in short; in the plane z is named as an axis of space."""
    from prensa.model.schema import loads

    text = FILE.replace("{x: held, y: held}", "xyz").replace("y: -0.1}}", "y: -0.1, z: 0.05}}")
    p = loads(text, "bricks.yaml").problem
    assert p.fixed["b.bottom"] == pr.Fixed("held", "held", z="held")
    assert p.steps[0].move["t"] == pr.Motion(y=-0.1, z=0.05)
    assert pr.discretise(p).dofs.dimension == 3
    plane = text.replace("space: solid", "space: plane strain")
    plane = plane.replace("box, size: [1, 1, 1], n: [2, 2, 2]", "rectangle, size: [1, 1], n: [2, 2]")
    with pytest.raises(pr.CaseError) as caught:
        loads(plane.replace("normal: [0, -1, 0], at: [0, 1, 0]", "touching: b.top"), "bricks.yaml")
    said = [line.partition(": ")[::2] for line in str(caught.value).splitlines()]
    assert [place for place, _ in said] == ["bricks.yaml:13:13", "bricks.yaml:16:25"]
    assert all("'z' is an axis of 'space: solid'" in words for _, words in said)
