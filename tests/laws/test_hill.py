"""Hill's yield function in finite strain: von Mises as a special case, ratios of strains in tension, turned problems."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm, logm, polar

import prensa as pr
from prensa.errors import PrensaError
from prensa.materials.protocol import At, Out
from prensa.model.problem import Problem
from prensa.model.schema import loads
from prensa.output.whole import mirror_findings
from prensa.sensitivity.change import known
from prensa.sensitivity.parameters import value_of, with_values
from prensa.testing import check_material

R0, R45, R90 = 0.793, 0.317, 0.510  # AA6022-T4, measured
SHEET = {"r": (R0, R45, R90)}
E, NU, FLOW = 70e3, 0.33, pr.Ludwik(120.0, 300.0, 0.3)
Y, HARDENING = 120.0, 1000.0


def test_it_keeps_what_every_material_keeps() -> None:
    """Tangent, objectivity, positive work."""
    check_material(pr.Hill(E, NU, FLOW, angle=0.35, **SHEET))


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
    materials = pr.Hill(E, NU, FLOW, angle=0.44), pr.J2(E, NU, FLOW)
    hill, mises = (list(pr.solve(pressed(m, element, space), rule)) for m in materials)
    assert hill[-1].force("die").y == pytest.approx(mises[-1].force("die").y, rel=1e-8)
    a, b = hill[-1].bodies["billet"], mises[-1].bodies["billet"]
    assert np.abs(a.x - b.x).max() <= 1e-8
    assert np.abs(a.plastic_strain - b.plastic_strain).max() <= 1e-8


def pulled(angle: float, tractions: tuple[float, ...]) -> list[pr.Increment]:
    """A sheet in uniaxial tension along x, its rolling direction at an angle to that; it shears freely along its ends."""

    def pull(t: float) -> dict[str, pr.Load]:
        return {f"sheet.{side}": pr.Load(traction=(sign * t, 0.0)) for side, sign in (("left", -1), ("right", 1))}

    material = pr.Hill(E, NU, pr.Linear(Y, HARDENING), angle=np.radians(angle), **SHEET)
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
    F, G, H, N = pr.Hill(E, NU, FLOW, **SHEET).coefficients().values()
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
        bodies={"sheet": pr.Body(mesh, pr.Hill(E, NU, FLOW, angle=np.radians(35.0 + by), **SHEET))},
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


@pytest.mark.parametrize(
    ("flow", "order"), [(FLOW, "bdf2"), pytest.param(FLOW, "backward_euler", marks=pytest.mark.slow), (TABLED, "bdf2")]
)
def test_derivatives_are_those_of_runs(flow: pr.FlowCurve, order: Any) -> None:
    """By a coefficient, the angle, Young's modulus and a number of the flow curve: closed forms against runs beside."""
    material = pr.Hill(E, NU, flow, angle=0.44, **SHEET)
    names = ["r.0", "angle", "E", "flow.K" if flow is FLOW else "flow.points.1.1"]
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


# ------------------------------------------------------------------------------------------------------------- in space
OBLIQUE = {"rolling": (0.3, -0.5, 0.8), "normal": (0.8, 0.48, 0.0)}
SHEARS = {"M": 2.1, "L": 1.2}


def pressed_in_space(material: pr.Material, element: str) -> Problem:
    """A billet between two planes with friction."""
    return pr.Problem(
        "billet",
        space="solid",
        bodies={"billet": pr.Body(pr.Box((3, 2, 2), (2, 2, 2)), material, element=element)},
        tools={"die": pr.Plane(normal=(0, -1, 0), touching="billet.top")},
        contacts=[pr.Contact("billet.top", "die")],
        friction=pr.Coulomb(0.2),
        fixed={"billet.bottom": "y", "billet.left": "x", "billet.back": "z"},
        steps=[pr.Step("press", move={"die": {"y": -0.3}}, increments=3)],
    )  # fmt: skip


@pytest.mark.parametrize("element", ["h8", "h8_fbar", "h8_enhanced"])
def test_equal_numbers_are_von_mises_in_space(element: str) -> None:
    """Whatever the directions of the axes: the answer of J2 by backward Euler."""
    rule = pr.Numerics(time_rule="backward_euler")
    materials = pr.Hill(E, NU, FLOW, **OBLIQUE), pr.J2(E, NU, FLOW)
    hill, mises = (list(pr.solve(pressed_in_space(m, element), rule)) for m in materials)
    assert hill[-1].force("die").y == pytest.approx(mises[-1].force("die").y, rel=1e-8)
    a, b = hill[-1].bodies["billet"], mises[-1].bodies["billet"]
    assert np.abs(a.x - b.x).max() <= 1e-8
    assert np.abs(a.plastic_strain - b.plastic_strain).max() <= 1e-8
    assert np.abs(a.stress - b.stress).max() <= 1e-6 * np.abs(b.stress).max()


