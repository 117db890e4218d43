"""Small decks in the dialects of Abaqus, CalculiX and their preprocessors: read right by statics and by meshio, or refused."""

from __future__ import annotations

import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.cli import app
from prensa.importers import abaqus
from prensa.importers.abaqus_case import case_of
from prensa.importers.deck import FileError
from prensa.model.schema import load

W, H, NX, NY = 8.0, 4.0, 4, 2
ELASTIC = "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
STEP = "*STEP, NLGEOM\n*STATIC\n0.5, 1.\n"
FLAT = "*SURFACE, NAME=FLAT, TYPE=SEGMENTS\nSTART, 40., 4.\nLINE, -40., 4.\n*RIGID BODY, ANALYTICAL SURFACE=FLAT, REF NODE=900\n"
DRY = "*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n0.2\n"
PAIR = "*CONTACT PAIR, INTERACTION=DRY\nSTOP, FLAT\n"
PRESS = "900, 1, 1\n900, 6, 6\n900, 2, 2, -0.1\n"


def mesh(kind: str = "CPE4", nx: int = NX, ny: int = NY, first: int = 1, x0: float = 0.0, y0: float = 0.0, size=(W, H)) -> str:
    """Nodes by rows from the lower left and elements; quadratic ones have every second node at the middle of sides."""
    n = 2 if kind[3] == "8" else 1
    label = {}
    for j in range(n * ny + 1):
        for i in range(n * nx + 1):
            if n == 1 or not (i % 2 and j % 2):
                label[i, j] = first + len(label)
    nodes = [f"{k}, {x0 + size[0] * i / (n * nx)}, {y0 + size[1] * j / (n * ny)}" for (i, j), k in label.items()]
    cells = []
    for j in range(0, n * ny, n):
        for i in range(0, n * nx, n):
            places = [(i, j), (i + n, j), (i + n, j + n), (i, j + n)]
            if n == 2:
                places += [(i + 1, j), (i + 2, j + 1), (i + 1, j + 2), (i, j + 1)]
            cells.append(", ".join(map(str, [first + len(cells), *(label[p] for p in places)])))
    return "\n".join(["*NODE", *nodes, f"*ELEMENT, TYPE={kind}, ELSET=E{first}", *cells, ""])


def numbers(row: int, nx: int = NX) -> list[int]:
    """Nodes of a row of a linear mesh."""
    return [1 + row * (nx + 1) + i for i in range(nx + 1)]


SETS = (
    "*NSET, NSET=BOT, GENERATE\n1, 5, 1\n*NSET, NSET=TOP, GENERATE\n11, 15, 1\n*NSET, NSET=LEFT, GENERATE\n1, 11, 5\n"
    "*SURFACE, NAME=STOP\n5, S3\n6, S3\n7, S3\n8, S3\n*SOLID SECTION, ELSET=E1, MATERIAL=M\n1.\n"
)
BLOCK = mesh() + SETS + ELASTIC
PRESSED = BLOCK + "*NODE, NSET=REF\n900, 0., 4.\n" + FLAT + DRY + PAIR + STEP + "*BOUNDARY\nBOT, 1, 2\n" + PRESS + "*END STEP\n"


def read(tmp_path: Path, text: str, *options: str):
    """The problem of a deck, and what the import said."""
    deck = tmp_path / f"job{len(list(tmp_path.iterdir()))}.inp"  # one each, since the mesh is read when the case is solved
    deck.write_text(text)
    out = deck.with_suffix(".yaml")
    done = CliRunner().invoke(app, ["import", str(deck), "--out", str(out), *options])
    assert done.exit_code == 0, done.output
    return load(out).problem, done.stderr


def refused(tmp_path: Path, text: str, message: str, *options: str) -> None:
    (tmp_path / "job.inp").write_text(text)
    done = CliRunner().invoke(app, ["import", str(tmp_path / "job.inp"), *options])
    assert done.exit_code == 2 and re.search(rf"job\.inp: line \d+: .*{message}", done.output), done.output


def end(problem):
    (*_, last) = pr.solve(problem)
    return last


def force(problem) -> tuple[float, float]:
    """On the only tool of a problem, at the end."""
    (name,) = problem.tools
    found = end(problem).force(name)
    return found.x, found.y


def close(found: tuple[float, float], want: tuple[float, float]) -> bool:
    """Alike to the digits of a converged increment."""
    return found == pytest.approx(want, rel=1e-8, abs=1e-8 * abs(want[1]))


def reaction(inc, body: str, below: float = 1e-9) -> np.ndarray:
    """Sum of the support forces on the lower side."""
    b = inc.bodies[body]
    return b.reaction[b.X[:, 1] < below].sum(axis=0)


