"""Identities in space: F-bar of plane and space, a layer of a wedge, mirror images, other numbers, turned models, rigid turns."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from blocks_of_bricks import bricks, tetrahedra
from prensa.contact.pairing import rotation
from prensa.study.order import observed

STEEL = pr.J2(200000.0, 0.3, pr.Swift(K=500.0, e0=0.01, n=0.2))
RUBBER = pr.NeoHooke(1000.0, 0.45)
TIGHT = pr.Numerics(tolerance=1e-11)


# ------------------------------------------------------------------------------------------------------------------- F-bar
def of_rubber(n, solid, loaded):
    """A quarter of a block of rubber 8 × 4, 2n × n elements with F-bar, in plane strain or as one layer of bricks."""
    section = pr.Rectangle((8.0, 4.0), (2 * n, n))
    body = pr.Body(pr.Extrusion(section, 1.0, 1) if solid else section, RUBBER, "h8_fbar" if solid else "q4_fbar")
    sides = {"b.base": "z", "b.cap": "z"} if solid else {}
    return pr.Problem(
        "rubber", space="solid" if solid else "plane strain", bodies={"b": body},
        fixed={"b.bottom": "y", "b.left": "x"} | sides, **loaded(solid),
    )  # fmt: skip


def stuck_to_a_plate(solid):
    """Under a plate that sticks to it: its edge is singular."""
    return {
        "tools": {"t": pr.Plane(touching="b.top")}, "contacts": (pr.Contact("b.top", "t"),), "friction": pr.Coulomb(1.9),
        "steps": (pr.Step("press", move={"t": pr.Motion(y=-0.4)}, increments=4),),
    }  # fmt: skip


def under_its_weight(solid):
    """Nothing is singular."""
    return {"body_force": {"b": (0.0, -20.0, 0.0) if solid else (0.0, -20.0)}, "steps": (pr.Step("weigh", increments=2),)}


@pytest.mark.parametrize(
    ("loaded", "order", "largest"), [(stuck_to_a_plate, 1.0, 1e-3), (under_its_weight, 2.0, 1e-4)], ids=["edge", "smooth"],
)  # fmt: skip
def test_f_bar_of_plane_and_space_come_together(loaded, order, largest):
    """The plane scales two directions, bricks three: energies and forces differ, with the order that the solution allows."""
    meshes, differences = (4, 8, 16), []
    for n in meshes:
        (*_, flat), (*_, solid) = (pr.solve(of_rubber(n, s, loaded), TIGHT) for s in (False, True))
        ours = [i.force("t").y if i.tools else i.energy["elastic"] for i in (flat, solid)]
        differences.append(ours[1] / ours[0] - 1.0)
    assert 1e-7 < abs(differences[-1]) < largest
    found = np.log2(np.divide(differences[:-1], differences[1:]))
    assert found == pytest.approx([order, order], abs=0.2)


# ------------------------------------------------------------------------------------------------------- one layer of a wedge
def ring(angle):
    """A ring upset with friction: axisymmetric for the angle 0, else one layer of bricks between planes of symmetry."""
    section = pr.Rectangle((3.0, 2.0), (3, 3), origin=(3.0, 0.0))
    mesh = pr.Revolution(section, 1, angle=angle) if angle else section
    return pr.Problem(
        "ring", space="solid" if angle else "axisymmetric", bodies={"b": pr.Body(mesh, STEEL)}, friction=pr.Coulomb(0.1),
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "y"} | ({"b.base": "normal", "b.cap": "normal"} if angle else {}),
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.3)}, increments=3),),
    )  # fmt: skip


def test_one_layer_of_a_wedge_is_axisymmetric_at_order_two_in_its_angle():
    """Force and works of 15°, 7.5° and 3.75°, of the whole ring, plastic and with friction."""
    def of_whole(angle):
        *_, last = pr.solve(ring(angle), TIGHT)
        share = 2.0 * np.pi / angle if angle else 1.0
        return share * np.array([last.force("t").y, last.energy["plastic"], last.energy["friction"]])

    exact = of_whole(0.0)
    angles = np.radians([15.0, 7.5, 3.75])
    found = np.array([of_whole(a) for a in angles])
    errors = found / exact - 1.0
    assert np.abs(errors[-1]).max() < 2e-3
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(np.full((2, 3), 2.0), abs=0.1)
    for k in range(3):
        assert observed(angles, found[:, k]).limit == pytest.approx(exact[k], rel=1e-4)


# ------------------------------------------------------------------------------------------------------------ mirror images
def mirrored(whole):
    """A block on a rough base under a ball: a quarter of it, or all."""
    size, n, at = ((4.0, 2.0, 3.0), (4, 2, 4), (-2.0, 0.0, -1.5)) if whole else ((2.0, 2.0, 1.5), (2, 2, 2), (0.0, 0.0, 0.0))
    return pr.Problem(
        "block", space="solid", bodies={"b": pr.Body(pr.Box(size, n, at), STEEL)}, friction=pr.Coulomb(0.2),
        tools={"t": pr.Sphere(6.0, at=(0.0, 8.0, 0.0))}, contacts=(pr.Contact("b.top", "t"),),
        fixed={"b.bottom": "xyz"} | ({} if whole else {"b.left": "x", "b.back": "z"}),
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.3)}, increments=3),),
    )  # fmt: skip


def test_a_quarter_is_a_quarter_of_the_whole():
    """Force and energies four times those of a quarter, to 1e-9, and no force or moment across."""
    (*_, quarter), (*_, whole) = (pr.solve(mirrored(w), TIGHT) for w in (False, True))
    f = whole.force("t")
    assert 4.0 * quarter.force("t").y == pytest.approx(f.y, rel=1e-9)
    assert np.abs([f.x, f.z, f.mx, f.my, f.mz]).max() < 1e-9 * abs(f.y)
    for name in ("elastic", "plastic", "friction"):
        assert 4.0 * quarter.energy[name] == pytest.approx(whole.energy[name], rel=1e-9)
    assert whole.energy["plastic"] > 0.0 and whole.energy["friction"] > 0.0


# ------------------------------------------------------------------------------------------------------------ other numbers
TURNS_OF_A_BRICK = (
    (0, 1, 2, 3, 4, 5, 6, 7), (1, 2, 3, 0, 5, 6, 7, 4), (3, 2, 6, 7, 0, 1, 5, 4), (4, 7, 6, 5, 0, 3, 2, 1),
    (1, 5, 6, 2, 0, 4, 7, 3),
)  # fmt: skip
"""Orders in which a right-handed brick lists its nodes: as it is, and turned about each of its axes."""
TURNS_OF_A_TETRAHEDRON = ((0, 1, 2, 3, 4, 5, 6, 7, 8, 9), (1, 2, 0, 3, 5, 6, 4, 8, 9, 7), (2, 0, 1, 3, 6, 4, 5, 9, 7, 8))
"""The same of a tetrahedron, turned about its fourth corner."""


def renumbered(element, seed):
    """A skew block under a slanted plane that slides with friction; nodes, elements and each element's nodes in another order."""
    if element == "t10":
        make, kind, turns, n = tetrahedra, pr.Tetrahedra, TURNS_OF_A_TETRAHEDRON, (2, 2, 2)
    else:
        make, kind, turns, n = bricks, pr.Bricks, TURNS_OF_A_BRICK, (3, 2, 3)
    X, cells, _ = make(n, (4.0, 3.0, 4.0), skew=0.1)
    sides = {"bottom": np.flatnonzero(X[:, 1] < 1e-9), "top": np.flatnonzero(X[:, 1] > 3.0 - 1e-9)}
    if seed is not None:
        rng = np.random.default_rng(seed)
        new = rng.permutation(len(X))
        X, cells = X[np.argsort(new)], new[cells[rng.permutation(len(cells))]]
        cells = np.array([c[list(turns[rng.integers(len(turns))])] for c in cells])
        sides = {name: rng.permutation(new[nodes]) for name, nodes in sides.items()}
    named = {name: tuple(nodes.tolist()) for name, nodes in sides.items()}
    mesh = kind(tuple(map(tuple, X.tolist())), tuple(map(tuple, cells.tolist())), named)
    return pr.Problem(
        "numbers", space="solid", bodies={"b": pr.Body(mesh, STEEL, element)}, friction=pr.Coulomb(0.2),
        tools={"t": pr.Plane(normal=(0.1, -1.0, 0.05), at=(4.0, 3.3, 0.0))},
        contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
        steps=(
            pr.Step("press", move={"t": pr.Motion(y=-0.6)}, increments=3),
            pr.Step("slide", by={"t": pr.Motion(x=0.2, z=-0.1)}, increments=2),
        ),
    )  # fmt: skip


