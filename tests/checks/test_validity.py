"""Warnings of a run that goes beyond what its descriptions hold for."""

from __future__ import annotations

import logging
import re
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.checks.during.validity import Validity, slopes
from prensa.errors import SolveError
from prensa.model.schema import CaseError, loads
from prensa.policy import Policy
from prensa.system.failure import BeyondSmall
from problems import pressed_block, single_block, stroke, upset_block

HARDENING = pr.J2(70e3, 0.33, pr.Linear(100.0, 200.0))


def stretched(strain: float, element: str | None = None, **more: object) -> pr.Problem:
    """A bar 4 × 2 pulled by a strain along x, in three steps; more: fields of the problem."""
    return single_block(
        pr.Step("pull", fixed={"bar.right": pr.Fixed(x=4 * strain)}, increments=4),
        material=pr.Elastic(E=1000, nu=0.0), n=(4, 2), element=element, body="bar", **{"kinematics": "small", **more},
    )  # fmt: skip


@pytest.mark.parametrize("element", ["q4", "t3", "q8", "t6", "q4_enhanced", "q4_sheet"])
def test_strain_and_rotation_are_those_of_a_linear_displacement(element):
    """Of u = H X each element has the strain and the rotation of H, whatever its shape."""
    p = stretched(0.0, element)
    x = np.array([[0, 0], [4, 0.3], [3.5, 2], [0, 2.2]])
    p = replace(p, bodies={"bar": replace(p.bodies["bar"], mesh=pr.Patch(corners=tuple(map(tuple, x)), n=(3, 2)))})
    system = pr.discretise(p)
    H = np.array([[0.02, 0.01], [0.05, -0.04]])
    u = np.zeros(system.ndof)
    system.displacement(u)[:] = system.X @ H.T
    validity = Validity(system, Policy())
    assert validity.look(u, system.initial_history) is None
    strain = np.abs(np.linalg.eigvalsh(0.5 * (H + H.T))).max()
    np.testing.assert_allclose(validity.seen["bar"], [strain, np.arctan(0.02)] * 2, rtol=1e-12)
    block = system.blocks[0]
    np.testing.assert_allclose(slopes(system.X[block.corners]).sum(axis=1), 0.0, atol=1e-14)


def test_the_hoop_strain_counts_in_axisymmetry():
    """A ring that only opens is strained round the axis."""
    p = stretched(0.0, space="axisymmetric", allow_large_strain=False)
    system = pr.discretise(p)
    u = np.zeros(system.ndof)
    system.displacement(u)[:, 0] = 0.03 * system.X[:, 0] + 0.02
    validity = Validity(system, Policy())
    validity.look(u, system.initial_history)
    assert validity.seen["bar"].most_strain == pytest.approx(0.03 + 0.02 / 0.5)


@pytest.mark.parametrize("condense", [False, True])
def test_small_strain_is_refused_where_it_means_nothing(condense, caplog):
    """Beyond 10 % the run ends before the increment that goes there, and says what to write; nothing is cut."""
    with pytest.raises(SolveError, match=r"no longer holds.*kinematics: finite") as failed:
        list(pr.solve(stretched(0.15), pr.Numerics(condense=condense)))
    assert isinstance(failed.value.reason, BeyondSmall)
    if not condense:  # condensed bodies are looked at where a step ends
        assert failed.value.last.time == 0.5
        assert failed.value.reason.strain == pytest.approx(0.1125)
    # predicted from the travel of the supports, and nothing else
    assert [r.getMessage().partition(":")[0] for r in caplog.records] == ["kinematics"]


@pytest.mark.parametrize(
    ("strain", "more"), [(0.15, {"allow_large_strain": True}), (0.15, {"kinematics": "finite"}), (0.04, {})]
)
def test_what_is_small_or_meant_or_finite_is_not_remarked_upon(strain, more, caplog):
    """Said twice it runs, without a word; so do small strains, and finite ones."""
    assert len(list(pr.solve(stretched(strain, **more)))) == 4
    assert not caplog.records