# ------------------------------------------------------------------------------------------------------------- keywords
@pytest.mark.parametrize(
    "written", ["*SURFACEINTERACTION", "*Surface  Interaction", "*surface interaction", "* SURFACE INTERACTION"]
)
def test_blanks_and_case_of_keywords_say_nothing(tmp_path, written):
    """The friction that hangs on the keyword is kept; parameters likewise."""
    text = PRESSED.replace("*SURFACE INTERACTION", written).replace("REF NODE=", "refnode = ")
    problem, said = read(tmp_path, text)
    assert problem.contacts[0].friction == pr.Coulomb(0.2) and "not" not in said


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("*SURFACE INTERACTION", "*SURFACE INTERACTON"), r"\*SURFACE INTERACTON is not known; did you mean \*SURFACE INTERACT"),
        (("*FRICTION", "*FRICTON"), r"\*FRICTON is not known; did you mean \*FRICTION"),
        (("*CONTACT PAIR", "*CONTACT PAIRS"), r"\*CONTACT PAIRS is not known; did you mean \*CONTACT PAIR\?"),
        (("*BOUNDARY", "*BOUNDRY"), r"\*BOUNDRY is not known; did you mean \*BOUNDARY"),
        (("*ELEMENT", "*ELMENT"), r"\*ELMENT is not a keyword; did you mean \*ELEMENT"),
        (("INTERACTION=DRY", "INTERACTON=DRY"), r"INTERACTON of \*CONTACT PAIR is not read; did you mean INTERACTION"),
        (("INTERACTION=DRY", "INTERACTION=WET"), "there is no .SURFACE INTERACTION 'WET'"),
        (("*FRICTION\n", "*MATERIAL, NAME=N\n*FRICTION\n"), r"\*FRICTION belongs to no \*SURFACE INTERACTION"),
        (("STOP, FLAT", "STOP, FALT"), "'FALT' is not an analytical rigid surface"),
        (("*END STEP", "*FLOW RATE\n*END STEP"), r"\*FLOW RATE is not known.*--without 'flow rate'"),
        (("*CONTACT PAIR, ", "*CONTACT PAIR, ADJUST=0.1, "), "ADJUST=0.1 is not read.*--without adjust"),
        (("*CONTACT PAIR, ", "*CONTACT PAIR, SMALL SLIDING, "), "SMALL SLIDING is not read.*--without small-sliding"),
        (("*STEP, NLGEOM", "*STEP, NLGEOM, AMPLITUDE=STEP"), "AMPLITUDE=STEP of a step is not read.*RAMP"),
        (("*END STEP", "*TEMPERATURE\nBOT, 300.\n*END STEP"), r"\*TEMPERATURE is not read.*--without temperature"),
        (("*END STEP", "*SPRING\nBOT, 300.\n*END STEP"), r"\*SPRING is not read.*leaves out: adjust, damage, inertia"),
        (("*STEP, NLGEOM", "*STEP\n*STATIC\n*END STEP\n*STEP, NLGEOM"), "NLGEOM begins in a later step"),
        (("*NODE\n", "*NODE, INPUT=nodes.txt\n"), "there is no file 'nodes.txt' in .*; paths are relative to the deck"),
        (("900, 2, 2, -0.1\n", "900, 2, 2, -0.1\nTOP, 11, 11, 300.\n"), "degree of freedom 11 is not a displacement"),
        (("\n2, 2, 3, 8, 7\n", "\n1, 2, 3, 8, 7\n"), "element 1 stands before with other nodes"),
        (("*ELEMENT", "*NODE\n3, 4.5, 0.\n*ELEMENT"), "node 3 stands before at another place"),
        (("TYPE=CPE4", "TYPE=CPS3"), "elements CPS3 have 3 nodes; 5 numbers are not rows of 4: '1, 1, 2, 7, 6'"),
        (("*NODE\n", "1, 0., 0.\n*NODE\n"), "'1, 0., 0.' stands before any keyword"),
        (("STOP, FLAT", "STOP,"), "contact of 'STOP' with itself is not read"),
        ((", REF NODE=900", ""), "a reference node is missing; name it: REF NODE="),
        (("*ELASTIC\n1000., 0.3", "*HYPERELASTIC, OGDEN\n1., 2."), "OGDEN of .HYPERELASTIC is not read; MODULI, NEO HOOKE are"),
        (("*ELEMENT, TYPE=CPE4", "*ELEMENT, TYPE=CPE4T"), "CPE4T have a temperature.*--without temperature"),
    ],
)  # fmt: skip
def test_what_hangs_on_an_unknown_word_does_not_fall_away(tmp_path, change, message):
    """Slips in keywords, parameters and names are refused with their line and the nearest known word."""
    assert change[0] in PRESSED
    refused(tmp_path, PRESSED.replace(*change, 1), message)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_decks_of_any_encoding_are_read(tmp_path, encoding):
    """A mark at the beginning is no part of the first keyword, of the mesh neither; letters of comments need not be right."""
    (tmp_path / "job.inp").write_bytes(("*NODE" + PRESSED.partition("*NODE")[2].replace("*END STEP", "** Ø 5")).encode(encoding))
    done = CliRunner().invoke(app, ["import", str(tmp_path / "job.inp"), "--out", str(tmp_path / "job.yaml")])
    assert done.exit_code == 0, done.output
    assert close(force(load(tmp_path / "job.yaml").problem), force(read(tmp_path, PRESSED)[0]))


def test_a_letter_too_few_in_any_keyword_or_parameter_is_refused(tmp_path):
    """Each word of keyword lines in turn, the last letter dropped: none falls away."""
    words = 0
    for text in (PRESSED, PREPOMAX.format(mesh=(mesh() + mesh("CPE4", 2, 1, 901, -4.0, 4.0, (16.0, 3.0))).strip())):
        case_of(text, "job.inp")
        lines = text.splitlines()
        for i, line in enumerate(lines):
            if not line.startswith("*") or line.startswith("**"):
                continue
            for name in [part.partition("=")[0].rstrip() for part in line.split(",")]:
                slip = "\n".join([*lines[:i], line.replace(name, name[:-1], 1), *lines[i + 1 :]])
                with pytest.raises(FileError, match=r"line \d+|no plane elements"):
                    case_of(slip, "job.inp")
                words += 1
    assert words > 80


def test_what_the_user_names_is_left_out_and_said(tmp_path):
    """One option for each thing; what cannot be left out is answered with the list."""
    text = PRESSED.replace("TYPE=CPE4,", "TYPE=CPE4T,").replace("*CONTACT PAIR, ", "*CONTACT PAIR, ADJUST=0.1, ")
    text = text.replace("*END STEP", "*TEMPERATURE\nBOT, 300.\n*BOUNDARY\nTOP, 11, 11, 300.\n*FLOW RATE\n1.\n*END STEP")
    text = text.replace("*STATIC\n0.5, 1.", "*COUPLED TEMPERATURE-DISPLACEMENT, DELTMX=10.\n0.5, 2.")
    options = [w for what in ("temperature", "adjust", "flow rate") for w in ("--without", what)]
    problem, said = read(tmp_path, text, *options)
    assert problem.bodies["E1"].element == "q4_fbar" and problem.steps[0].duration == 2.0
    static = r"read as a static step \(--without temperature\)"
    for word in (r"\*TEMPERATURE is left out", static, "--without adjust", "FLOW RATE"):
        assert re.search(rf"line \d+: .*{word}", said), said
    (tmp_path / "job.inp").write_text(PRESSED)
    done = CliRunner().invoke(app, ["import", str(tmp_path / "job.inp"), "--without", "friction"])
    assert done.exit_code == 2 and re.search("'friction': this cannot be left out; what can is: adjust, damage", done.output)


def test_a_dynamic_step_without_inertia_is_a_static_one(tmp_path):
    """An explicit step, its smooth amplitude and mass scaling; refused without the option."""
    text = PRESSED.replace("*STATIC\n0.5, 1.", "*DYNAMIC, EXPLICIT\n, 0.02\n*BULK VISCOSITY\n0.06, 1.2")
    text = text.replace("*STEP", "*AMPLITUDE, NAME=A, DEFINITION=SMOOTH STEP\n0., 0., 0.02, 1.\n*STEP")
    text = text.replace("900, 2, 2, -0.1", "*BOUNDARY, AMPLITUDE=A\n900, 2, 2, -0.1")
    refused(tmp_path, text, r"\*DYNAMIC is not read.*--without inertia")
    problem, said = read(tmp_path, text, "--without", "inertia")
    assert problem.steps[0].duration == 0.02 and problem.steps[0].move["FLAT"].y == ((0.0, 0.0), (1.0, -0.1))
    assert "SMOOTH STEP" in said and "BULK VISCOSITY is left out" in said


