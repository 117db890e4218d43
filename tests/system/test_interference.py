"""Overlaps that are meant: Lamé's pressures of shrink fits, energies, courses over steps, and what is refused."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.checks.before.overlap import overlaps
from prensa.checks.before.starting_places import starting_places
from prensa.checks.before.tied_gaps import tied_gaps
from prensa.errors import PrensaError
from prensa.sensitivity.solve import refuse
from prensa.system.discretise import discretise
from problems import pressed_block

E, NU, DELTA = 200e3, 0.3, 0.005
A, B, C = 4.0, 10.0, 20.0  # bore of a hollow shaft, seat, rim of the hub
QUARTER = (0.0, 0.5 * math.pi)
STEEL = pr.Elastic(E, NU)
ONCE = (pr.Step("fit", increments=1),)


def fit(space: str, drawn: float, n: tuple[int, int], element: str | None = None, **more: Any) -> pr.Problem:
    """A hub on a hollow shaft whose seat has the radius B + ``drawn``, tied; n elements along the seats of shaft and hub."""
    radii, held = {"shaft": (A, B + drawn), "hub": (B, C)}, {"start": "y", "end": "x"}
    meshes: dict[str, Any] = {k: pr.Annulus(*r, (many, 8), angles=QUARTER) for (k, r), many in zip(radii.items(), n)}
    slave, master = "hub.inner", "shaft.outer"
    if space == "axisymmetric":  # a slice, whose ends do not move
        meshes = {k: pr.Rectangle((r[1] - r[0], 2.0), (12, many), (r[0], 0.0)) for (k, r), many in zip(radii.items(), n)}
        held, slave, master = {"bottom": "y", "top": "y"}, "hub.left", "shaft.right"
    fixed = {f"{body}.{side}": axis for body in radii for side, axis in held.items()}
    bodies = {name: pr.Body(mesh, STEEL, element) for name, mesh in meshes.items()}
    tie = pr.Tie(slave, master, more.pop("interference", DELTA))
    given: dict[str, Any] = {"kinematics": "small", "steps": ONCE} | more
    return pr.Problem("fit", space=space, bodies=bodies, ties=[tie], fixed=fixed, **given)


def last(problem: pr.Problem) -> Any:
    *_, increment = pr.solve(problem)
    return increment


def pressures(increment: Any, space: str) -> tuple[float, float]:
    """Pressure on the seat by what the rim of the hub and the bore of the shaft move (Lamé 1852)."""
    stiff = E if space == "plane stress" else E / (1 - NU**2)
    rim, bore = ("right", "left") if space == "axisymmetric" else ("outer", "inner")
    place = "{}.{}.ux at Y=0"
    out, into = increment.measure(place.format("hub", rim)), increment.measure(place.format("shaft", bore))
    return out * stiff * (C**2 - B**2) / (2 * B**2 * C), -into * stiff * (B**2 - A**2) / (2 * B**2 * A)


def lame(space: str, delta: float = DELTA) -> float:
    """Pressure of a shrink fit of a hub on a hollow shaft of one material."""
    stiff = E if space == "plane stress" else E / (1 - NU**2)
    return delta * stiff / (B * ((C**2 + B**2) / (C**2 - B**2) + (B**2 + A**2) / (B**2 - A**2)))


@pytest.mark.parametrize("space", ["plane stress", "plane strain", "axisymmetric"])
@pytest.mark.parametrize(("drawn", "interference"), [(0.0, DELTA), (DELTA, "geometry")])
@pytest.mark.parametrize("n", [(16, 16), (12, 17)])
def test_a_tied_shrink_fit_has_lames_pressure(space, drawn, interference, n):
    """By a length and as drawn, with meshes that match and that do not: within 1 %, and the energy balance closes."""
    increment = last(fit(space, drawn, n, interference=interference))
    assert pressures(increment, space) == pytest.approx([lame(space)] * 2, rel=0.01)
    energy = increment.energy
    assert energy["elastic"] > 0 and abs(energy["imbalance"]) < 1e-3 * energy["elastic"]


@pytest.mark.parametrize("element", ["q8", "t6", "q4_enhanced"])
def test_a_fit_of_other_elements_in_finite_strain(element):
    """Quadratic sides, and displacements that are large enough for finite strain to be another theory."""
    increment = last(fit("plane strain", 0.0, (8, 10), element, kinematics="finite"))
    assert pressures(increment, "plane strain") == pytest.approx([lame("plane strain")] * 2, rel=0.01)


def test_an_overlap_grows_over_the_step_that_is_named():
    """Nothing before it, half of it half way through, and all of it from there on, whatever else happens."""
    steps = [pr.Step(name, increments=2) for name in ("wait", "shrink", "stay")]
    found = [
        pressures(i, "plane strain")[0]
        for i in pr.solve(fit("plane strain", 0.0, (6, 6), steps=steps, interference=pr.Interference(DELTA, "shrink")))
    ]
    assert found[:2] == [0.0, 0.0]
    assert found[2:] == pytest.approx([0.5 * found[3], found[3], found[3], found[3]], rel=1e-9) and found[3] > 0


def ring(space: str, radius: float, interference: Any, **more: Any) -> pr.Problem:
    """A hub on a rigid shaft of some radius."""
    if space == "axisymmetric":
        mesh: Any = pr.Rectangle((C - B, 2.0), (12, 3), (B, 0.0))
        fixed, side = {"hub.bottom": "y", "hub.top": "y"}, "hub.left"
        tool: Any = pr.Plane(normal=(1, 0), at=(radius, 0))
    else:
        mesh = pr.Annulus(B, C, (16, 8), angles=QUARTER)
        fixed, side, tool = {"hub.start": "y", "hub.end": "x"}, "hub.inner", pr.Circle(at=(0, 0), radius=radius)
    contact = pr.Contact(side, "shaft", interference=interference, **more.pop("contact", {}))
    given: dict[str, Any] = {"kinematics": "small", "steps": [pr.Step("fit", increments=2)]} | more
    return pr.Problem(
        "ring", space=space, bodies={"hub": pr.Body(mesh, STEEL)}, tools={"shaft": tool}, contacts=[contact], fixed=fixed, **given
    )


@pytest.mark.parametrize("space", ["plane stress", "plane strain", "axisymmetric"])
@pytest.mark.parametrize(("radius", "interference"), [(B, DELTA), (B + DELTA, "geometry")])
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()])
def test_a_hub_on_a_rigid_shaft_has_lames_pressure(space, radius, interference, enforcement):
    """The seat gives way by the overlap, less what a penalty lets it sink in: u(b) = p b/E' ((c² + b²)/(c² − b²) + ν')."""
    *_, half, whole = pr.solve(ring(space, radius, interference, contact={"enforcement": enforcement}))
    stiff, nu = (E, NU) if space == "plane stress" else (E / (1 - NU**2), NU / (1 - NU))
    exact = DELTA * stiff / (B * ((C**2 + B**2) / (C**2 - B**2) + nu))
    if isinstance(enforcement, pr.Exact):
        assert whole.measure("shaft.mean.pressure") == pytest.approx(exact, rel=0.01)
    else:  # in series with the springs, 1 % of a layer of elements at most
        assert whole.measure("shaft.mean.pressure") == pytest.approx(exact, rel=0.015)
    assert half.measure("shaft.mean.pressure") == pytest.approx(0.5 * whole.measure("shaft.mean.pressure"), rel=2e-3)
    energy = whole.energy
    assert energy["external"] == pytest.approx(energy["elastic"] + energy["contact"], rel=1e-6)
    assert abs(whole.measure("shaft.min.gap")) < 0.02 * DELTA  # of the overlap, not of what is drawn


def test_a_fit_in_finite_strain_with_friction_and_a_tool_that_moves():
    """The overlap stays when the tool slides along the seat afterwards: friction is μ p over the area."""
    steps = [pr.Step("fit", increments=2), pr.Step("slide", move={"shaft": pr.Motion(y=0.4)}, increments=4)]
    problem = ring("axisymmetric", B, pr.Interference(DELTA, "fit"), kinematics="finite", steps=steps, friction=pr.Coulomb(0.1))
    increments = list(pr.solve(problem))
    fitted, slid = increments[1], increments[-1]
    assert slid.measure("shaft.mean.pressure") == pytest.approx(fitted.measure("shaft.mean.pressure"), rel=0.02)
    normal = slid.measure("shaft.mean.pressure") * slid.measure("shaft.area")
    assert abs(slid.measure("shaft.force.y")) == pytest.approx(0.1 * normal, rel=1e-3)
    assert abs(slid.energy["imbalance"]) < 0.02 * slid.energy["external"]


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_an_overlap_at_the_start_is_no_missing_energy(kinematics):
    """Its work is what the bodies store, between nothing and force times overlap, and no more is booked than that."""
    tools = {"t": pr.Plane(normal=(0, -1), at=(0, 1.98))}
    first, *_ = pr.solve(pressed_block(pr.Step("fit", increments=2), tools=tools, kinematics=kinematics))
    energy = first.energy
    assert energy["external"] == pytest.approx(energy["elastic"] + energy["contact"], rel=1e-3)
    assert energy["external"] == pytest.approx(0.5 * first.measure("t.force.y") * 0.02, rel=0.01)
    moved = pressed_block(pr.Step("press", move={"t": pr.Motion(y=-0.02)}, increments=1), tools={"t": pr.Plane(touching="b.top")})
    assert last(moved).energy["external"] == pytest.approx(0.5 * first.measure("t.force.y") * 0.02, rel=0.02)


def test_the_work_of_an_overlap_at_the_start_has_a_derivative():
    """That of the energy balance by closed forms, against a difference of two runs."""
    tools = {"t": pr.Plane(normal=(0, -1), at=(0, 1.98))}
    path, step = "bodies.b.material.E", 0.1

    def run(E: float, **asked: Any) -> Any:
        first, *_ = pr.solve(pressed_block(pr.Step("fit", increments=2), tools=tools, material=pr.Elastic(E, NU)), **asked)
        return first

    found = run(1000.0, derivatives=[path]).derivatives.of(lambda i: i.energy["external"], run(1000.0))
    known = (run(1000.0 + step).energy["external"] - run(1000.0 - step).energy["external"]) / (2 * step)
    assert list(found.values()) == pytest.approx([known], rel=1e-4) and known > 0


def test_an_overlap_that_is_meant_is_no_warning_and_another_says_how_it_is_meant():
    """`geometry` in the contact takes the warning away; without, it says so."""
    tools = {"t": pr.Plane(normal=(0, -1), at=(0, 1.98))}
    problem = pressed_block(pr.Step("fit"), tools=tools)
    found = [f.message for f in starting_places(discretise(problem))]
    assert len(found) == 1 and "if the overlap is meant, say so in contact 'b.top-t': 'interference: geometry'" in found[0]
    meant = replace(problem, contacts=[replace(problem.contacts[0], interference="geometry")])
    assert not list(starting_places(discretise(meant)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("n", [(16, 16), (12, 17), (31, 9)])
def test_gaps_and_overlaps_that_a_tie_takes_away_are_reported_with_size_and_place(sign, n):
    """Of any size above what chords miss of a circle; sides on one circle are no finding, whatever their meshes."""
    found = list(tied_gaps(discretise(fit("plane strain", sign * DELTA, n, interference=None))))
    assert len(found) == 1 and found[0].path == "ties.0" and not found[0].fatal
    kind, size = re.match(r"the sides (overlap|lie apart) by (\S+) mm, most at ", found[0].message).groups()
    assert kind == ("overlap" if sign > 0 else "lie apart") and float(size) == pytest.approx(DELTA, rel=0.01)
    assert not list(tied_gaps(discretise(fit("plane strain", 0.0, n, interference=None))))
    assert not list(tied_gaps(discretise(fit("plane strain", 0.0, n, "q8", interference=None))))


@pytest.mark.parametrize(("drawn", "by"), [(0.0, 1.0), (0.4, "geometry")])
def test_an_overlap_that_is_meant_is_not_reported(drawn, by):
    """Of a tie with interference, however large; that of a third body, drawn into one of the two, is."""
    meant = fit("plane strain", drawn, (8, 8), interference=by)
    assert not list(overlaps(discretise(meant)))
    away = {**meant.bodies, "other": replace(meant.bodies["hub"], mesh=pr.Rectangle((2.0, 2.0), (4, 4), (12.0, 1.0)))}
    assert [(o.first, o.second) for o in overlaps(discretise(replace(meant, bodies=away)))] == [("hub", "other")]


def test_what_cannot_go_together_with_interference_is_refused():
    """With the key and the reason, when the case is read."""
    for kind, why in (
        ({"interference": pr.Interference(DELTA, "fat")}, "unknown step 'fat'; did you mean 'fit'"),
        ({"interference": -1.0}, "interference"),
        ({"interference": "drawn"}, "interference"),
    ):
        with pytest.raises(PrensaError, match=why):
            fit("plane strain", 0.0, (4, 4), **kind)
    until = pr.Step("fit", until={"force": {"t": {"y": 1.0}}}, move={"t": pr.Motion(y=-0.1)})
    with pytest.raises(PrensaError, match="may end before its time"):
        pressed_block(until, contacts=[pr.Contact("b.top", "t", interference=0.1)])
    with pytest.raises(PrensaError, match="removed before the overlap has grown"):
        pressed_block(
            pr.Step("fit"), pr.Step("off", remove_tools=True),
            contacts=[pr.Contact("b.top", "t", interference=pr.Interference(0.1, "off"))],
        )  # fmt: skip
    with pytest.raises(PrensaError, match="interference' are not available yet"):
        refuse(discretise(fit("plane strain", 0.0, (4, 4))), None, ["bodies.hub.material.E"])


def test_the_redrawn_slave_side_overlaps_by_the_length():
    """The undeformed hub reaches into the shaft by the length at every node of its seat, and the share moves it out again."""
    system, apart = (discretise(fit("plane strain", 0.0, (8, 11), interference=by)) for by in (DELTA, None))
    seat, u = system.boundary_nodes("hub.inner"), np.zeros(system.ndof)
    assert np.hypot(*system.X[seat].T) == pytest.approx(np.hypot(*apart.X[seat].T) - DELTA, abs=0.01 * DELTA)
    u[system.dofs.fields["interference"].slice] = 1.0
    assert system.displacement(system.with_slaves(u))[seat] + system.X[seat] == pytest.approx(apart.X[seat], abs=1e-12)
