"""What supports hold in all steps, against the unknowns that the solver is left with in each."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.sparse import identity

import prensa as pr
from prensa.system.held import held, held_along, symmetric, symmetry_planes
from prensa.system.moments import stages
from prensa.system.system import System

SOFT = pr.Elastic(1000.0, 0.3)
ON = pr.Step("on")


def box(size: tuple[float, ...], n: tuple[int, ...], **more: Any) -> pr.Body:
    return pr.Body((pr.Box if len(size) == 3 else pr.Rectangle)(size, n, **more), SOFT)


def tied(d: int, fine: int, **fixed: str) -> pr.Problem:
    """Two bodies one above the other, the upper one ``fine`` times as fine."""
    bodies = {
        "a": box((2.0, 1.0, 2.0)[:d], (2, 1, 2)[:d]),
        "b": box((2.0, 1.0, 2.0)[:d], (2 * fine, 2, 2 * fine)[:d], origin=(0.0, 1.0, 0.0)[:d]),
    }
    given = {name.replace("_", "."): held for name, held in fixed.items()}
    space = {"space": "solid"} if d == 3 else {}
    return pr.Problem("tied", bodies, (ON,), ties=(pr.Tie("b.bottom", "a.top"),), fixed=given, **space)


def sector(*steps: pr.Step, turned: float = 20.0, **fixed: Any) -> pr.Problem:
    """A sector of 50° whose two sides are inclined, down to the axis."""
    body = pr.Body(pr.Cylinder(2.0, 1.0, (2, 2, 2), angle=math.radians(50.0)), SOFT)
    mesh = pr.discretise(pr.Problem("m", {"b": body}, (ON,), space="solid", fixed={"b.bottom": "xyz"})).meshes["b"]
    c, s = math.cos(math.radians(turned)), math.sin(math.radians(turned))
    X = mesh.points @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    sides = {name: tuple(mesh.nodes(name, name).tolist()) for name in ("base", "cap", "bottom", "top")}
    bricks = pr.Bricks(tuple(map(tuple, X.tolist())), tuple(map(tuple, mesh.cells.tolist())), sides)
    given = {"b.base": "normal", "b.cap": "normal", "b.bottom": "y"} | {k.replace("_", "."): v for k, v in fixed.items()}
    return pr.Problem("sector", {"b": pr.Body(bricks, SOFT)}, steps or (ON,), space="solid", fixed=given)


def block(d: int, *steps: pr.Step, **fixed: Any) -> pr.Problem:
    given = {f"b.{name}": how for name, how in fixed.items()}
    space = {"space": "solid"} if d == 3 else {}
    return pr.Problem("block", {"b": box((2.0, 2.0, 2.0)[:d], (2, 2, 2)[:d])}, steps or (ON,), fixed=given, **space)


PROBLEMS = {
    "block": block(3, left="x", bottom="y", back="z"),
    "plane": block(
        2, pr.Step("one", by={"b.top": pr.Motion(y=-0.1)}), pr.Step("two", fixed={"b.top": "free"}), left="x", bottom="xy",
    ),
    "released beside": block(
        3, pr.Step("pull", by={"b.left": pr.Motion(x=0.1, y=0.0)}), pr.Step("off", fixed={"b.left": "free"}), bottom="y",
        back="z",
    ),
    "moved": block(3, pr.Step("one"), pr.Step("two", fixed={"b.left": {"x": 0.1}}), left="x", bottom={"y": 0.0}),
    "one node for two": tied(3, 1, a_bottom="y", a_left="x"),
    "led by others": tied(3, 2, a_top="y", b_left="x"),
    "led by others in the plane": tied(2, 2, a_top="y", b_left="x"),
    "all of it": tied(3, 1, a_bottom="xyz", a_top="xyz", b_top="xyz", b_left="xyz", b_right="xyz"),
    "sector": sector(),
    "sector, moved where sides meet": sector(pr.Step("one", fixed={"b.top": {"x": 0.1, "z": 0.2}})),
}  # fmt: skip


def left_free(system: System, body: str, normal: np.ndarray) -> np.ndarray:
    """Nodes (n,) of a body of which the solver's unknowns, or what it prescribes, move some along a normal in some step."""
    d, out = system.dofs.dimension, np.zeros(len(system.meshes[body].points), dtype=bool)
    for stage in stages(system):
        fixed = stage.plan.fixed
        if system.ties is None:
            T = identity(system.ndof, format="csr")[:, np.setdiff1d(np.arange(system.ndof), fixed)]
        else:
            T = system.ties.free(system.ndof, fixed)
        u = stage.end if system.ties is None else system.ties.with_slaves(stage.end)
        for k, node in enumerate(system.nodes_of(body).tolist()):
            rows = system.dofs.displacement.dofs(node)
            out[k] |= np.abs(normal @ T[rows].toarray()).max(initial=0.0) > 1e-9 or abs(normal @ u[rows][:d]) > 1e-9
    return out


@pytest.mark.parametrize("name", PROBLEMS)
def test_what_is_held_is_what_the_solver_has_no_unknown_for(name: str) -> None:
    """Along the axes, and along the normals of inclined sides and others."""
    system = pr.discretise(PROBLEMS[name])
    d = system.dofs.dimension
    some = np.random.default_rng(3).normal(size=(3, d))
    for body in system.meshes:
        ways = held(system, body).ways
        for way in (*ways, *(some / np.linalg.norm(some, axis=1)[:, None])):
            np.testing.assert_array_equal(held_along(system, body, way), ~left_free(system, body, way))


def test_a_side_beside_one_that_is_released_stays_a_plane() -> None:
    """What they have in common is held by both."""
    system = pr.discretise(PROBLEMS["released beside"])
    assert [str(p) for p in symmetry_planes(system, "b")] == ["y = 0", "z = 0"]
    mesh = system.meshes["b"]
    assert symmetric(system, "b", mesh.edges["bottom"]).all() and not symmetric(system, "b", mesh.edges["left"]).any()


def test_what_a_tie_leads_is_a_plane_too() -> None:
    """The side of a body that has nodes in common with, or follows, one that is held."""
    for name in ("led by others", "led by others in the plane"):
        system = pr.discretise(PROBLEMS[name])
        assert symmetric(system, "b", system.meshes["b"].edges["bottom"]).all()


def test_sides_of_a_sector_are_planes() -> None:
    """Their edge on the axis is held across it; what is moved there is no reason against."""
    system = pr.discretise(sector())
    planes = symmetry_planes(system, "b")
    assert [p.axis for p in planes].count(None) == 2 and len(planes) == 3
    axis = np.hypot(*system.X[:, [0, 2]].T) < 1e-9
    assert axis.any() and held(system, "b").flags[axis][:, [0, 2]].all()


def test_an_outline_without_its_held_sides_is_that_of_the_system() -> None:
    """Contacts with a whole outline are found before there is a system, with the same answer."""
    problem = pr.Problem(
        "touched", {"b": box((2.0, 2.0), (2, 2))}, (pr.Step("one", fixed={"b.left": "x"}),), fixed={"b.bottom": "y"},
        tools={"t": pr.Plane(touching="b.top")},
    )  # fmt: skip
    system = pr.discretise(problem)
    mesh, (s,) = system.meshes["b"], system.tool_contacts
    left = mesh.boundary[~symmetric(system, "b", mesh.boundary)]
    assert set(s.points.nodes.tolist()) == set(np.unique(left).tolist()) and len(left) == 4