# ---------------------------------------------------------------------------------------------------------- node numbers
def test_node_numbers_and_sets_hold_the_same(tmp_path):
    """Rows of *BOUNDARY by number: those that make a side are that side, single ones points, also inside of the body."""
    rows = "".join(f"{n}, 1, 2\n" for n in numbers(0))
    by_number, _ = read(tmp_path, PRESSED.replace("BOT, 1, 2\n", rows).replace("*NSET, NSET=BOT, GENERATE\n1, 5, 1\n", ""))
    by_set, _ = read(tmp_path, PRESSED)
    assert list(by_number.steps[0].fixed) != list(by_set.steps[0].fixed)
    want = force(by_set)
    assert close(force(by_number), want) and want[1] > 100.0

    alone, _ = read(tmp_path, PRESSED.replace("BOT, 1, 2\n", "BOT, 2, 2\n1, 1\n5, 1\n8, 1\n"))
    assert {"E1.node-1", "E1.node-5", "E1.node-8"} <= set(alone.steps[0].fixed)
    inc = end(alone)
    moved = np.abs(inc.bodies["E1"].displacement[:, 0])
    assert moved[[0, 4, 7]].max() == 0.0 and moved[[1, 5, 6, 8]].min() > 1e-6


def test_what_a_deck_does_not_prescribe_of_a_tool_is_free(tmp_path):
    """A reference node without a row for its rotation turns; one that is held does not, and both are said or not."""
    problem, said = read(tmp_path, PRESSED.replace("900, 6, 6\n", ""))
    assert problem.steps[0].push["FLAT"].m == 0.0 and "FLAT is free to turn" in said
    assert not read(tmp_path, PRESSED)[0].steps[0].push


def test_a_set_with_reference_nodes_in_it_holds_tools_and_bodies(tmp_path):
    """A tool's node in a set of the body's; two tools in one set; a motion before the first step is refused."""
    text = PRESSED.replace("900, 1, 1\n", "").replace("BOT, 1, 2", "BOT, 2, 2\nLEFT, 1, 1")
    held, said = read(tmp_path, text.replace("11, 5\n", "11, 5\n*NSET, NSET=LEFT\n900\n", 1))
    assert "free" not in said and not held.steps[0].push
    free, said = read(tmp_path, text)
    assert "FLAT is free to move along x" in said and free.steps[0].push["FLAT"].x == 0.0
    low = "*NODE, NSET=TWO\n910, 0., 0.\n*NSET, NSET=TWO\n900\n"
    low += "*SURFACE, NAME=LOW, TYPE=SEGMENTS\nSTART, -40., 0.\nLINE, 40., 0.\n"
    low += "*RIGID BODY, ANALYTICAL SURFACE=LOW, REF NODE=910\n"
    both = "TWO, 1, 1\nTWO, 6, 6\n910, 2, 2\n"
    two, said = read(tmp_path, PRESSED.replace(DRY, low + DRY).replace("900, 1, 1\n900, 6, 6\n", both))
    assert len(two.tools) == 2 and "free" not in said and two.steps[0].move["FLAT"].y == -0.1
    refused(tmp_path, PRESSED.replace("*STEP", "*BOUNDARY\n900, 2, 2, -0.1\n*STEP"), "before the first step: write it into")
    later = PRESSED.replace(PAIR, "") + STEP + PAIR + "*END STEP\n"
    refused(tmp_path, later, "a contact that begins in a later step")


def test_a_deck_without_contact_has_none(tmp_path):
    """A tool that moves through the body without a contact pair meets nothing."""
    problem, _ = read(tmp_path, PRESSED.replace(PAIR, ""))
    assert end(problem).force("FLAT").y == 0.0


# ----------------------------------------------------------------------------------------------------------------- loads
SMALL = STEP.replace(", NLGEOM", "")


@pytest.mark.parametrize("kind", ["CPE4", "CAX4", "CPS8R", "CAX8"])
def test_pressure_on_faces_and_surfaces_and_nodal_forces_are_one_load(tmp_path, kind):
    """*DLOAD by element and by set, *DSLOAD, and the nodal forces of an even traction: same reaction, that of statics."""
    wide, thick = (9, 1.0) if kind[3] == "8" else (5, 1.0)
    if kind.startswith("CPS"):
        thick = 0.5
    first = {5: 11, 9: 29}[wide]
    top = range(first, first + wide)
    text = mesh(kind) + f"*NSET, NSET=BOT, GENERATE\n1, {wide}, 1\n*NSET, NSET=TOP, GENERATE\n{top[0]}, {top[-1]}, 1\n"
    text += f"*ELSET, ELSET=UP\n5, 6, 7, 8\n*SURFACE, NAME=STOP\nUP, S3\n*SOLID SECTION, ELSET=E1, MATERIAL=M\n{thick}\n"
    text += ELASTIC + SMALL + "*BOUNDARY\nBOT, 1, 2\n"
    round_axis = kind.startswith("CAX")
    area = np.pi * W**2 if round_axis else thick * W
    forces = nodal_forces(wide, kind, -3.0, thick)
    assert forces.sum() == pytest.approx(-3.0 * area)
    loads = {
        "faces": "*DLOAD\n5, P3, 3.\n6, P3, 3.\n7, P3, 3.\n8, P3, 3.\n", "set": "*DLOAD\nUP, P3, 3.\n",
        "surface": "*DSLOAD\nSTOP, P, 3.\n",
        "nodes": "*CLOAD\n" + "".join(f"{n}, 2, {f!r}\n" for n, f in zip(top, forces.tolist())),
    }  # fmt: skip
    moved = {}
    for name, rows in loads.items():
        problem, _ = read(tmp_path, text + rows + "*END STEP\n")
        inc = end(problem)
        assert reaction(inc, "E1")[1] == pytest.approx(3.0 * area, rel=1e-7 if name == "nodes" else 1e-9), name
        moved[name] = inc.bodies["E1"].displacement
    for name, u in moved.items():
        assert u == pytest.approx(moved["surface"], abs=1e-7 * np.abs(u).max()), name
    inner = forces.tolist()[1]
    uneven = loads["nodes"].replace(f"{inner!r}", f"{1.01 * inner!r}", 1)
    refused(tmp_path, text + uneven + "*END STEP\n", r"the force on node \d+: it carries .* of an even traction")