def sheared(space: str) -> pr.Increment:
    """A sheet that is held at its left, pulled and sheared at its right, in plane strain or one layer of bricks."""
    material, pull = pr.Hill(E, NU, FLOW, angle=0.61, **SHEET, **SHEARS), {"x": 0.3, "y": 0.25}
    if space == "solid":
        mesh: Any = pr.Box((4, 2, 1), (4, 2, 1))
        fixed, more = {"sheet.left": "xy", "sheet.front": "z", "sheet.back": "z"}, {"element": "h8"}
    else:
        mesh, fixed, more = pr.Rectangle(size=(4, 2), n=(4, 2)), {"sheet.left": "xy"}, {"element": "q4"}
    problem = pr.Problem(
        "sheet",
        space=space,  # type: ignore[arg-type]
        bodies={"sheet": pr.Body(mesh, material, **more)},
        fixed=fixed,
        steps=[pr.Step("pull", fixed={"sheet.right": pull}, increments=4)],
    )
    return list(pr.solve(problem))[-1]


def test_plane_strain_is_a_special_case_of_space() -> None:
    """Per thickness 1, with plain elements, turned axes and increments of second order in time."""
    plane, space = sheared("plane strain"), sheared("solid")
    for name in ("elastic", "plastic"):
        assert space.energy[name] == pytest.approx(plane.energy[name], rel=1e-8)
    # points of both layers of the rule across the thickness have the plane's values
    a, b = np.sort(plane.state.history[0][..., 6].ravel()), np.sort(space.state.history[0][..., 12].ravel())[::2]
    assert a[-1] > 0.05
    assert np.abs(b - a).max() <= 1e-8


CUBE = [(x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))]


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_tension_across_oblique_axes_flows_along_the_normal_of_the_yield_surface(kinematics: Any) -> None:
    """All three shears of the axes take part: plastic strain and stress are those of the function written out."""
    F, G, H, N = pr.Hill(E, NU, FLOW, **SHEET).coefficients().values()
    M, L = SHEARS["M"], SHEARS["L"]
    ends = ("left", -130.0), ("right", 130.0)
    named = {"left": (0, 3, 4, 7), "right": (1, 2, 5, 6), "origin": (0,), "along": (1,), "aside": (3,)}
    material = pr.Hill(E, NU, pr.Linear(Y, HARDENING), **SHEET, **SHEARS, **OBLIQUE)
    problem = pr.Problem(
        "tension",
        space="solid",
        kinematics=kinematics,
        bodies={"brick": pr.Body(pr.Bricks(CUBE, [tuple(range(8))], named), material, element="h8")},
        fixed={"brick.origin": "xyz", "brick.along": "yz", "brick.aside": "z"},
        steps=[pr.Step("pull", loads={f"brick.{k}": pr.Load(traction=(t, 0, 0)) for k, t in ends}, increments=1)],
    )
    brick = list(pr.solve(problem))[-1].bodies["brick"]
    own = np.linalg.lstsq(np.c_[brick.X, np.ones(8)], brick.x, rcond=None)[0][:3].T
    finite = kinematics == "finite"
    xx, yy, zz, xy, xz, yz = brick.stress[0]
    stress = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) * (np.linalg.det(own) if finite else 1.0)
    strain = 0.5 * np.real(logm(own @ own.T)) if finite else 0.5 * (own + own.T) - np.eye(3)
    plastic = strain - ((1 + NU) * stress - NU * np.trace(stress) * np.eye(3)) / E
    # without flow before it, the axes have turned by the rotation of the polar decomposition
    first, third = (np.array(OBLIQUE[k]) / np.linalg.norm(OBLIQUE[k]) for k in ("rolling", "normal"))
    Q = np.stack([first, np.cross(third, first), third]) @ (polar(own)[0].T if finite else np.eye(3))
    (s11, s12, s13), (_, s22, s23), (_, _, s33) = Q @ stress @ Q.T
    flow = np.array([
        [H * (s11 - s22) - G * (s33 - s11), N * s12, M * s13],
        [N * s12, F * (s22 - s33) - H * (s11 - s22), L * s23],
        [M * s13, L * s23, G * (s33 - s11) - F * (s22 - s33)],
    ])  # fmt: skip
    equivalent = np.sqrt(np.sum(flow * (Q @ stress @ Q.T)))
    rise = brick.plastic_strain[0]
    assert rise > 1e-3
    assert equivalent == pytest.approx((Y + HARDENING * rise) * (np.linalg.det(own) if finite else 1.0), rel=1e-8)
    assert np.abs(plastic - rise * Q.T @ (flow / equivalent) @ Q).max() <= 1e-8 * rise
    assert xx == pytest.approx(130.0, rel=0.05)
    assert np.abs([yy, zz, xy, xz, yz]).max() <= 1e-7 * xx