def test_strains_that_are_not_small_are_reported_once(caplog):
    """Between 5 and 10 % a run goes on, and says at its end what it came to."""
    caplog.set_level(logging.WARNING, "prensa")
    list(pr.solve(stretched(0.08)))
    (record,) = caplog.records
    assert "strained by up to 0.08 and rotated by up to 0°" in record.getMessage()


def test_leave_for_large_strains_belongs_to_small_kinematics():
    """In finite strain the key is refused with its place."""
    text = """\
name: bar
allow_large_strain: true
bodies: {b: {mesh: {type: rectangle, size: [1, 1], n: [1, 1]}, material: {type: elastic, E: 1000, nu: 0.3}}}
steps: [{name: s}]
"""
    with pytest.raises(CaseError, match=":2:1: finite strain needs no permission"):
        loads(text)


@pytest.mark.parametrize(("end", "reported"), [(0.02, True), (0.5, False)])
def test_a_flow_curve_used_beyond_its_end_is_reported_with_the_largest_strain(end, reported, caplog):
    """A table that ends at 2 % and is used to some 10 %: one warning at the end of the run, none where it is long enough."""
    caplog.set_level(logging.WARNING, "prensa")
    flow = pr.FlowTable(((0.0, 10.0), (end, 20.0)))
    p = stretched(0.1, kinematics="finite")
    *_, last = pr.solve(replace(p, bodies={"bar": replace(p.bodies["bar"], material=pr.J2(1000, 0.3, flow))}))
    said = [r.getMessage() for r in caplog.records]
    assert len(said) == reported
    if reported:
        largest = last.bodies["bar"].plastic_strain.max()
        assert f"ends at a plastic strain of 0.02 and was used up to {largest:.3g}" in said[0]


@pytest.mark.parametrize(("material", "k_n", "reported"), [
    (pr.Elastic(E=1000.0, nu=0.3), 100.0, True), (pr.J2(E=1000.0, nu=0.3, flow=pr.Perfect(s0=1.0)), 100.0, False),
    (pr.J2(E=1000.0, nu=0.3, flow=pr.Perfect(s0=10.0)), 100.0, True),
])  # fmt: skip
def test_a_soft_contact_is_reported_where_a_tool_would_sink_in(material, k_n, reported):
    """Elements 0.5 deep: pressures of an elastic body have no bound, three times a yield stress of 1 presses a tool in by 6 %."""
    from prensa.checks.before.preflight import preflight

    problem = pressed_block(stroke(-0.01), material=material, size=(2.0, 1.0), n=(4, 2), enforcement=pr.Penalty(k_n=k_n))
    notices = [str(n) for n in preflight(pr.discretise(problem)) if "the tool penetrates" in str(n)]
    assert bool(notices) == reported


@pytest.mark.parametrize("travel", [0.4, 0.6])
def test_what_compression_leaves_out_of_a_force_is_that_of_birchs_equation_of_state(travel, caplog):
    """Perfect plasticity, held all round: the force is that of the pressure, and its error one known pressure over the other.

    Estimated over the second half of the work, so between the error at its middle and at its end.
    """
    E, nu, height = 70e3, 0.33, 3.0
    problem = pressed_block(
        stroke(-travel, increments=20), material=pr.J2(E, nu, pr.Perfect(s0=1.0)), size=(4, 3), n=(4, 3), body="block",
        fixed={"block.bottom": "y", "block.left": "x", "block.right": "x"},
    )  # fmt: skip
    *_, last = pr.solve(problem)

    def pressures(J: float) -> tuple[float, float]:
        K = E / (3 * (1 - 2 * nu))
        return -K * np.log(J) / J, 1.5 * K * (J ** (-7 / 3) - J ** (-5 / 3))

    given, birch = pressures(1 - travel / height)
    assert last.force("t").y == pytest.approx(4.0 * given, rel=5e-3)
    half, beyond = pressures(1 - travel / height / 2**0.5)
    (said,) = [m for m in caplog.messages if "has lost more than" in m] or [""]
    share = float(re.search(r"estimated ([0-9.]+) %", said)[1]) / 100
    assert half < given and beyond / half - 1 < share < birch / given - 1 + 5e-4