def nodal_forces(wide: int, kind: str, traction: float, thick: float) -> np.ndarray:
    """Those of an even traction, with many points along each side."""
    x = np.linspace(0.0, W, wide)
    out, per = np.zeros(wide), 2 if kind[3] == "8" else 1
    s = (np.arange(4000) + 0.5) / 4000
    for a in range(0, wide - 1, per):
        shapes = [(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)] if per == 2 else [1 - s, s]
        length = x[a + per] - x[a]
        weight = 2 * np.pi * (x[a] + s * length) if kind.startswith("CAX") else thick
        for i, shape in enumerate(shapes):
            out[a + i] += traction * length * (shape * weight).mean()
    return np.round(out, 7)


def test_tractions_of_surfaces_are_dead_loads(tmp_path):
    """A vector and a shear along a straight side; refused where they would turn, cross the side, or meet a pressure."""
    text = BLOCK + SMALL + "*BOUNDARY\nBOT, 1, 2\n*DSLOAD\nSTOP, {}\n*END STEP\n"
    for row, want in (("TRVEC, 2., 3., -4., 0.", (1.2, -1.6)), ("TRSHR, 2., -3., 0., 0.", (-2.0, 0.0))):
        inc = end(read(tmp_path, text.format(row))[0])
        assert reaction(inc, "E1") == pytest.approx(-W * np.array(want), rel=1e-9, abs=1e-9)
    refused(tmp_path, text.format("TRSHR, 2., -3., 1., 0."), "a traction TRSHR is read along")
    refused(tmp_path, text.format("TRVEC, 2., 1., 0., 0.").replace("*STEP", "*STEP, NLGEOM"), "with NLGEOM=NO or FOLLOWER=NO")
    refused(tmp_path, text.format("P, 1.\n*DSLOAD\nSTOP, TRVEC, 2., 1., 0., 0."), "'E1.STOP' has a pressure and a traction")
    refused(tmp_path, text.format("HP, 1., 0., 3."), "not 'HP'")


def test_gravity_and_forces_per_volume_are_weights(tmp_path):
    """The supports carry density times g times volume; a second load along x; a load without density is refused."""
    text = BLOCK.replace("*ELASTIC", "*DENSITY\n2e-3,\n*ELASTIC") + SMALL + "*BOUNDARY\nBOT, 1, 2\n"
    both = "*DLOAD\nE1, GRAV, 9.81, 0., -2., 0.\nE1, BX, 0.5\n*END STEP\n"
    inc = end(read(tmp_path, text + both)[0])
    assert reaction(inc, "E1") == pytest.approx((-0.5 * W * H, 2e-3 * 9.81 * W * H), rel=1e-9)
    refused(tmp_path, BLOCK + SMALL + both, "gravity on 'E1', whose material has no .DENSITY")
    refused(tmp_path, text + "*DLOAD\n5, GRAV, 9.81, 0., -1.\n*END STEP\n", "'5' is a part of 'E1'")
    refused(tmp_path, text + "*DLOAD\nE1, CENTRIF, 1e4, 0., 0., 0., 0., 1., 0.\n*END STEP\n", "not 'CENTRIF'")


def test_op_new_ends_loads_that_are_not_said_again(tmp_path):
    """*DLOAD of faces and of volumes and *CLOAD each by their own."""
    first = "*BOUNDARY\nBOT, 1, 2\n*DLOAD\n5, P3, 3.\nE1, BY, -1.\n*CLOAD\n11, 1, 1.\n6, 1, 2.\n1, 1, 1.\n*END STEP\n"
    second = "*STEP\n*STATIC\n*DLOAD, OP=NEW\nE1, BY, -2.\n*CLOAD, OP=NEW\n*END STEP\n"
    problem, _ = read(tmp_path, BLOCK + SMALL + first + second)
    one, two = problem.steps
    (face,) = (name for name, load in one.loads.items() if load.pressure == 3.0)
    assert one.loads["E1.LEFT"].traction == pytest.approx((1.0, 0.0)) and two.loads["E1.LEFT"].traction == (0.0, 0.0)
    assert two.loads[face].pressure == 0.0
    assert one.body_force["E1"] == (0.0, -1.0) and two.body_force["E1"] == (0.0, -2.0)


# ---------------------------------------------------------------------------------------------------------- rigid bodies
def rigid(name: str) -> str:
    """The flat tool above the block in five dialects; its reference node is 900."""
    line = "*NODE\n901, -4., 4.\n902, 3., 4.\n903, 12., 4.\n*ELEMENT, TYPE={0}, ELSET=TOOL\n901, 903, 902\n902, 902, 901\n"
    solid = mesh("CPE4", 2, 1, 901, -4.0, 4.0, (16.0, 3.0))
    top = "*SURFACE, NAME=FACE\nE901, S1\n"
    return {
        "R2D2": line.format("R2D2") + "*SURFACE, NAME=FACE\nTOOL, SPOS\n*RIGID BODY, ELSET=TOOL, REF NODE=900\n",
        "B21": line.format("B21") + "*BEAM SECTION, ELSET=TOOL, MATERIAL=M, SECTION=RECT\n1., 1.\n0., 0., -1.\n"
        "*SURFACE, NAME=FACE\nTOOL, SPOS\n*RIGID BODY, ELSET=TOOL, REF NODE=900\n",
        "solid": solid + top + "*SOLID SECTION, ELSET=E901, MATERIAL=M\n1.\n*RIGID BODY, ELSET=E901, REF NODE=900\n",
        "nodes": solid + top + "*SOLID SECTION, ELSET=E901, MATERIAL=M\n1.\n*NSET, NSET=ALLOF, GENERATE\n901, 906, 1\n"
        "*NODE\n899, 0., 4.\n*RIGID BODY, NSET=ALLOF, REF NODE=900, ROT NODE=899\n",
    }[name]  # fmt: skip


@pytest.mark.parametrize("name", ["R2D2", "B21", "solid", "nodes"])
def test_rigid_elements_are_the_tool_that_an_analytical_surface_is(tmp_path, name):
    """Chains of lines, beams, plane elements, and all nodes of plane elements (CalculiX): the same force as under a line."""
    pair = "*CONTACT PAIR, INTERACTION=DRY, TYPE=NODE TO SURFACE\nSLAVE, FACE\n"
    slave = "*SURFACE, NAME=SLAVE, TYPE=NODE\nTOP,\n"
    text = PRESSED.replace(FLAT, rigid(name) + slave).replace(PAIR, pair)
    if name == "nodes":
        text = text.replace("900, 6, 6\n", "899, 3, 3\n")
    problem, said = read(tmp_path, text)
    assert list(problem.bodies) == ["E1"] and len(problem.tools) == 1 and "free" not in said
    want = force(read(tmp_path, PRESSED)[0])
    assert close(force(problem), want) and want[1] > 100.0


