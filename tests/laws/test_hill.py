"""Hill's yield function in finite strain: von Mises as a special case, ratios of strains in tension, turned problems."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm, logm, polar

import prensa as pr
from prensa.errors import PrensaError
from prensa.materials.hill import Hill
from prensa.model.problem import Problem
from prensa.sensitivity.change import known
from prensa.sensitivity.parameters import value_of, with_values
from prensa.testing import check_material

R0, R45, R90 = 0.793, 0.317, 0.510  # AA6022-T4, measured
SHEET = Hill.coefficients(R0, R45, R90)
E, NU, FLOW = 70e3, 0.33, pr.Ludwik(120.0, 300.0, 0.3)
Y, HARDENING = 120.0, 1000.0


def test_it_keeps_what_every_material_keeps() -> None:
    """Tangent, objectivity, positive work."""
    check_material(Hill(E, NU, FLOW, angle=20.0, **SHEET))


def pressed(material: pr.Material, element: str, space: str) -> Problem:
    """A billet between two planes with friction."""
    body = pr.Body(pr.Rectangle(size=(6, 4), n=(3, 2)), material, element=element)
    return pr.Problem(
        "billet",
        space=space,
        bodies={"billet": body},
        tools={"die": pr.Plane(touching="billet.top")},
        contacts=[pr.Contact("billet.top", "die")],
        friction=pr.Coulomb(0.2),
        fixed={"billet.bottom": "y", "billet.left": "x"},
        steps=[pr.Step("press", move={"die": {"y": -0.6}}, increments=4)],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("element", "space"),
    [("q4_fbar", "axisymmetric"), ("q4_fbar", "plane strain"), ("q4_enhanced", "plane strain"), ("q8", "axisymmetric"),
     ("t6", "plane strain"), ("t3", "plane strain"), ("q4", "plane stress")],
)  # fmt: skip
def test_equal_numbers_are_von_mises(element: str, space: str) -> None:
    """F = G = H = 1/2, N = 3/2, whatever the direction of the axes: the answer of J2 by backward Euler."""
    rule = pr.Numerics(time_rule="backward_euler")
    hill, mises = (list(pr.solve(pressed(m, element, space), rule)) for m in (Hill(E, NU, FLOW, angle=25.0), pr.J2(E, NU, FLOW)))
    assert hill[-1].force("die").y == pytest.approx(mises[-1].force("die").y, rel=1e-8)
    a, b = hill[-1].bodies["billet"], mises[-1].bodies["billet"]
    assert np.abs(a.x - b.x).max() <= 1e-8
    assert np.abs(a.plastic_strain - b.plastic_strain).max() <= 1e-8


def pulled(angle: float, tractions: tuple[float, ...]) -> list[pr.Increment]:
    """A sheet in uniaxial tension along x, its rolling direction at an angle to that; it shears freely along its ends."""

    def pull(t: float) -> dict[str, pr.Load]:
        return {f"sheet.{side}": pr.Load(traction=(sign * t, 0.0)) for side, sign in (("left", -1), ("right", 1))}

    material = Hill(E, NU, pr.Linear(Y, HARDENING), angle=angle, **SHEET)
    problem = pr.Problem(
        "tension",
        space="plane stress",
        bodies={"sheet": pr.Body(pr.Rectangle(size=(2, 1), n=(2, 1)), material)},
        fixed={"sheet.bottom": "y", "sheet.bottom-left": "x"},
        steps=[pr.Step(f"to {t:g}", loads=pull(t), increments=1) for t in tractions],
    )
    return list(pr.solve(problem))


def gradient(i: pr.Increment) -> np.ndarray:
    """F (3, 3) of a sheet that deforms evenly."""
    s = i.bodies["sheet"]
    own, _ = np.linalg.lstsq(np.c_[s.X, np.ones(len(s.X))], s.x, rcond=None)[:2]
    assert s.thickness is not None
    out = np.zeros((3, 3))
    out[:2, :2], out[2, 2] = own[:2].T, s.thickness[0]
    return out


def elastic(i: pr.Increment) -> np.ndarray:
    """Elastic logarithmic strain (3, 3) of its stress."""
    xx, yy, zz, xy = i.bodies["sheet"].stress[0] * np.linalg.det(gradient(i))
    s = np.array([[xx, xy, 0], [xy, yy, 0], [0, 0, zz]])
    return ((1 + NU) * s - NU * np.trace(s) * np.eye(3)) / E


@pytest.mark.parametrize(
    ("angle", "r", "ratio"), [(0.0, R0, 1.0), (45.0, R45, 1.03234565759), (90.0, R90, 0.873876711127)]
)
def test_tension_has_the_ratios_of_strain(angle: float, r: float, ratio: float) -> None:
    """Width over thickness of the plastic strain of an increment, and the stress, are those of the closed form."""
    last, now = pulled(-angle, (0.97 * Y * ratio, 1.02 * Y * ratio))[-2:]
    f = gradient(now) @ np.linalg.inv(gradient(last))
    V = expm(elastic(last))
    plastic = 0.5 * np.real(logm(f @ V @ V @ f.T)) - elastic(now)
    # off the axes the sheet shears, which turns them by what the elastic part of the motion turns
    turned = polar((f @ V)[:2, :2])[0]
    at = np.radians(angle) - np.arctan2(turned[1, 0], turned[0, 0])
    F, G, H, N = (SHEET[k] for k in "FGHN")
    s, c = np.sin(at) ** 2, np.cos(at) ** 2
    there = (H + (2 * N - F - G - 4 * H) * s * c) / (F * s + G * c)
    assert plastic[1, 1] / plastic[2, 2] == pytest.approx(there, rel=1e-6)
    assert there == pytest.approx(r, abs=1e-6 if angle != 45.0 else 1e-3)
    sheet = now.bodies["sheet"]
    of_first = 1.0 / np.sqrt(F * s**2 + G * c**2 + H * (c - s) ** 2 + 2 * N * s * c)
    assert of_first == pytest.approx(ratio, abs=1e-6 if angle != 45.0 else 1e-3)
    assert sheet.stress[:, 0] == pytest.approx(of_first * (Y + HARDENING * sheet.plastic_strain), rel=1e-6)


def test_first_flow_at_45_degrees_has_its_ratio() -> None:
    """Before the axes have turned the ratio is the one from which the coefficients come."""
    last, now = pulled(-45.0, (1.0311 * Y, 1.03122 * Y))[-2:]
    f = gradient(now) @ np.linalg.inv(gradient(last))
    b = expm(2.0 * elastic(last))
    plastic = 0.5 * np.real(logm(f @ b @ f.T)) - elastic(now)
    assert plastic[0, 0] > 0.0
    assert plastic[1, 1] / plastic[2, 2] == pytest.approx(R45, rel=1e-6)


def turned(by: float, space: str) -> pr.Increment:
    """A clamped sheet that is pulled and sheared, everything at an angle (degrees)."""
    c, s = np.cos(np.radians(by)), np.sin(np.radians(by))
    x, y = np.meshgrid(np.linspace(0, 4, 5), np.linspace(0, 2, 3))
    points = np.stack([x.ravel() + 0.1 * np.sin(3.0 * y.ravel()), y.ravel()], axis=1) @ np.array([[c, s], [-s, c]])
    cells = [(k, k + 1, k + 6, k + 5) for k in (*range(4), *range(5, 9))]
    mesh = pr.Points(points.tolist(), cells, {"left": (0, 5, 10), "right": (4, 9, 14)})
    pull = 0.4 * c - 0.3 * s, 0.4 * s + 0.3 * c
    problem = pr.Problem(
        "clamped",
        space=space,
        bodies={"sheet": pr.Body(mesh, Hill(E, NU, FLOW, angle=35.0 + by, **SHEET))},
        fixed={"sheet.left": "xy"},
        steps=[pr.Step("pull", fixed={"sheet.right": {"x": pull[0], "y": pull[1]}}, increments=4)],
    )
    return list(pr.solve(problem))[-1]


@pytest.mark.parametrize("space", ["plane stress", "plane strain"])
def test_a_turned_problem_has_the_turned_answer(space: str) -> None:
    """Mesh, motions and rolling direction turned by 30°."""
    a, b = (turned(by, space) for by in (0.0, 30.0))
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    Q = np.array([[c, -s], [s, c]])
    assert np.abs(b.bodies["sheet"].displacement - a.bodies["sheet"].displacement @ Q.T).max() <= 1e-9
    old, new = a.state.history[0], b.state.history[0]
    # elastic tensors and axes turn, plastic strain and work do not
    b_old, b_new = (h[..., [0, 3, 3, 1]].reshape(*h.shape[:2], 2, 2) for h in (old, new))
    assert np.abs(b_new - Q @ b_old @ Q.T).max() <= 1e-10
    assert np.abs(new[..., 4:6] - old[..., 4:6] @ Q.T).max() <= 1e-9
    assert np.abs(new[..., 6] - old[..., 6]).max() <= 1e-9
    assert old[..., 6].max() > 0.1


TABLED = pr.FlowTable(((0.0, 120.0), (0.1, 250.0), (1.0, 400.0)))


@pytest.mark.parametrize(("flow", "order"), [(FLOW, "bdf2"), (FLOW, "backward_euler"), (TABLED, "bdf2")])
def test_derivatives_are_those_of_runs(flow: pr.FlowCurve, order: Any) -> None:
    """By a coefficient, the angle, Young's modulus and a number of the flow curve: closed forms against runs beside."""
    material = Hill(E, NU, flow, angle=25.0, **SHEET)
    names = ["H", "angle", "E", "flow.K" if flow is FLOW else "flow.points.1.1"]
    rule = pr.Numerics(time_rule=order)
    paths = [f"bodies.billet.material.{name}" for name in names]
    problem = replace(pressed(material, "q4_fbar", "plane strain"), friction=pr.Coulomb(0.0))
    assert known(pr.discretise(problem))
    last = list(pr.solve(problem, rule, derivatives=paths))[-1]
    found, force = last.derivative("die.force.y"), last.force("die").y
    for path in paths:
        value = value_of(problem, path)
        beside = [
            list(pr.solve(with_values(problem, {path: value * (1.0 + s)}), rule))[-1].force("die").y for s in (1e-5, -1e-5)
        ]
        assert value * found[path] == pytest.approx((beside[0] - beside[1]) / 2e-5, abs=1e-6 * abs(force))


def test_space_and_case_files_are_refused_in_words(tmp_path) -> None:
    """There is no law in three dimensions, and no name for it in case files so far."""
    with pytest.raises(PrensaError, match="three dimensions"):
        Hill(E, NU, FLOW).law("finite", "solid")
    material = "{type: 'prensa.materials.hill:Hill', E: 70 GPa, nu: 0.33, flow: {type: perfect, s0: 100}}"
    (tmp_path / "sheet.yaml").write_text(
        f"bodies: {{sheet: {{mesh: {{type: rectangle, size: [1, 1], n: [1, 1]}}, material: {material}}}}}\n"
        "steps: [{name: pull, fixed: {sheet.left: x}, increments: 1}]\n"
    )
    with pytest.raises(PrensaError, match="from Python alone so far"):
        pr.load(str(tmp_path / "sheet.yaml"))