@pytest.mark.parametrize("element", ["h8", "h8_fbar", "h8_enhanced", "t10"])
def test_numbers_of_nodes_and_elements_do_not_matter(element):
    """Forces, moments, energies and the largest stress to 1e-9 of the largest, at every increment."""
    runs = []
    for seed in (None, 1, 2):
        increments = list(pr.solve(renumbered(element, seed), TIGHT))
        runs.append(np.array([
            (*i.force("t"), *(i.energy[name] for name in ("elastic", "plastic", "friction")), i.bodies["b"].mises.max())
            for i in increments
        ]))  # fmt: skip
    plain = runs[0]
    assert plain[-1, 0] ** 2 + plain[-1, 2] ** 2 > (0.1 * plain[-1, 1]) ** 2  # it slides
    for other in runs[1:]:
        assert other.shape == plain.shape
        assert np.abs((other - plain) / np.abs(plain).max(axis=0)).max() < 1e-9


# ------------------------------------------------------------------------------------------------------------ models turned
def turned(element, tool, turn, way):
    """A skew block, pressed, twisted and dragged by a tool; all of it turned by the matrix ``turn`` and moved by ``way`` (3,)."""
    if element == "t10":
        (X, cells, _), kind = tetrahedra((2, 2, 2), (4.0, 3.0, 4.0), skew=0.1), pr.Tetrahedra
    else:
        (X, cells, _), kind = bricks((3, 2, 3), (4.0, 3.0, 4.0), skew=0.1), pr.Bricks
    sides = {"bottom": np.flatnonzero(X[:, 1] < 1e-9), "top": np.flatnonzero(X[:, 1] > 3.0 - 1e-9)}
    named = {name: tuple(nodes.tolist()) for name, nodes in sides.items()}

    def along(*v):
        return tuple((turn @ np.array(v)).tolist())

    def at(*x):
        return tuple((turn @ np.array(x) + way).tolist())

    def motion(by, about):
        return pr.Motion(**dict(zip("xyz", along(*by))), **dict(zip(("rx", "ry", "rz"), along(*about))))

    tools = {
        "plane": pr.Plane(normal=along(0.1, -1.0, 0.05), at=at(4.0, 3.4, 0.0)),
        "torus": pr.Revolved(pr.Circle(1.5, at=(1.0, 0.0)), axis=along(0.0, 1.0, 0.0), at=at(2.0, 4.55, 2.0)),
        "sphere": pr.Sphere(6.0, at=at(2.0, 9.0, 2.0)),
    }
    mesh = kind(tuple(map(tuple, (X @ turn.T + way).tolist())), tuple(map(tuple, cells.tolist())), named)
    return pr.Problem(
        "turned", space="solid", bodies={"b": pr.Body(mesh, STEEL, element)}, friction=pr.Coulomb(0.2),
        tools={"t": tools[tool]}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
        steps=(
            pr.Step("press", move={"t": motion((0.05, -0.3, 0.02), (0.0, 0.03, 0.0))}, increments=6),
            pr.Step("drag", by={"t": motion((0.1, 0.0, -0.05), (0.0, 0.03, 0.0))}, increments=2),
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("element", "tool"), [("h8", "plane"), ("h8_fbar", "torus"), ("h8_enhanced", "sphere"), ("t10", "plane")]
)
def test_a_model_turned_and_moved_has_the_same_answer(element, tool):
    """Forces and moments turn along; they, energies and the largest stress to 1e-9 of the largest, at every increment."""
    rng, runs = np.random.default_rng(7), []
    for k in range(3):
        turn = rotation(1.3 * rng.normal(size=3)) if k else np.eye(3)
        way = 5.0 * rng.normal(size=3) if k else np.zeros(3)
        runs.append(np.array([
            np.concatenate([
                (np.reshape(i.force("t"), (2, 3)) @ turn).ravel(),
                [*(i.energy[name] for name in ("elastic", "plastic", "friction")), i.bodies["b"].mises.max()],
            ])
            for i in pr.solve(turned(element, tool, turn, way), TIGHT)
        ]))  # fmt: skip
    plain = runs[0]
    assert plain[-1, 8] > 0.0  # it slides
    for other in runs[1:]:
        assert other.shape == plain.shape
        assert np.abs((other - plain) / np.abs(plain).max(axis=0)).max() < 1e-9


# -------------------------------------------------------------------------------------------------------------- rigid turns
def test_a_body_and_a_tool_turned_together_by_a_whole_turn_have_no_stress():
    """About an oblique axis, 360° in 24 increments: bottom and tool are turned, the rest of the body follows; no slip."""
    X, cells, _ = bricks((2, 2, 2), (2.0, 1.0, 2.0), skew=0.1)
    axis, part = np.array([0.6, 0.48, 0.64]), np.pi / 12.0
    places = [X @ rotation(k * part * axis).T - X for k in range(25)]
    low = np.flatnonzero(X[:, 1] == 0.0)
    sides = {f"n{k}": (int(k),) for k in low} | {"top": tuple(np.flatnonzero(X[:, 1] == 1.0).tolist())}
    mesh = pr.Bricks(tuple(map(tuple, X.tolist())), tuple(map(tuple, cells.tolist())), sides)
    steps = [
        pr.Step(
            f"turn {k}", increments=1, by={"t": pr.Motion(**dict(zip(("rx", "ry", "rz"), (part * axis).tolist())))},
            fixed={f"b.n{i}": pr.Fixed(**dict(zip("xyz", places[k][i].tolist()))) for i in low},
        )
        for k in range(1, 25)
    ]  # fmt: skip
    problem = pr.Problem(
        "turned", space="solid", bodies={"b": pr.Body(mesh, RUBBER)}, friction=pr.Coulomb(0.3),
        tools={"t": pr.Extruded(pr.Profile(points=((-10.0, 1.0), (10.0, 1.0))), at=(0.0, 0.0, 0.0))},
        contacts=(pr.Contact("b.top", "t"),), fixed={}, steps=tuple(steps),
    )  # fmt: skip
    increments = list(pr.solve(problem, TIGHT))
    assert len(increments) == 24
    for k, inc in enumerate(increments, 1):
        assert np.allclose(inc.bodies["b"].x, X + places[k], atol=1e-9)
        assert inc.bodies["b"].mises.max() < 1e-9 * RUBBER.E
        assert np.abs(inc.force("t")).max() < 1e-9 * RUBBER.E
        (contact,) = inc.contacts.values()
        assert np.abs(contact.slip).max() < 1e-9
        assert np.abs(contact.gap).max() < 1e-9
        assert inc.energy["elastic"] < 1e-12
        assert inc.energy["friction"] == pytest.approx(0.0, abs=1e-12)