def test_a_rigid_section_around_the_axis_has_no_corner_there(tmp_path):
    """The outline of an axisymmetric punch is open at the axis: the force is that under a chain RAX2."""
    text = PRESSED.replace("CPE4", "CAX4").replace("BOT, 1, 2", "BOT, 2, 2\nLEFT, 1, 1")
    punch = mesh("CAX4", 3, 1, 901, 0.0, 4.0, (16.0, 3.0)) + "*SURFACE, NAME=FACE\nE901, S1\n"
    punch += "*RIGID BODY, ELSET=E901, REF NODE=900\n"
    lines = "*NODE\n901, 0., 4.\n902, 16., 4.\n*ELEMENT, TYPE=RAX2, ELSET=TOOL\n901, 901, 902\n*SURFACE, NAME=FACE\nTOOL, SNEG\n"
    lines += "*RIGID BODY, ELSET=TOOL, REF NODE=900\n"
    forces = []
    for tool in (punch, lines):
        problem, _ = read(tmp_path, text.replace(FLAT, tool).replace("STOP, FLAT", "STOP, FACE"))
        forces.append(force(problem))
    assert close(*forces) and forces[1][1] > 1000.0


@pytest.mark.parametrize("lines", [False, True])
def test_the_rigid_half_of_a_half_model_has_no_corner_on_the_line_of_symmetry(tmp_path, lines):
    """Neither where its outline is that of plane elements nor of lines all around: the force is that under a straight surface."""
    text = PRESSED.replace("BOT, 1, 2", "BOT, 2, 2\nLEFT, XSYMM").replace("STOP, FLAT", "STOP, FACE")
    tool = mesh("CPE4", 3, 1, 901, 0.0, 4.0, (16.0, 3.0)) + "*SURFACE, NAME=FACE\nE901, S1\n"
    tool += "*RIGID BODY, ELSET=E901, REF NODE=900\n"
    if lines:
        tool = "*NODE\n901, 0., 4.\n902, 16., 4.\n903, 16., 7.\n904, 0., 7.\n*ELEMENT, TYPE=R2D2, ELSET=TOOL\n"
        tool += "901, 901, 902\n902, 902, 903\n903, 903, 904\n904, 904, 901\n*SURFACE, NAME=FACE\nTOOL, SNEG\n"
        tool += "*RIGID BODY, ELSET=TOOL, REF NODE=900\n"
    problem, _ = read(tmp_path, text.replace(FLAT, tool))
    want = force(read(tmp_path, text.replace("STOP, FACE", "STOP, FLAT"))[0])
    assert not next(iter(problem.tools.values())).closed and close(force(problem), want) and want[1] > 100.0


def test_stiffness_stick_slope_and_shear_limit_of_a_contact_are_read(tmp_path):
    """The overlap is pressure over stiffness; the shear force of a sliding tool is the limit times the length."""
    text = PRESSED.replace("*FRICTION\n0.2\n", "*FRICTION\n0.2, 500.\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e4, 3.\n")
    (contact,) = read(tmp_path, text)[0].contacts
    assert (contact.enforcement.k_n, contact.enforcement.k_T) == (1e4, 500.0)
    soft = text.replace("1e4, 3.", "100.").replace("*FRICTION\n0.2, 500.\n", "").replace("BOT, 1, 2", "BOT, 2, 2\n1, 1, 1")
    # A block between smooth plates in series with the bed of stiffness k: plane strain modulus E/(1 − ν²).
    inc = end(read(tmp_path, soft.replace("*STEP, NLGEOM", "*STEP"))[0])
    assert inc.force("FLAT").y == pytest.approx(0.1 * W / (H * (1 - 0.09) / 1000.0 + 1 / 100.0), rel=1e-9)

    limit = PRESSED.replace("*FRICTION", "*FRICTION, TAUMAX=2.").replace("900, 1, 1\n", "900, 1, 1, 0.5\n")
    problem, _ = read(tmp_path, limit.replace("900, 2, 2, -0.1", "900, 2, 2, -0.4"))
    inc = end(problem)
    x = inc.bodies["E1"].x[10:15]
    along = inc.force("FLAT").x
    assert inc.force("FLAT").y > 2.0 * W / 0.2 and abs(along) == pytest.approx(2.0 * np.hypot(*(x[-1] - x[0])), rel=0.01)
    for law in ("EXPONENTIAL\n0.01, 10.", "TABULAR\n0., 0.\n10., 0.1"):
        bed = PRESSED.replace("0.2\n", f"0.2\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={law}\n", 1)
        refused(tmp_path, bed, "is not read; LINEAR and HARD are.*--without softened-contact")
        assert read(tmp_path, bed, "--without", "softened-contact")[0].contacts[0].friction == pr.Coulomb(0.2)


# --------------------------------------------------------------------------------------------------------- constraints
FOLLOWING = {
    "equation": "*EQUATION\n2\nTOP, 2, 1., 900, 2, -1.\n2\nTOP, 1, 1., 900, 1, -1.\n",
    "coupling": "*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=STOP\n*KINEMATIC\n1, 2\n6, 6\n",
    "kinematic coupling": "*KINEMATIC COUPLING, REF NODE=900\nTOP, 1, 2\n",
    "tied nodes": "*RIGID BODY, REF NODE=900, TIE NSET=TOP\n",
}  # fmt: skip


@pytest.mark.parametrize("how", list(FOLLOWING))
def test_a_side_that_follows_a_prescribed_node_moves_with_it(tmp_path, how):
    """Equations of two terms and couplings are the prescribed motion of the side; not prescribed, they are refused."""
    opening = BLOCK + "*NODE\n900, 0., 9.\n" + FOLLOWING[how] + STEP
    moved = "*BOUNDARY\nBOT, 1, 2\n900, 1, 1, 0.1\n900, 2, 2, 0.2\n900, 6, 6\n*END STEP\n"
    problem, _ = read(tmp_path, opening + moved)
    want, _ = read(tmp_path, BLOCK + STEP + moved.replace("900", "TOP").replace("TOP, 6, 6\n", ""))
    ours, hand = end(problem), end(want)
    assert reaction(ours, "E1") == pytest.approx(reaction(hand, "E1"), rel=1e-9) and reaction(hand, "E1")[1] < -100.0
    undriven = "follows node 900: read where that has a prescribed motion along y"
    refused(tmp_path, opening + moved.replace("900, 2, 2, 0.2\n", ""), undriven)
    if how != "equation":
        refused(tmp_path, opening + moved.replace("900, 6, 6\n", ""), "does not turn: hold its rotation")


