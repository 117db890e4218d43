"""Rigid motions of bodies in space that nothing resists, named before a run with the support that is missing."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.preflight import preflight
from prensa.linear.motions_in_words import in_words
from prensa.model.plausibility import warnings_of
from prensa.system.discretise import discretise

ELASTIC = pr.Elastic(1000.0, 0.3)
BOX = pr.Box((4.0, 2.0, 3.0), (2, 1, 2))
QUARTER = pr.Revolution(pr.Rectangle((2.0, 3.0), (1, 1), (4.0, 0.0)), 3, angle=np.pi / 2)


def found(fixed, mesh=BOX, friction=None, **more):
    """What is said of a body under a plane with the given supports."""
    problem = pr.Problem(
        "p", space="solid", bodies={"b": pr.Body(mesh, ELASTIC)}, fixed=fixed, friction=friction,
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),),
        steps=(pr.Step("press", move={"t": pr.Motion(y=-0.1)}),), **more,
    )  # fmt: skip
    return [f for f in preflight(discretise(problem)) if f.path.startswith("bodies")]


@pytest.mark.parametrize(
    ("fixed", "words"),
    [
        ({"b.bottom": "y"}, "free to move along x and z and to turn about y through (2, 1, 1.5)"),
        ({"b.bottom": "y", "b.left": "x"}, "free to move along z:"),
        ({"b.bottom": "y", "b.left": "xz"}, ""),
        ({"b.bottom": "xyz"}, ""),
        ({"b.bottom": "y", "b.left": "x", "b.back": "z"}, ""),
    ],
)
def test_what_a_box_may_do_is_named(fixed, words):
    """With a side that would hold it; nothing is said of one that is held."""
    findings = found(fixed)
    assert [f.fatal for f in findings] == [True] * bool(words)
    if words:
        assert words in findings[0].message
        assert "hold it there with 'fixed', like 'b." in findings[0].message


def test_the_missing_plane_of_symmetry_is_named():
    """Of a quarter of a tube the one that is left out, by its side and axis."""
    assert found({"b.bottom": "y", "b.base": "z", "b.cap": "x"}, QUARTER) == []
    (missing,) = found({"b.bottom": "y", "b.base": "z"}, QUARTER)
    remedy = "no support and no contact resists; hold it there with 'fixed', like 'b.cap: x'"
    assert f"free to move along x: {remedy}" in missing.message


def test_friction_holds_once_the_tool_touches():
    """A block on friction alone: nothing is free while the tool touches, and that is said where it does not yet."""
    assert found({"b.bottom": "y"}, friction=pr.Coulomb(0.1)) == []


def moving(centre, turns=(), slides=()):
    """Motions (k, 6) of turns about lines (place, direction), and of slides along directions, in a random basis."""
    rows = [np.concatenate([np.cross(direction, np.subtract(centre, place)), direction]) for place, direction in turns]
    rows += [np.concatenate([direction, np.zeros(3)]) for direction in slides]
    basis = np.linalg.qr(np.random.default_rng(1).normal(size=(len(rows),) * 2))[0]
    return basis @ np.array(rows, dtype=float)


@pytest.mark.parametrize(
    ("motions", "words"),
    [
        ({"slides": [(0, 0, 1)]}, "move along z"),
        ({"slides": [(0, 0, 1), (1, 0, 0)]}, "move along x and z"),
        ({"slides": [(1, 1, 0)]}, "move along (0.707, 0.707, 0)"),
        ({"turns": [((1, 2, 0), (0, 0, 1))]}, "turn about z through (1, 2, 3)"),
        ({"turns": [((5, 0, 7), (0, 1, 0))], "slides": [(0, 1, 0)]}, "move along y and to turn about y through (5, 2, 7)"),
        ({"turns": [((0, 0, 0), (0, 0, 1)), ((0, 0, 0), (1, 0, 0))]}, "turn about x and z"),
        (
            {"turns": [((0, 0, 0), e) for e in np.eye(3)], "slides": list(np.eye(3))},
            "move along x, y and z and to turn about x, y and z",
        ),
    ],
)
def test_motions_are_put_in_words(motions, words):
    """Whatever the basis that the null space came in."""
    centre = np.array([1.0, 2.0, 3.0])
    assert in_words(moving(centre, **motions), centre, 1.0) == words


def test_a_body_that_a_tool_pushes_away_is_named():
    """Nothing stands under it: the direction in which it goes, with friction and without; nothing is said of one that is held."""
    for friction, held in ((None, {"b.left": "x", "b.back": "z"}), (pr.Coulomb(0.2), {})):
        (found_,) = found(held, friction=friction)
        assert found_.fatal
        assert "free to move along -y, away from the tools of step 'press'" in found_.message
    assert found({"b.left": "x", "b.back": "z", "b.bottom": "y"}) == []


def test_mistakes_in_curves_and_tables_are_found_in_space():
    """A flow curve in other units than the modulus, and a table that ends before its step."""

    def problem(flow):
        return pr.Problem(
            "p", space="solid", bodies={"b": pr.Body(BOX, pr.J2(200.0, 0.3, flow))},
            fixed={"b.bottom": "xyz"}, steps=(pr.Step("s", by={"b.top": pr.Motion(y=((0.0, 0.0), (0.5, -0.1)))}),),
        )  # fmt: skip

    said = {f.path: f.message for f in preflight(discretise(problem(pr.Linear(s0=5.0, H=500.0))))}
    assert "faster than E = 200" in said["bodies.b.material.flow"]
    # A flow stress in another unit is said once: its slope follows of it.
    other = problem(pr.Swift(K=500.0, e0=0.01, n=0.2))
    assert [w for w in warnings_of(other) if "'200 GPa'" in w]
    assert "bodies.b.material.flow" not in {f.path for f in preflight(discretise(other))}
    assert any("held at -0.1" in words for words in said.values())