def test_tangents_in_space_are_exact_where_principal_strains_coincide() -> None:
    """Tension along an axis, hydrostatic, simple shear, all of them or two alike, against differences."""
    law = pr.Hill(E, NU, FLOW, **SHEET, **SHEARS, **OBLIQUE).law("finite", "solid")
    shear = np.zeros((3, 3))
    shear[0, 1] = 0.03
    h = np.array([np.diag([0.03, -0.012, -0.012]), 1e-3 * np.eye(3), shear, np.diag([0.02, -0.006, -0.006000001])]).reshape(-1, 9)
    old = np.zeros((len(h), law.size))
    for part in law.fields.values():
        old[:, part.columns] = part.start(np.zeros((len(h), 3)))

    def stress(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n = len(h)
        out = Out(np.empty((n, 9)), np.empty((n, 9, 9)), np.zeros((n, law.size)), np.zeros(n, dtype=np.bool_))
        law.update(np.ascontiguousarray(h), old, At(0.1, 0.1), out)
        assert not out.failed.any()
        return out.P, out.A

    A = stress(h)[1]
    for k, step in enumerate(1e-6 * np.eye(9)):
        slope = (stress(h + step)[0] - stress(h - step)[0]) / 2e-6
        assert np.abs(slope - A[:, :, k]).max() <= 1e-6 * np.abs(A).max()


def turned_in_space(by: float) -> pr.Increment:
    """A clamped bar that is pulled and sheared, turned by an angle about an oblique axis together with its directions."""
    axis = np.array([1.0, 2.0, -1.5]) / np.linalg.norm([1.0, 2.0, -1.5])
    K = np.cross(np.eye(3), axis)
    R = expm(-np.radians(by) * K)
    x, y, z = (a.ravel() for a in np.meshgrid(np.linspace(0, 2, 3), [0, 1], [0, 1], indexing="ij"))
    points = np.stack([x, y + 0.1 * np.sin(x), z], axis=1) @ R.T
    cells = [tuple(4 * k + np.array([0, 4, 6, 2, 1, 5, 7, 3])) for k in range(2)]
    mesh = pr.Bricks(points.tolist(), [tuple(map(int, c)) for c in cells], {"left": (0, 1, 2, 3), "right": (8, 9, 10, 11)})
    rolling, normal = (tuple((R @ np.array(OBLIQUE[k])).tolist()) for k in ("rolling", "normal"))
    pull = R @ np.array([0.15, -0.2, 0.1])
    problem = pr.Problem(
        "clamped",
        space="solid",
        bodies={"bar": pr.Body(mesh, pr.Hill(E, NU, FLOW, rolling=rolling, normal=normal, **SHEET, **SHEARS))},
        fixed={"bar.left": "xyz"},
        steps=[pr.Step("pull", fixed={"bar.right": dict(zip("xyz", pull.tolist()))}, increments=4)],
    )
    return list(pr.solve(problem))[-1]


def test_a_turned_problem_in_space_has_the_turned_answer() -> None:
    """Mesh, motions and directions turned by 50° about an oblique axis: the same plastic strain and energies."""
    a, b = (turned_in_space(by) for by in (0.0, 50.0))
    assert a.bodies["bar"].plastic_strain.max() > 0.1
    assert np.abs(b.bodies["bar"].plastic_strain - a.bodies["bar"].plastic_strain).max() <= 1e-9
    for name in ("elastic", "plastic"):
        assert b.energy[name] == pytest.approx(a.energy[name], rel=1e-9)


def test_case_files_name_it(tmp_path: Path) -> None:
    """In plane and space, with ratios of strains and a metal of the library, and what contradicts itself is refused."""
    box = "{type: box, size: [1, 1, 1], n: [1, 1, 1]}"
    solid = f"name: sheet\nspace: solid\nbodies: {{sheet: {{mesh: {box}, material: {{type: hill, %s}}}}}}\n"
    step = "fixed: {sheet.left: x, sheet.bottom: y, sheet.back: z}\n"
    step += "steps: [{name: pull, fixed: {sheet.right: {x: 0.1}}, increments: 1}]\n"
    good = "of: AA6061-T6, r: [1.9, 1.4, 2.2], angle: 30 deg"
    (tmp_path / "sheet.yaml").write_text(solid % good + step)
    material = pr.load(str(tmp_path / "sheet.yaml")).problem.bodies["sheet"].material
    assert isinstance(material, pr.Hill)
    assert 6e4 < material.E < 8e4
    flow = "E: 70 GPa, nu: 0.33, flow: {type: perfect, s0: 100}"
    for wrong, words in (
        ("r: [1, 1, 1], F: 0.5", "say the same thing twice"),
        ("F: 0.5, G: 0.5, H: 0.5", "'N' missing"),
        ("rolling: [1, 0, 0]", "belong together"),
        ("rolling: [1, 0, 0], normal: [1, 1, 0]", "not at right angles"),
        ("rolling: [0, 0, 0], normal: [1, 1, 0]", "not at right angles"),
        ("angle: 20, rolling: [1, 0, 0], normal: [0, 1, 0]", "leave one of them out"),
        ("r: [1, 1]", "r"),
    ):
        (tmp_path / "sheet.yaml").write_text(solid % f"{flow}, {wrong}" + step)
        with pytest.raises(PrensaError, match=words) as error:
            pr.load(str(tmp_path / "sheet.yaml"))
        assert "sheet.yaml:3" in str(error.value)


def test_directions_in_space_are_refused_in_the_plane(tmp_path: Path) -> None:
    """There the normal of the sheet is z."""
    hill = "{type: hill, of: IF-steel, rolling: [1, 0, 0], normal: [0, 1, 0]}"
    body = f"{{mesh: {{type: rectangle, size: [1, 1], n: [1, 1]}}, material: {hill}}}"
    case = f"name: sheet\nbodies: {{sheet: {body}}}\nfixed: {{sheet.left: xy}}\n"
    case += "steps: [{name: pull, fixed: {sheet.right: {x: 0.1}}}]\n"
    (tmp_path / "sheet.yaml").write_text(case)
    with pytest.raises(PrensaError, match=r"sheet.yaml:2:\d+: 'rolling'|is a direction in space"):
        pr.load(str(tmp_path / "sheet.yaml"))


def test_a_plane_across_its_axes_is_no_plane_of_symmetry(tmp_path: Path) -> None:
    """Its mirror image is another material: forces of the whole would be wrong."""
    case = (
        "name: sheet\nspace: solid\nbodies: {{sheet: {{mesh: {{type: box, size: [1, 1, 1], n: [1, 1, 1]}}, "
        "material: {{type: hill, of: IF-steel, r: [2, 1, 3], {}}}}}}}\nfixed: {{sheet.left: x, sheet.bottom: y, sheet.back: z}}\n"
        "steps: [{{name: pull, fixed: {{sheet.right: {{x: 0.1}}}}, increments: 1}}]\noutput: {{mirror: [left]}}\n"
    )
    along = "rolling: [0, 1, 1], normal: [1, 0, 0]"
    for directions, refused in (("angle: 25 deg", True), ("angle: 90 deg", False), (along, False)):
        given = loads(case.format(directions), "sheet.yaml")
        said = [str(f) for f in mirror_findings(pr.discretise(given.problem), given)]
        assert [("axes of the material of 'sheet' lie across" in words) for words in said] == [True] * refused


def test_shear_strength_is_that_of_its_yield_function() -> None:
    """All coefficients four times those of von Mises: half the strength; and friction by the metal's strength is that of J2."""
    history = np.zeros((1, 40))
    own, mises = pr.Hill(E, NU, FLOW, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0), pr.J2(E, NU, FLOW)
    for space in ("plane strain", "solid"):
        hill, j2 = (m.law("finite", space) for m in (own, mises))
        strength = [law.shear_strength(history[:, : law.size]) for law in (hill, j2)]
        assert strength[0] == pytest.approx(0.5 * strength[1])