SUMS = {
    "difference of two reference nodes": ("3\nTOP, 2, 1., 900, 2, -1., 901, 2, 1.", lambda a, b: a - b),
    "mean": ("3\nTOP, 2, -2., 900, 2, 1., 901, 2, 1.", lambda a, b: 0.5 * (a + b)),
    "difference of two sides": ("3\nTOP, 2, 1., BOT, 2, -1., 901, 2, -1.", lambda a, b: b),
}  # fmt: skip


@pytest.mark.parametrize("kind", list(SUMS))
@pytest.mark.parametrize("how", ["number", "amplitude", "two steps"])
def test_a_side_that_follows_several_prescribed_nodes_moves_by_their_sum(tmp_path, kind, how):
    """Periodic differences and means of prescribed nodes: the motion at every increment is the sum, in step time, by hand."""
    rows, total = SUMS[kind]
    table = "*AMPLITUDE, NAME=A\n0., 0., 0.5, 1.5, 1., 1.\n" if how == "amplitude" else ""
    opening = BLOCK + f"*NODE\n900, 0., 9.\n901, 0., 9.\n*EQUATION\n{rows}\n{table}" + STEP.replace("0.5, 1.", "0.25, 1.")
    opening = opening.replace("*STATIC", "*STATIC, DIRECT")
    first = "*BOUNDARY\nBOT, 1, 2\n" + ("900, 2, 2, 0.1\n" if "900" in rows else "")
    last = f"*BOUNDARY{', AMPLITUDE=A' if table else ''}\n901, 2, 2, 0.04\n*END STEP\n"
    between = "901, 2, 2, 0.\n*END STEP\n*STEP, NLGEOM\n*STATIC, DIRECT\n0.25, 1.\n" if how == "two steps" else ""
    problem, _ = read(tmp_path, opening + first + between + last)
    seen = [(inc.time, inc.bodies["E1"].x[12, 1] - H) for inc in pr.solve(problem)]
    for t, moved in seen:
        a = 0.1 * min(t, 1.0)
        b = 0.04 * (max(t - 1.0, 0.0) if between else np.interp(t, [0, 0.5, 1], [0, 1.5, 1]) if table else t)
        assert moved == pytest.approx(total(a, b), abs=1e-12), t
    assert len(seen) >= 4 and abs(seen[-1][1]) > 0.03


def test_equations_of_another_kind_are_refused(tmp_path):
    """Terms that nothing prescribes (a node that hangs between two others), two components, a node that is released."""
    along = "only equations along one component"
    held = STEP + "*BOUNDARY\nBOT, 1, 2\n*END STEP\n"
    for rows, message in (
        ("3\n11, 2, 1., 12, 2, -0.5, 13, 2, -0.5", "'11' follows node 12: read where that has a prescribed motion along y"),
        ("3\nTOP, 2, 1., BOT, 2, -1., 900, 2, -1.", "'TOP' follows node 900: read where that has a prescribed motion along y"),
        ("2\n11, 1, 1., 12, 2, -1.", along), ("1\nTOP, 2, 1.", along),
    ):
        refused(tmp_path, BLOCK + f"*NODE\n900, 0., 9.\n*EQUATION\n{rows}\n" + held, message)
    again = BLOCK + "*NODE\n900, 0., 9.\n*EQUATION\n2\nTOP, 2, 1., 900, 2, -1.\n" + STEP
    again += f"*BOUNDARY\nBOT, 1, 2\n900, 2, 2, 0.1\n*END STEP\n{STEP}*BOUNDARY, OP=NEW\nBOT, 1, 2\n*END STEP\n"
    refused(tmp_path, again, "what these nodes follow is released in a later step")
    beams = "*ELEMENT, TYPE=B21, ELSET=WIRE\n77, 1, 2\n*BEAM SECTION, ELSET=WIRE, MATERIAL=M, SECTION=RECT\n1., 1.\n"
    refused(tmp_path, BLOCK + beams + STEP + "*END STEP\n", r"\*BEAM SECTION: lines have no stiffness here")


@pytest.mark.parametrize("second", ["M", "N"])
def test_sections_that_share_nodes_hold_together(tmp_path, second):
    """Two rows of elements: of one material they are a body, of two they are tied; the force is that of springs in series."""
    text = mesh().replace("ELSET=E1", "ELSET=ALL") + SETS.replace("*SOLID SECTION, ELSET=E1, MATERIAL=M\n1.\n", "")
    text += "*ELSET, ELSET=LOW, GENERATE\n1, 4\n*ELSET, ELSET=HIGH, GENERATE\n5, 8\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.\n"
    text += "*MATERIAL, NAME=N\n*ELASTIC\n3000., 0.\n*SOLID SECTION, ELSET=LOW, MATERIAL=M\n"
    text += f"*SOLID SECTION, ELSET=HIGH, MATERIAL={second}\n" + SMALL
    text += "*BOUNDARY\nBOT, 2, 2\n1, 1, 1\nTOP, 2, 2, 0.04\n*END STEP\n"
    problem, _ = read(tmp_path, text)
    assert len(problem.bodies) == (1 if second == "M" else 2) and len(problem.ties) == len(problem.bodies) - 1
    above = 1000.0 if second == "M" else 3000.0
    want = -0.04 * W / (0.5 * H / 1000.0 + 0.5 * H / above)
    assert reaction(end(problem), "LOW")[1] == pytest.approx(want, rel=1e-9)


def test_sections_of_two_thicknesses_are_refused(tmp_path):
    """A case has one."""
    two = "*ELSET, ELSET=A\n1, 2, 3, 4\n*ELSET, ELSET=B\n5, 6, 7, 8\n*SOLID SECTION, ELSET=A, MATERIAL=M\n1.\n"
    two += "*SOLID SECTION, ELSET=B, MATERIAL=M\n2.\n"
    text = BLOCK.replace("*SOLID SECTION, ELSET=E1, MATERIAL=M\n1.\n", two)
    refused(tmp_path, text + STEP + "*END STEP\n", "a section of thickness 2 beside one of 1")


