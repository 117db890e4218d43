"""Decks in space: bricks, wedges and tetrahedra, rigid surfaces, supports, loads, steps, beside closed forms and native cases."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from blocks_of_bricks import bricks, tetrahedra
from prensa.cli import app
from prensa.importers.abaqus_case import case_of
from prensa.importers.deck import FileError
from prensa.importers.imported import case_text

SIDES = {"LEFT": (0, 0.0), "RIGHT": (0, 1.0), "BOTTOM": (1, 0.0), "TOP": (1, 1.0), "BACK": (2, 0.0), "FRONT": (2, 1.0)}
OF_SIDE = {"LEFT": "S6", "RIGHT": "S4", "BOTTOM": "S3", "TOP": "S5", "BACK": "S1", "FRONT": "S2"}
ELASTIC = "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
HELD = "*BOUNDARY\nLEFT, 1\nBOTTOM, 2\nBACK, 3\n"


def listed(numbers) -> str:
    return "\n".join(", ".join(str(n) for n in numbers[i : i + 12]) for i in range(0, len(numbers), 12))


def box(size=(2.0, 1.0, 1.0), n=(2, 2, 2), kind="C3D8", name="ALL", mesh=None) -> str:
    """Nodes, elements, sets and surfaces of the sides of a box of bricks, or of tetrahedra for C3D10."""
    X, cells, _ = mesh or (tetrahedra if "10" in kind else bricks)(n, size)
    out = ["*NODE, NSET=NALL", *(f"{k + 1}, {', '.join(f'{c:.12g}' for c in x)}" for k, x in enumerate(X))]
    out += [f"*ELEMENT, TYPE={kind}, ELSET={name}", *(", ".join(map(str, [e + 1, *(c + 1)])) for e, c in enumerate(cells))]
    for side, (axis, end) in SIDES.items():
        nodes = np.flatnonzero(np.abs(X[:, axis] - end * size[axis]) < 1e-9)
        out.append(f"*NSET, NSET={side}\n{listed(nodes + 1)}")
        if "8" in kind:
            on = np.flatnonzero((np.abs(X[cells][..., axis] - end * size[axis]) < 1e-9).sum(axis=1) == 4)
            out.append(f"*ELSET, ELSET=E{side}\n{listed(on + 1)}\n*SURFACE, NAME=S{side}\nE{side}, {OF_SIDE[side]}")
    return "\n".join(out) + "\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n"


def step(body: str, parameters: str = "", static: str = "1., 1.") -> str:
    return f"*STEP{parameters}\n*STATIC, DIRECT\n{static}\n{body}*END STEP\n"


def run(tmp_path: Path, text: str, *without: str) -> list:
    """All increments of the case that a deck becomes; files stand beside it."""
    (tmp_path / "d.inp").write_text(text)
    arguments = [x for w in without for x in ("--without", w)]
    result = CliRunner().invoke(app, ["import", str(tmp_path / "d.inp"), "--out", str(tmp_path / "d.yaml"), *arguments])
    assert result.exit_code == 0, result.output
    return list(pr.solve(pr.load(tmp_path / "d.yaml").problem))


@pytest.mark.parametrize("kind", ["C3D8", "C3D8I", "C3D10M"])
def test_a_block_is_pulled_as_a_bar(tmp_path: Path, kind: str) -> None:
    """Sets of nodes held along axes, one moved by 1 %: E ε A, and −ν ε across."""
    *_, last = run(tmp_path, box(kind=kind) + ELASTIC + HELD + step("*BOUNDARY\nRIGHT, 1, 1, 0.02\n"))
    (support,) = [f for name, f in last.supports.items() if name.endswith("RIGHT")]
    assert support.x == pytest.approx(10.0, rel=1e-8)
    (body,) = last.bodies.values()
    assert np.allclose(body.displacement, 0.01 * body.X * [1.0, -0.3, -0.3], atol=1e-10)


def test_wedges_and_loads_of_volumes_and_faces(tmp_path: Path) -> None:
    """C3D6; pressures P1 … P6 of elements, DSLOAD, TRVEC, gravity and BZ: supports carry their sums."""
    X = np.array([(0, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 3), (2, 0, 3), (0, 1, 3)], dtype=float)
    wedge = "*NODE\n" + "\n".join(f"{k + 1}, {x[0]}, {x[1]}, {x[2]}" for k, x in enumerate(X))
    wedge += "\n*ELEMENT, TYPE=C3D6, ELSET=ALL\n1, 1, 2, 3, 4, 5, 6\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n"
    wedge += "*SURFACE, NAME=LOW\n1, S3\n*NSET, NSET=LOWER\n1, 2, 4, 5\n" + ELASTIC + "*DENSITY\n2.\n*BOUNDARY\nLOWER, 1, 3\n"
    loads = "*DLOAD\n1, P2, 0.3\n1, GRAV, 0.1, 0., -1., 0.\nALL, BZ, 0.5\n"
    *_, last = run(tmp_path, wedge + step(loads))
    (force,) = last.supports.values()
    assert force == pytest.approx((0.0, 0.1 * 2.0 * 3.0, 0.3 * 1.0 - 0.5 * 3.0), rel=1e-8, abs=1e-10)
    (tmp_path / "d.yaml").unlink()
    loads = "*DSLOAD\nSTOP, P, 0.5\nSFRONT, TRVEC, 0.2, 3., 0., 4.\n"
    *_, last = run(tmp_path, box() + ELASTIC + "*BOUNDARY\nLEFT, 1, 3\n" + step(loads))
    (force,) = last.supports.values()
    assert force == pytest.approx((-0.2 * 0.6 * 2.0, 0.5 * 2.0, -0.2 * 0.8 * 2.0), rel=1e-8)


def test_nodal_forces_of_an_even_traction(tmp_path: Path) -> None:
    """Shares ¼, ½ and 1 of a face of four are a traction of 2 on that side; other forces are refused."""
    forces = "\n".join(
        f"{n + 1}, 1, {2.0 * (0.5 if y in (0, 1) else 1) * (0.5 if z in (0, 1) else 1) / 4}"
        for n, (x, y, z) in enumerate(bricks((2, 2, 2), (2.0, 1.0, 1.0))[0]) if x == 2.0
    )  # fmt: skip
    *_, last = run(tmp_path, box() + ELASTIC + HELD + step(f"*CLOAD\n{forces}\n"))
    (body,) = last.bodies.values()
    assert np.allclose(body.stress[:, 0], 2.0, atol=1e-8)
    with pytest.raises(FileError, match=r"line \d+: the force on node \d+: it carries .*, of an even traction"):
        case_of(box() + ELASTIC + HELD + step("*CLOAD\nRIGHT, 1, 1.\n"), "d.inp")


SPHERE = """*NODE
9001, 1., 2.5, 1.
*SURFACE, TYPE=REVOLUTION, NAME=BALL
1., 2.5, 1., 1., 3.5, 1.
START, 1.5, 0.
CIRCL, 0., -1.5, 0., 0.
*RIGID BODY, ANALYTICAL SURFACE=BALL, REF NODE=9001
"""
ROLL = """*NODE
9001, 1., 2.5, 1.
*SURFACE, TYPE=CYLINDER, NAME=ROLL
1., 2.5, 1., 2., 2.5, 1.
1., 2.5, 0.
START, -1.5, 0.
CIRCL, 0., -1.5, 0., 0.
CIRCL, 1.5, 0., 0., 0.
*RIGID BODY, ANALYTICAL SURFACE=ROLL, REF NODE=9001
"""
CONTACT = """*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE
STOP, {}
"""
PRESSED = "*BOUNDARY\n9001, 1, 1, 0.1\n9001, 2, 2, -0.1\n9001, 3, 6\n"


@pytest.mark.parametrize(("tool", "name", "native"), [
    (SPHERE, "BALL", pr.Revolved(pr.Circle(1.5), at=(1.0, 2.5, 1.0))),
    (ROLL, "ROLL", pr.Extruded(pr.Circle(1.5), at=(1.0, 2.5, 1.0))),
], ids=["ball", "roll"])  # fmt: skip
def test_analytical_surfaces_press_as_native_tools_do(tmp_path: Path, tool: str, name: str, native) -> None:
    """A ball and a roll with friction on a plastic block: the forces of the exact shapes to 1e-8."""
    material = "*MATERIAL, NAME=M\n*ELASTIC\n200000., 0.3\n*PLASTIC\n300., 0.\n500., 0.5\n"
    text = box((2.0, 1.0, 2.0), (4, 2, 4)) + material + "*BOUNDARY\nBOTTOM, 1, 3\n" + tool + CONTACT.format(name)
    *_, last = run(tmp_path, text + step(PRESSED, ", NLGEOM=YES", "0.25, 1."))
    problem = pr.Problem(
        "native", space="solid", bodies={"b": pr.Body(pr.Box((2.0, 1.0, 2.0), (4, 2, 4)), pr.J2(
            200000.0, 0.3, pr.FlowTable(((0.0, 300.0), (0.5, 500.0)))))},
        tools={"t": native}, contacts=(pr.Contact("b.top", "t", friction=pr.Coulomb(0.2)),), fixed={"b.bottom": "xyz"},
        steps=(pr.Step("press", move={"t": pr.Motion(x=0.1, y=-0.1)}, increments=4),),
    )  # fmt: skip
    *_, other = pr.solve(problem)
    ours, theirs = last.force(name), other.force("t")
    assert theirs.y > 100.0
    assert (ours.x, ours.y, ours.z) == pytest.approx((theirs.x, theirs.y, theirs.z), rel=1e-6, abs=1e-6 * theirs.y)


def test_surfaces_of_parts_go_with_their_instances(tmp_path: Path) -> None:
    """Without points a, b and c they stand along the axes of the part; an instance that is turned turns them."""
    block = "*PART, NAME=Block\n" + box((2.0, 1.0, 2.0), (1, 1, 1)) + "*END PART\n"
    part = "*PART, NAME=Ball\n*NODE, NSET=R\n1, 0., 0., 0.\n*SURFACE, TYPE=REVOLUTION, NAME=BALL\nSTART, 1.5, 0.\n" \
        "CIRCL, 0., -1.5, 0., 0.\n*RIGID BODY, ANALYTICAL SURFACE=BALL, REF NODE=R\n*END PART\n"  # fmt: skip
    placed = "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=Block-1, PART=Block\n*END INSTANCE\n*INSTANCE, NAME=Ball-1, PART=Ball\n{}" \
        "*END INSTANCE\n*END ASSEMBLY\n" + ELASTIC  # fmt: skip
    pair = CONTACT.format("Ball-1.BALL").replace("STOP", "Block-1.STOP")
    end = pair + "*BOUNDARY\nBlock-1.BOTTOM, 1, 3\n" + step("*BOUNDARY\nBall-1.R, 2, 2, -0.1\n")
    here = case_of(block + part + placed.format("1., 2.5, 1.\n") + end, "d.inp")[0]["tools"]["Ball"]
    flat = box((2.0, 1.0, 2.0), (1, 1, 1)) + ELASTIC + "*BOUNDARY\nBOTTOM, 1, 3\n" + SPHERE + CONTACT.format("BALL")
    assert here == case_of(flat + step(PRESSED), "d.inp")[0]["tools"]["BALL"]
    assert here["axis"] == [0.0, 1.0, 0.0] and here["at"] == [1.0, 2.5, 1.0]
    about_z = placed.format("1., 2.5, 1.\n1., 2.5, 1., 1., 2.5, 2., 90.\n")
    turned = case_of(block + part + about_z + end, "d.inp")[0]["tools"]["Ball"]
    assert turned["axis"] == pytest.approx([-1.0, 0.0, 0.0], abs=1e-12)
    roll = part.replace("REVOLUTION", "CYLINDER")
    made = case_of(block + roll + placed.format("1., 2.5, 1.\n") + end, "d.inp")[0]["tools"]["Ball"]
    assert made["type"] == "extruded" and made["axis"] == [0.0, 0.0, -1.0]


@pytest.mark.parametrize("kind", ["CYLINDER", "REVOLUTION"])
@pytest.mark.parametrize("seed", range(3))
def test_profiles_stand_where_the_deck_has_them(kind: str, seed: int) -> None:
    """Points of an uneven profile in any direction of space lie on the tool, and the body beside it outside."""
    rng = np.random.default_rng(seed)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    ex, generator = frame[0], frame[1]
    ey = np.cross(-generator, ex)
    a = np.array([1.0, 4.0, 1.0]) if kind == "CYLINDER" else np.array([1.0, 0.5, 1.0]) + 3.0 * ex
    corners = np.array([(0.5, 0.3), (1.2, 0.0), (2.0, 0.4), (2.0, 1.5)])
    rows = "\n".join(f"{'START' if k == 0 else 'LINE'}, {x}, {y}" for k, (x, y) in enumerate(corners))
    points = [a, a + ex, *([a + generator] if kind == "CYLINDER" else [])]
    places = [", ".join(f"{c:.15g}" for c in p) for p in points]
    head = f"{places[0]}, {places[1]}\n" + "".join(f"{p}\n" for p in places[2:])
    surface = f"*SURFACE, TYPE={kind}, NAME=Q\n{head}{rows}\n*RIGID BODY, ANALYTICAL SURFACE=Q, REF NODE=9001\n"
    reference = a + (0.7 * ex if kind == "REVOLUTION" else [0.3, -0.2, 0.5])
    node = "*NODE\n9001, " + ", ".join(f"{c:.15g}" for c in reference) + "\n"
    text = box((2.0, 1.0, 2.0), (1, 1, 1)) + ELASTIC + "*BOUNDARY\nBOTTOM, 1, 3\n" + node + surface + CONTACT.format("Q")
    described = case_of(text + step("*BOUNDARY\n9001, 1, 6\n"), "d.inp")[0]["tools"]["Q"]
    swept = pr.Extruded if kind == "CYLINDER" else pr.Revolved
    tool = swept(pr.Profile(points=tuple(map(tuple, described["section"]["points"]))), tuple(described["axis"]))
    along = corners[:-1] + 0.4 * np.diff(corners, axis=0)
    if kind == "CYLINDER":
        on = a + along @ np.stack([ex, ey]) + rng.normal(size=(3, 1)) * generator
    else:
        other = np.cross(ex, generator)
        t = rng.uniform(0.0, 6.0, (3, 1))
        on = a + along[:, 1:] * ex + along[:, :1] * (np.cos(t) * generator + np.sin(t) * other)
    shape = tool.shape(np.array([0.0, -1.0, 0.0]), 0.0)
    assert np.abs(shape.closest(on - reference).g).max() < 1e-9
    assert shape.closest(np.array([[1.0, 0.5, 1.0]]) - reference).g[0] > 0.0


PLATE = """*NODE
8001, -1., 1., -1.
8002, 3., 1., -1.
8003, 3., 1., 3.
8004, -1., 1., 3.
9001, 1., 2., 1.
*ELEMENT, TYPE=R3D4, ELSET=PLATE
8001, 8001, 8002, 8003, 8004
*RIGID BODY, ELSET=PLATE, REF NODE=9001
*SURFACE, NAME=SPLATE
PLATE, SNEG
*CONTACT PAIR, INTERACTION=I
STOP, SPLATE
*SURFACE INTERACTION, NAME=I
"""


def test_rigid_elements_become_a_tool_of_triangles(tmp_path: Path) -> None:
    """A plate of one R3D4, whichever way its normal looks, presses as a plane does: E ε A; a force of its node too."""
    base = box() + ELASTIC + HELD
    for k, plate in enumerate((PLATE, PLATE.replace("8001, 8002, 8003, 8004\n", "8004, 8003, 8002, 8001\n"))):
        (tmp_path / f"{k}").mkdir()
        *_, last = run(tmp_path / f"{k}", base + plate + step("*BOUNDARY\n9001, 2, 2, -0.01\n9001, 1, 1\n9001, 3, 6\n"))
        assert last.force("PLATE").y == pytest.approx(0.01 * 1000.0 * 2.0, rel=0.01)  # penalty
        assert (tmp_path / f"{k}" / "d-PLATE.stl").exists()
    (tmp_path / "p").mkdir()
    pushed = "*BOUNDARY\n9001, 1, 1\n9001, 3, 6\n*CLOAD\n9001, 2, -20.\n"
    *_, last = run(tmp_path / "p", base + PLATE + step(pushed))
    assert last.tools["PLATE"].place.y == pytest.approx(-0.01, rel=1e-2)
    (tmp_path / "q.inp").write_text(base + PLATE + step(pushed))
    with pytest.raises(pr.PrensaError, match=r"line \d+: the rigid elements of 'PLATE' become an STL file: give --out"):
        case_text(tmp_path / "q.inp", tmp_path)


def test_symmetry_words_and_steps(tmp_path: Path) -> None:
    """XSYMM, YSYMM and ZSYMM hold one component each of a body; amplitudes, OP=NEW and FIXED follow one another."""
    held = "*BOUNDARY\nLEFT, XSYMM\nBOTTOM, YSYMM\nBACK, ZSYMM\n"
    amplitude = "*AMPLITUDE, NAME=A\n0., 0., 0.5, 1., 1., 0.\n"
    steps = step("*DSLOAD, AMPLITUDE=A\nSRIGHT, P, -3.\n", static="0.5, 1.") + step("*DSLOAD, OP=NEW\nSTOP, P, 2.\n")
    half, full, last = run(tmp_path, box() + ELASTIC + amplitude + held + steps)
    stress = [next(iter(i.bodies.values())).stress[0, :2] for i in (half, full, last)]
    assert np.allclose(stress, [(3.0, 0.0), (0.0, 0.0), (0.0, -2.0)], atol=1e-8)


C3D20 = f"*ELEMENT, TYPE=C3D20\n90, {listed(range(1, 9))}, {listed(range(9, 21))}\n*SOLID"
C3D4 = "*ELEMENT, TYPE=C3D4\n90, 1, 2, 3, 5\n*SOLID"


@pytest.mark.parametrize(("old", "new", "words"), [
    ("*SOLID", C3D20, "C3D20 have no counterpart here; mesh it with elements of the first order"),
    ("*SOLID", C3D4, "C3D4 have no counterpart here; mesh it with tetrahedra of second order"),
    ("TYPE=C3D8,", "TYPE=C3D8T,", "have a temperature, which is not read"),
    ("RIGHT, 1, 1, 0.02", "1, 1, 1, 0.02\n1, 11, 11, 5.", "degree of freedom 11 is not a displacement"),
    ("RIGHT, 1, 1, 0.02", "NALL, 1, 1, 0.02", "is on no side of"),
    ("*END STEP", "*CLOAD\n1, 4, 2.\n*END STEP", "are read along 1, 2 and 3"),
    ("*END STEP", "*DLOAD\nALL, CENTRIF, 2.\n*END STEP", "P1 … P6, GRAV, BX, BY and BZ are read"),
    ("*END STEP", "*DLOAD\nALL, P7, 2.\n*END STEP", "not 'P7'"),
    ("*STEP", "*SURFACE, TYPE=SEGMENTS, NAME=Q\nSTART, 0., 0.\nLINE, 1., 0.\n*STEP", "in space write CYLINDER or REVOLUTION"),
    ("*STEP", "*SURFACE, TYPE=CYLINDER, NAME=Q\n0., 0., 0.\nSTART, 0., 0.\nLINE, 1., 0.\n*STEP", "is given by points"),
    ("*STEP", ROLL.replace("1., 2.5, 0.\n", "2., 2.5, 1.\n") + "*STEP", "which has to be across its x axis"),
    ("*STEP", SPHERE.replace("9001, 1., 2.5", "9001, 1.5, 2.5") + "*STEP", "is off the axis of revolution: put it there"),
    ("*STEP", "*EQUATION\n3\n1, 1, 1., 2, 1, 1., 3, 2, 1.\n*STEP", "only equations along one component are read"),
])  # fmt: skip
def test_what_changes_the_answer_is_refused(old: str, new: str, words: str) -> None:
    """With its line and what to do."""
    text = box() + ELASTIC + HELD + step("*BOUNDARY\nRIGHT, 1, 1, 0.02\n")
    with pytest.raises(FileError, match=rf"line \d+: .*{words}".replace("(", r"\(")):
        case_of(text.replace(old, new, 1), "d.inp", files={})
