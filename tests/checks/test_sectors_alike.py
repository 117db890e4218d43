"""Figures of upsets and extrusions: a sector held along its normals has those of a quarter held along axes, and of the whole."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.extrusions import extruded, spread
from prensa.checks.before.far_upsets import far_upsets, sheared, upset
from prensa.checks.before.pressed_by_force import largest_force, strain_of_force
from prensa.system.system import System

STEEL = pr.J2(210e3, 0.3, pr.Swift(600.0, 0.01, 0.2))
ANGLES = {"whole": 360.0, "quarter": 90.0, "quarter by its normal": 90.0, "sixth": 60.0}


def part(which: str, bore: float | None = 4.0, **more: Any) -> System:
    """A disc, or a ring, that two plates press together: the whole of it, or a sector."""
    angle = ANGLES[which]
    mesh = pr.Cylinder(10.0, 8.0, (3, 3, round(angle / 15.0)), bore=bore, angle=math.radians(angle)) if bore else pr.Cylinder(
        10.0, 8.0, (3, 3, round(angle / 15.0)), angle=math.radians(angle))  # fmt: skip
    fixed: dict[str, Any] = {"b.bottom": "y"}
    if which != "whole":
        fixed |= {"b.base": "z", "b.cap": "x" if which == "quarter" else "normal"}
    given: dict[str, Any] = {
        "bodies": {"b": pr.Body(mesh, STEEL)}, "tools": {"t": pr.Plane(touching="b.top")}, "fixed": fixed,
        "contacts": (pr.Contact("b.top", "t", friction=pr.Coulomb(0.3)),), "space": "solid",
        "steps": (pr.Step("press", by={"t": pr.Motion(y=-6.5)}),),
    }  # fmt: skip
    return pr.discretise(pr.Problem(which, **(given | more)))


PARTS = [which for which in ANGLES if which != "whole"]


@pytest.mark.parametrize("bore", [None, 4.0])
@pytest.mark.parametrize("which", PARTS)
def test_an_upset_is_that_of_the_whole(which: str, bore: float | None) -> None:
    """Its shear too, and the finding of it."""
    whole, one = part("whole", bore), part(which, bore)
    a, b = upset(whole, "b"), upset(one, "b")
    assert a is not None and b is not None
    assert (b.height, b.left, b.held_by) == (pytest.approx(a.height), pytest.approx(a.left), a.held_by)
    assert sheared(one, "b", b) == pytest.approx(sheared(whole, "b", a), rel=1e-9) and sheared(one, "b", b) > 1.0
    assert [str(f) for f in far_upsets(one)] == [str(f) for f in far_upsets(whole)] != []


@pytest.mark.parametrize("which", PARTS)
def test_distances_from_what_does_not_move_are_those_of_the_whole(which: str) -> None:
    """Radii, of all three."""
    made = spread(part(which), "b", np.array([0.0, 1.0, 0.0]))
    X = part(which).meshes["b"].points
    assert len(made.ways) == 2
    np.testing.assert_allclose(made.distances, np.hypot(X[:, 0], X[:, 2]), rtol=0, atol=1e-9)


@pytest.mark.parametrize("which", PARTS)
def test_a_share_of_the_force_presses_a_part_as_far(which: str) -> None:
    """Friction as far out on the mean."""
    def pushed(one: str) -> float:
        force = -2e5 * ANGLES[one] / 360.0
        system, y = part(one, steps=(pr.Step("push", push={"t": pr.Push(y=force)}),)), np.array([0.0, 1.0, 0.0])
        most = largest_force(system.problem.steps, "t", y)
        assert most == -force
        return strain_of_force(system, system.tool_contacts[0], y, most)

    assert pushed(which) == pytest.approx(pushed("whole"), rel=1e-6) and pushed("whole") > 0.1


@pytest.mark.parametrize("which", PARTS)
def test_an_extrusion_is_that_of_the_whole(which: str) -> None:
    """A billet that is pushed through a steep die."""
    opening = 5.0 * math.sqrt(0.5)
    profile = ((5.0, 20.0), (5.0, 0.0), (opening, (opening - 5.0) / math.tan(math.radians(40.0))), (opening, -20.0))
    die = pr.Revolved(section=pr.Profile(points=profile, fillet=(0.0, 0.3, 0.3, 0.0)), at=(0.0, -0.3, 0.0))
    contacts = (pr.Contact("b.top", "t"), pr.Contact(("b.outer", "b.bottom"), "die", pr.Coulomb(0.05)))

    def said(one: str) -> list[str]:
        billet = pr.Cylinder(5.0, 8.0, (4, 8, round(ANGLES[one] / 15.0)), angle=math.radians(ANGLES[one]))
        held = {k: v for k, v in part(one, None).problem.fixed.items() if k != "b.bottom"}
        return [str(f) for f in extruded(part(
            one, bodies={"b": pr.Body(billet, STEEL)}, tools={"t": pr.Plane(touching="b.top"), "die": die}, contacts=contacts,
            steps=(pr.Step("press", by={"t": pr.Motion(y=-5.0)}),), fixed=held,
        ), "b")]  # fmt: skip

    assert said(which) == said("whole") != []


def test_a_slab_between_inclined_planes_spreads_along_the_other_way() -> None:
    """As one between planes across an axis does: at both ends nothing moves."""
    c, s = np.cos(0.5), np.sin(0.5)
    box = pr.Box((4.0, 2.0, 3.0), (2, 1, 2))
    straight = pr.discretise(pr.Problem("slab", space="solid", bodies={"b": pr.Body(box, STEEL)}, steps=(pr.Step("on"),),
                                        fixed={"b.back": "z", "b.front": "z", "b.bottom": "y"}))  # fmt: skip
    mesh = straight.meshes["b"]
    turned = mesh.points @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    sides = {name: tuple(mesh.nodes(name, name).tolist()) for name in ("back", "front", "bottom")}
    bricks = pr.Bricks(tuple(map(tuple, turned.tolist())), tuple(map(tuple, mesh.cells.tolist())), sides)
    inclined = pr.discretise(pr.Problem("slab", space="solid", bodies={"b": pr.Body(bricks, STEEL)}, steps=(pr.Step("on"),),
                                        fixed={"b.back": "normal", "b.front": "normal", "b.bottom": "y"}))  # fmt: skip
    y = np.array([0.0, 1.0, 0.0])
    a, b = spread(straight, "b", y), spread(inclined, "b", y)
    assert len(a.ways) == len(b.ways) == 1
    np.testing.assert_allclose(np.abs(b.places), np.abs(a.places), rtol=0, atol=1e-9)