# ------------------------------------------------------------------------------------------------------------- dialects
def test_rubber_is_read_where_its_volume_law_is_left_to_the_case(tmp_path):
    """Moduli from C10 and D1; incompressible rubber is refused."""
    text = PRESSED.replace("*ELASTIC\n1000., 0.3\n", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.04\n")
    refused(tmp_path, text, "--without volume-law")
    material = read(tmp_path, text, "--without", "volume-law")[0].bodies["E1"].material
    lam, mu = material.E * material.nu / (1 + material.nu) / (1 - 2 * material.nu), material.E / 2 / (1 + material.nu)
    assert isinstance(material, pr.NeoHooke) and mu == pytest.approx(1.0) and lam + 2 / 3 * mu == pytest.approx(2 / 0.04)
    refused(tmp_path, text.replace("0.5, 0.04", "0.5,"), "C10 and D1, both above 0", "--without", "volume-law")
    refused(tmp_path, text.replace("NEO HOOKE", "OGDEN"), "OGDEN of .HYPERELASTIC is not read")


MIXED = (
    "*NODE\n1, 0., 0.\n2, 2., 0.\n3, 4., 0.\n4, 0., 2.\n5, 2., 2.\n6, 4., 2.\n*ELEMENT, TYPE=CPE4, ELSET=QUADS\n1, 1, 2, 5, 4\n"
    "*ELEMENT, TYPE=CPE3, ELSET=TRIS\n2, 2, 3, 6\n3, 2, 6, 5\n*NSET, NSET=LEFT\n1, 4\n*NSET, NSET=RIGHT\n3, 6\n"
    "*ELSET, ELSET=ALL\nQUADS, TRIS\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n1.\n"
)


def test_elements_of_two_kinds_make_one_body_of_triangles(tmp_path):
    """CPE4 and CPE3 stretched evenly: the closed form; quadratic and linear ones together are refused."""
    text = MIXED + ELASTIC + SMALL + "*BOUNDARY\nLEFT, 1, 1\n1, 2, 2\nRIGHT, 1, 1, 0.04\n*END STEP\n"
    quadratic = "*NODE\n7, 3., 0.\n8, 4., 1.\n9, 3., 1.\n*ELEMENT, TYPE=CPE6, ELSET=TRIS\n2, 2, 3, 6, 7, 8, 9\n"
    both = text.replace("*ELEMENT, TYPE=CPE3, ELSET=TRIS\n2, 2, 3, 6\n3, 2, 6, 5\n", quadratic)
    refused(tmp_path, both, "'ALL' has linear and quadratic elements; mesh it with one order")
    problem, said = read(tmp_path, text)
    assert problem.bodies["ALL"].element == "t6" and "triangles and quadrilaterals" in said
    b = end(problem).bodies["ALL"]
    assert b.reaction[b.X[:, 0] < 1e-9, 0].sum() == pytest.approx(-1000.0 / 0.91 * 0.01 * 2.0, rel=1e-9)


QUADRATIC = mesh("CAX8R") + "*NSET, NSET=LOW\n1, 2, 3\n"


@pytest.mark.parametrize("text", [PRESSED, MIXED, QUADRATIC, mesh("CPS4", 3, 3, 40)])
def test_meshio_reads_the_same_nodes_elements_and_sets(tmp_path, text):
    """An independent reader, under the names of elements that it knows (none of plane strain or axisymmetric ones)."""
    known = text.partition("*SURFACE")[0].partition("*SOLID")[0]
    for ours_, theirs_ in (("CPE4", "CPS4"), ("CPE3", "CPS3"), ("CAX8R", "S8R")):
        known = known.replace(ours_, theirs_)
    (tmp_path / "job.inp").write_text(known)
    theirs, ours = meshio.read(tmp_path / "job.inp"), abaqus.read(known)
    assert np.array_equal(theirs.points[:, :2], np.array([x[:2] for x in ours.nodes.values()]))
    order = list(ours.nodes)
    cells = [[order[n] for n in cell] for block in theirs.cells for cell in block.data]
    assert cells == [list(c) for c in ours.cells.values()]
    for name, members in theirs.point_sets.items():
        assert [order[n] for n in members] == ours.points[name]


GMSH = Path(__file__).parent / "written" / "billet.inp"


def test_a_mesh_of_gmsh_with_the_rest_of_a_deck_behind_it_runs(tmp_path):
    """Lines of gmsh (T3D2) are boundaries; CPS4 becomes what the user makes of it."""
    text = GMSH.read_text().replace("CPS4", "CAX4R")
    text += "*SOLID SECTION, ELSET=billet, MATERIAL=M\n" + ELASTIC + SMALL
    text += "*BOUNDARY\nbottom, 2, 2\nbottom, 1, 1\ntop, 2, 2, -0.15\n*END STEP\n"
    problem, _ = read(tmp_path, text)
    inc = end(problem)
    assert problem.space == "axisymmetric" and inc.bodies["billet"].reaction[:, 1].sum() == pytest.approx(0.0, abs=1e-6)


PREPOMAX = """\
************************************************************
** Heading
*Heading
Hash: n5pqLPFA, Date: 11/27/2026, Unit system: MM_TON_S_C
** Nodes
{mesh}
*Node
900, 0, 4
899, 0, 4
*Nset, Nset=Fixed
1, 2, 3, 4, 5
*Elset, Elset=Internal-1_Top_S3
5, 6, 7, 8
*Surface, Name=Top, Type=Element
Internal-1_Top_S3, S3
*Surface, Name=Face, Type=Element
E901, S1
*Nset, Nset=Tool_nodes, Generate
901, 906
** Materials
*Material, Name=M
*Density
1e-9
*Elastic
1000, 0.3
*Solid section, Elset=E1, Material=M
1
*Solid section, Elset=E901, Material=M
1
*Rigid body, Nset=Tool_nodes, Ref node=900, Rot node=899
*Surface interaction, Name=Dry
*Surface behavior, Pressure-overclosure=Linear
1E+6
*Friction
0.2, 1E+5
*Contact pair, Interaction=Dry, Type=Surface to surface, Adjust=0
Top, Face
*Step, Nlgeom, Inc=100
*Static, Solver=Pardiso
0.5, 1, 1E-5, 1E+30
*Boundary, op=New
Fixed, 1, 1
Fixed, 2, 2
899, 3, 3
900, 1, 1
900, 2, 2, -0.1
*Node file
RF, U
*El file
S, E, NOE
*Contact file
CDIS, CSTR
*End step
"""


def test_a_deck_as_prepomax_writes_it_gives_the_force_of_the_same_in_abaqus(tmp_path):
    """Rigid body by all its nodes with a node of rotation, linear contact with stick slope, a support in the step."""
    text = PREPOMAX.format(mesh=(mesh() + mesh("CPE4", 2, 1, 901, -4.0, 4.0, (16.0, 3.0))).strip())
    problem, _ = read(tmp_path, text)
    same = PRESSED.replace("0.2\n", "0.2, 1e5\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n1e6\n", 1)
    assert close(force(problem), force(read(tmp_path, same)[0]))


MECWAY = """\
**
** Mecway
**
{mesh}
*ELSET,ELSET=EL_all,GENERATE
1,8
*NSET,NSET=N_fix
1,
2,
3,
4,
5
*MATERIAL,NAME=Steel
*ELASTIC,TYPE=ISO
1000.,0.3,0
*EXPANSION,ZERO=0
1.2E-5
*SOLID SECTION,ELSET=EL_all,MATERIAL=Steel
1
*STEP,INC=1000
*STATIC
1,1
*BOUNDARY
N_fix,1,2,0
*DLOAD
5,P3,3
6,P3,3
*DLOAD
7,P3,3
8,P3,3
*NODE FILE,GLOBAL=YES
U
*EL FILE
S,E
*END STEP
"""


def test_a_deck_as_mecway_writes_it_carries_its_load(tmp_path):
    """Sets with one number a line, loads of elements under several keywords."""
    problem, _ = read(tmp_path, MECWAY.format(mesh=mesh("CPS4").replace(" ", "").strip()))
    assert reaction(end(problem), "EL_all")[1] == pytest.approx(3.0 * W, rel=1e-9)


def test_names_with_points_and_a_comma_too_many_are_read(tmp_path):
    """Sets called E.1, as preprocessors number them, and a keyword behind a line that ends with a comma."""
    text = PRESSED.replace("E1", "BODY.1").replace("*MATERIAL, NAME=M\n", "*MATERIAL, NAME=M,\n")
    problem, _ = read(tmp_path, text)
    assert list(problem.bodies) == ["1"] and problem.bodies["1"].material.E == 1000.0


# --------------------------------------------------------------------------------------------------- several files
def in_files(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder / "job.inp"


def imported(folder: Path, *options: str):
    out = folder / "out" / "case.yaml"
    out.parent.mkdir(exist_ok=True)
    done = CliRunner().invoke(app, ["import", str(folder / "job.inp"), "--out", str(out), *options])
    return done, out


@pytest.mark.parametrize(
    "dialect", ["*INCLUDE, INPUT=mesh/all.inp", '*include,\n input="mesh\\all.inp"', "*Include, Input = mesh/all.inp"]
)
def test_included_files_are_read_in_their_places(tmp_path, dialect):
    """Nodes as data lines of *NODE by INPUT=, a file that includes another: the same problem and bits as in one deck."""
    nodes, elements = mesh().split("*ELEMENT")
    rest = PRESSED.removeprefix(BLOCK).replace("*STEP", "*INCLUDE, INPUT=law.inp\n*STEP")
    deck = in_files(tmp_path, {
        "job.inp": f"*HEADING\nin files\n{dialect}\n{rest}",
        "mesh/all.inp": f"** the mesh\n*NODE, INPUT=mesh/nodes.txt\n*ELEMENT{elements}{SETS}",
        "mesh/nodes.txt": nodes.removeprefix("*NODE\n"), "law.inp": ELASTIC,
    })  # fmt: skip
    done, out = imported(tmp_path)
    assert done.exit_code == 0, done.output
    assert sorted(f.name for f in out.parent.iterdir()) == ["case.yaml", "job-whole.inp"]
    ours, whole = load(out).problem, read(tmp_path, PRESSED)[0]
    assert ours.name == "in files"
    assert np.array_equal(end(ours).bodies["E1"].x, end(whole).bodies["E1"].x)
    done = CliRunner().invoke(app, ["import", str(deck)])
    assert done.exit_code == 2 and "give --out" in done.output


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"job.inp": "*INCLUDE, INPUT=a.inp\n"}, "line 1: there is no file 'a.inp' in .*; paths are relative to the deck"),
        ({"job.inp": "*NODE\n*INCLUDE\n"}, r"line 2: \*INCLUDE names no file"),
        ({"job.inp": "**\n*INCLUDE, INPUT=a.inp\n", "a.inp": "**\n**\n*INCLUDE, INPUT=job.inp\n"},
         "line 3 of a.inp: 'job.inp' includes itself"),
        ({"job.inp": "*INCLUDE, INPUT=a.inp\n", "a.inp": "*NODE\n1, 0., 0.\n2, zero, 1.\n"},
         "line 3 of a.inp: 'zero, 1.' is not coordinates"),
        ({"job.inp": "*INCLUDE, INPUT=m.inp\n*INCLUDE, INPUT=b/a.inp\n" + STEP, "m.inp": BLOCK, "b/a.inp": "*SPRING\n"},
         r"line 1 of b/a.inp: \*SPRING is not read"),
        ({"job.inp": "*INCLUDE, INPUT=m.inp\n*FRICTIONS\n" + STEP, "m.inp": BLOCK}, r"line 2: \*FRICTIONS is not known"),
        ({"job.inp": "*INCLUDE, INPUT=/dev/zero\n"}, "line 1: there is no file '/dev/zero'"),
    ],
)  # fmt: skip
def test_included_files_are_refused_with_file_and_line(tmp_path, files, message):
    """A missing file, a loop, wrong content: file and line where it stands, with lines of the deck counted as they are there."""
    in_files(tmp_path, files)
    done, _ = imported(tmp_path)
    assert done.exit_code == 2 and re.search(rf"job\.inp: {message}", done.output), done.output