def test_of_a_friction_hill_that_loses_volume_nothing_is_said_where_its_force_holds(caplog):
    """12 % are lost in its middle, where Birch's pressure is 14 % above Hencky's. A bulk modulus 15 % higher, the shear modulus
    as it is, changes the force by less than 5 %.
    """
    K, G = 70e3 / 1.02, 70e3 / 2.66

    def pressed(K: float) -> float:
        metal = pr.J2(9 * K * G / (3 * K + G), (3 * K - 2 * G) / (2 * (3 * K + G)), pr.Linear(100.0, 200.0))
        problem = upset_block(stroke(-0.5), material=metal, size=(11.8, 1.0), n=(11, 2), friction=pr.Coulomb(0.1))
        *_, last = pr.solve(problem)
        system = pr.discretise(problem)
        was, now = (x[system.blocks[0].cells] for x in (system.X, last.bodies["b"].x))
        assert (area(now) / area(was)).min() < 0.885
        return float(last.force("t").y)

    def area(x: np.ndarray) -> np.ndarray:
        one, other = x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]
        return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]

    assert 0.01 < pressed(1.15 * K) / pressed(K) - 1 < 0.05
    assert not [m for m in caplog.messages if "has lost more than" in m]


@pytest.mark.parametrize(("n", "length", "material", "words"), [
    ((4, 1), 6.7, HARDENING, "the mesh is too coarse"),
    ((8, 3), 4.63, HARDENING, r"folds over itself, and an estimated [34].* % of the forces"),
    ((24, 7), 6.937, pr.NeoHooke(10.0, 0.45), None),  # one of 168 elements folds, at a corner
])  # fmt: skip
def test_plates_pressed_to_half_are_warned_of_where_twice_as_fine_a_mesh_has_another_force(n, length, material, words, caplog):
    """More than 5 % apart, or not."""
    step = pr.Step("press", move={"t": pr.Motion(y=-0.5)})
    forces, said = [], []
    for finer in (1, 2):
        problem = upset_block(
            step, material=material, size=(length, 1.0), n=(n[0] * finer, n[1] * finer), friction=pr.Coulomb(0.3),
            sides=("top", "right"),
        )  # fmt: skip
        caplog.clear()
        *_, last = pr.solve(problem)
        forces.append(last.force("t").y)
        # friction beyond what metal bears is beside the mesh: the finer one has it too
        said.append([m for m in caplog.messages if "friction beyond its shear yield stress" not in m])
    assert (abs(forces[0] / forces[1] - 1) > 0.05) == bool(words)
    assert [re.search(words or "", m) is not None for m in said[0]] == [True] * bool(words)


@pytest.mark.parametrize(("material", "held", "words"), [
    (pr.J2(70e3, 0.33, pr.Swift(K=200, e0=0.01, n=0.2)), "block.left", None),
    (pr.J2(70e3, 0.33, pr.Swift(K=200, e0=0.01, n=0.2)), "block.right", "has lost more than 2. % of its volume"),
    (pr.Elastic(70e3, 0.33), "block.left", "is elastic with the modulus of a metal"),
    (pr.Elastic(700, 0.33), "block.left", None),
])  # fmt: skip
def test_metal_without_room_and_elastic_metal_are_reported(material, held, words, caplog):
    """Upset by a fifth: free to spread nothing is reported; held round its rim, or without a flow curve, it is."""
    problem = pressed_block(
        stroke(-0.75), material=material, size=(4, 3), n=(4, 3), body="block", fixed={"block.bottom": "y", held: "x"},
        space="axisymmetric",
    )  # fmt: skip
    list(pr.solve(problem))
    assert [bool(words) and re.search(words, m) is not None for m in caplog.messages] == ([True] if words else [])