def test_files_that_include_one_another_many_times_are_refused(tmp_path):
    """Twenty files, each of which includes the next one many times."""
    files = {f"{n}.inp": f"*INCLUDE, INPUT={n + 1}.inp\n" * 64 for n in range(20)} | {"20.inp": "**" + "x" * 10_000 + "\n"}
    in_files(tmp_path, files | {"job.inp": "*INCLUDE, INPUT=0.inp\n"})
    done, _ = imported(tmp_path)
    assert done.exit_code == 2 and "larger than 256 MiB" in done.output


def test_sides_of_two_files_have_names_of_their_own(tmp_path):
    """Pressures in the same line of two files: two sides, both loaded."""
    load_ = "*DLOAD\n{}, P3, {}\n"
    in_files(tmp_path, {
        "job.inp": BLOCK + STEP + "*BOUNDARY\nBOT, 1, 2\n*INCLUDE, INPUT=a.inp\n*INCLUDE, INPUT=b.inp\n*END STEP\n",
        "a.inp": load_.format(5, 1.0), "b.inp": load_.format(6, 3.0),
    })  # fmt: skip
    done, out = imported(tmp_path)
    assert done.exit_code == 0, done.output
    assert reaction(end(load(out).problem), "E1")[1] == pytest.approx(4.0 * W / NX, rel=1e-3)
