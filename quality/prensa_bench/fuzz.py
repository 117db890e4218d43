# ruff: noqa: E501 (a case with long lines)
"""Broken inputs: mutated case files and mesh files must be read or refused in words, quickly, in little memory.

A case is mutated as text (characters, tokens, lines, indentation), as a tree (values, keys and branches removed,
copied, exchanged, replaced by hostile ones) or as only YAML can be (see `prensa_bench.fuzz_yaml`), a mesh file as text; some are
blown up to megabytes, some are no text files at all. What is read is discretised and checked as well, up to the
first increment. Anything but an answer or a `PrensaError` counts as a defect: another exception, more than `TIME_TO_ANSWER`
seconds of processor time and, on Linux, more than `MEMORY` bytes.
"""

from __future__ import annotations

import gc
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError
from prensa.model.meshes import Disc
from prensa_bench.fuzz_yaml import mutate_yaml, no_text

TIME_TO_ANSWER = 1.0  # processor seconds that reading or refusing an input may take
TIME_TO_GIVE_UP = 10.0  # seconds of processor time after which an input is abandoned
MEMORY = 2 << 30  # bytes of address space above what is in use before
LARGEST_MESH = 20_000  # elements, of quadratic ones nodes; a larger case is no defect, its time is due to its size: it is read but not meshed

TOKENS = (
    "0", "-1", "1e308", "-1e308", "5e-324", "1e999", ".nan", "-.inf", "99999999999999999999", "1e5", "0.0", "-0.0", "1_000",
    "0x7f", "0o17", "1:30", "3 mm", "10 GPa", "1 deg", "-3 parsec", "1e400 mm", "mm", "null", "~", "true", "no", "[]", "{}",
    "''", '""', "'x", "[[]]", "[0, 1", "{a: }", "*a", "&a 1", "!!float 1", "<<", "? a", "|", ">", "%YAML 1.1", "---", "...",
    "held", "free", "xy", "body", "body.top", "body.nothing", ".", "..", "body.", "tool", "table.csv", "/dev/null", "mesh.msh",
    "\u0000", "\ufeff", "\u2028", "\U0001f528", "ö" * 40, "a" * 5000, "[" * 60, "{a: " * 60, "1" * 400,
)  # fmt: skip

EXTRA = """\
name: every kind of entry
units: {length: m, force: kN}
space: plane stress
thickness: 2 mm
bodies:
  a:
    mesh: {type: points, points: [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]], cells: [[0, 1, 2, 3], [1, 4, 5, 2]], boundaries: {top: [3, 2, 5], bottom: [0, 1, 4], end: [4, 5], corner: [0]}}
    material: {type: j2, E: 70 GPa, nu: 0.3, flow: {type: table, points: [[0, 1e5], [0.1, 2e5], [1, 3e5]]}}
  b:
    mesh: {type: rectangle, size: [1 m, 50 cm], n: [4, 3], origin: [0, 2], grade: {x: [0.5], y: [2], ratio: 3}}
    material: {type: elastic, E: 1e6, nu: 0.2}
tools:
  press: {type: stamp, width: 2.5, fillet: 0.1, at: [1, 0], touching: a.top}
  wheel: {type: circle, radius: 0.3, at: [1, 0], below: b.bottom}
contacts:
  - {surface: [a.top, a.end], against: press, friction: {type: coulomb, mu: {mu0: 0.1, mu_inf: 0.3, u0: 1 mm}}, enforcement: {type: augmented, beta: 20}}
  - {surface: b.bottom, against: wheel, friction: {type: shear, m: 0.3, k: 1 MPa}, integration: gauss2}
fixed: {a.bottom: {x: held, y: 0.0}, b.top: xy}
loads: {a.end: {pressure: [[0, 0], [3, 1 kPa]]}}
body_force: {a: [0, -1]}
friction: {mu: 0.1}
steps:
  - {name: one, move: {press: {y: -0.01, rz: 1 deg}}, velocity: {wheel: {y: 1 mm/s}}, increments: 3}
  - {name: two, push: {press: {y: -3 N}}, fixed: {a.bottom: free}, friction: {b.bottom-wheel: null}}
  - {name: three, loads: {b.left: {traction: [0, [[2, 0], [3, 1]]], follower: false}}, fixed: {a.bottom: {y: [[2, 0], [3, 0]]}}}
numerics: {tolerance: 1e-8, max_cutbacks: 3}
output: {fields: 0, pictures: false}
"""
FORMING = (
    """\
name: forging
units: {length: mm, force: kN}
space: axisymmetric
bodies:
  billet:
    mesh: {type: outline, points: [[0, 0], [12, 0], [14 mm, 19], [0, 19]], size: 4, fillet: [0, 0, 1, 0], sides: [bottom, right, top, left]}
    element: t6
    material: {type: j2, E: 70 GPa, nu: 0.33, flow: {type: swift, K: 200 MPa, e0: 0.01, n: 0.2}}
tools:
  die: {type: profile, points: [[-20, 10], [6.5, 10], [8, 3.5], [15.5, 3.5], {through: [16.5, 5], to: [17, 8]}, [60, 8]], fillet: [0, 1, 1, 0, 0, 0], above: billet.top}
friction: {type: capped, mu: 0.1, m: 0.9}
fixed: {billet.left: x, billet.bottom: y}
remesh: {size: {far: 3.8, near_tools: 3.4, per_radius: 4, across: 3, least: 0.5}, when: {quality: 0.3, travel: 2, failure: true}, at_most: 9}
measures: {force: mean(die.fy), rim: billet.max.x, height: billet.height}
steps:
  - {name: forge, move: {die: {y: -8}}, until: {force: {die: {y: 100 kN}}, measure: {billet.height: 15}, required: false}}
  - {name: open, by: {die: {y: 5}}, until: {contact: {die: leaves}}}
""",
    """\
name: bending
units: {length: mm, force: N}
bodies:
  sheet:
    mesh: {type: strip, length: 30, thickness: 1, n: [10, 2], nose: {length: 6, thickness: 0.6}, front: [15, 0.5], toward: right}
    element: q4_enhanced
    material: {type: j2, E: 210 GPa, nu: 0.3, flow: {type: swift_voce, K: 500, e0: 0.01, n: 0.2, s0: 200, Q: 150, b: 10, w: 0.5}}
tools:
  punch: {type: circle, radius: 8, at: [0, 0], above: sheet.top}
  table: {type: profile, points: [[40, 0], [8, 0], [8, -30]], fillet: 3, below: sheet.bottom, spring: {y: 5000, x: 1 kN/mm}}
contacts:
  - {surface: sheet.top, against: punch, enforcement: {type: exact}}
  - {surface: sheet.bottom, against: table, friction: {type: stribeck, mu_static: 0.2, mu_kinetic: 0.05, speed: 2 mm/s, exponent: 1}, enforcement: {type: penalty, beta: 200}}
fixed: {sheet.left: x}
stabilise: auto
steps:
  - {name: bend, move: {punch: {y: [[0, 0], [0.5, -3], [1, -4]]}}, increments: 20, stabilise: "off"}
  - {name: press, push: {punch: {y: -100}}, control: {punch: {y: -6}}}
  - {name: release, fixed: {sheet.right: y}, stabilise: auto}
  - {name: free, remove_tools: true}
output: {fields: 5, pictures: true, report: false, mirror: left}
""",
    """\
name: wire
units: {length: mm, force: N}
space: axisymmetric
bodies:
  wire: {mesh: {type: wire, length: 20, diameter: 6, n: [12, 3], nose: {length: 5, thickness: 4.5}, front: 6, toward: top}, material: {type: j2, E: 200 GPa, nu: 0.3, flow: {type: perfect, s0: 300 MPa}}}
  ring: {mesh: {type: annulus, inner: 50, outer: 60, n: [4, 3], angles: [0 deg, 60 deg]}, material: {type: neo_hooke, E: 10, nu: 0.45}}
  disc: {mesh: {type: disc, radius: 3, n: [4, 4], part: right, centre: [0, 60]}, material: {type: elastic, E: 1000, nu: 0.3}}
tools:
  die: {type: profile, points: [[6, 11.5], [2.7, 3], [2.7, 2], [7.3, -20]], fillet: 0.5, at: [0, 0]}
contacts: [{surface: wire.right, against: die, friction: {type: shear, m: 0.1}}]
fixed: {ring.start: xy, disc.rim: xy}
steps:
  - {name: draw, fixed: {wire.top: {y: 13}}, until: {travel: {die: {y: 1}}}}
""",
    """\
name: presses and rolls
units: {length: mm, force: N}
bodies:
  strip: {mesh: {type: strip, length: 4, thickness: 2, n: [8, 2], half: true, nose: {length: 1, thickness: 1.92}}, element: q4_sheet, material: {type: j2, E: 70 GPa, nu: 0.33, flow: {type: johnson_cook, A: 60, B: 100, n: 0.3, C: 0.02, rate0: 1}}}
  block: {mesh: {type: patch, corners: [[0, 24], [8, 24], [8, 30], [0, 30]], n: [4, 3], sides: {top: {type: arc, through: [4, 30.5]}, right: {type: spline, points: [[8.5, 27]]}}, grade: top, ratio: 2}, material: {type: j2, E: 70 GPa, nu: 0.33, flow: {type: hockett_sherby, s0: 60, s_inf: 180, b: 3, n: 0.8}}}
  base: {mesh: {type: rectangle, size: [8, 4], n: [4, 2], origin: [0, 20], grade: top-right}, material: {type: elastic, E: 1000, nu: 0.3}, element: q8}
ties: [{slave: block.bottom, master: base.top}]
tools:
  roll: {type: circle, radius: 8, at: [3, 8.95]}
  ram: {type: ellipse, semi: [6, 3], above: block.top}
contacts:
  - {surface: strip.top, against: roll, friction: {type: coulomb, mu: {mu0: 0.3, slope: -0.1, limit: 0.1}}}
  - {surface: block, against: ram, friction: {type: coulomb, mu: {kappa: [0, 1, 2], mu: [0.1, 0.2, 0.2]}}, enforcement: {type: penalty, k_n: 1e5}}
no_contact: [{surface: strip, against: symmetry}, {surface: [base.left, base.right], against: ram}]
fixed: {strip.bottom: y, base.bottom: xy, block.left: x, base.left: x}
measures: {gap: strip.max.y, torque: roll.mz, ring: roll.moment}
steps:
  - {name: bite, feed: {strip.left: {x: 4}}, by: {roll: {rz: 0.7}}, duration: 20 ms}
  - {name: stroke, crank: {ram: {stroke: 120 mm, ratio: 0.2, height: 0.4 mm, strokes_per_minute: 40}}, until: {travel: {ram: {y: -0.3}}, required: true}}
  - {name: open, crank: {ram: {stroke: 120 mm, ratio: 0.2, start: 0, end: -25 deg, strokes_per_minute: 40, toward: down}}, push: {roll: {m: 0}}}
  - {name: lift, by: {base.bottom: {y: 0.1}, ram: {y: [[3, 0], [4, 1 mm]]}}, friction: {strip.top-roll: null}, duration: 2 s}
  - {name: free, remove_tools: true, fixed: {base.bottom: free}}
""",
    """\
name: rest
units: {length: inch, force: lbf}
space: axisymmetric
kinematics: small
allow_large_strain: true
thickness: 1
bodies:
  cup: {mesh: {type: outline, points: [[2, 0], [6, 0], [6, 8], [2, 8]], size: 2, sides: [low, out, up, bore], holes: [[[3, 3], [4, 3], [4, 4]]]}, element: t3, material: {type: elastic, E: 10 GPa, nu: 0.3}}
tools: {ring: {type: ring, inner: 3, outer: 5, fillet: 0.3, touching: cup.up, spring: {y: 1e6}}, ball: {type: circle, radius: 9, concave: true, above: cup.up}}
contacts: [{surface: cup.up, against: ring, integration: kikuchi}]
no_contact: [{surface: cup, against: ball}]
fixed: {cup.low: {x: 0, y: held}}
steps: [{name: press, velocity: {ring: {y: [[0, 0], [0.5, -0.01], [1, 0]]}}, loads: {cup.out: {shear: 1, pressure: 2 MPa}}, duration: 3}]
numerics: {condense: true, threads: 2, solver: superlu, iteration: paper, line_search: false}
""",
)
FROM_FILE = """\
name: mesh of a file
bodies: {body: {mesh: {type: file, path: FILE}, material: {type: elastic, E: 1000, nu: 0.3}}}
fixed: {body.bottom: xy}
steps: [{name: rest}]
"""
GMSH = """\
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "bottom"
2 2 "body"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 1 0 0
3 2 0 0
4 0 1 0
5 1 1 0
6 2 1 0
$EndNodes
$Elements
4
1 1 2 1 1 1 2
2 1 2 1 1 2 3
3 3 2 2 1 1 2 5 4
4 3 2 2 1 2 3 6 5
$EndElements
"""
GMSH_4 = """\
$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "bottom"
2 2 "body"
$EndPhysicalNames
$Entities
0 1 1 0
1 0 0 0 2 0 0 1 1 0
1 0 0 0 2 1 0 1 2 0
$EndEntities
$Nodes
2 6 1 6
1 1 0 3
1
2
3
0 0 0
1 0 0
2 0 0
2 1 0 3
4
5
6
0 1 0
1 1 0
2 1 0
$EndNodes
$Elements
2 4 1 4
1 1 1 2
1 1 2
2 2 3
2 1 3 2
3 1 2 5 4
4 2 3 6 5
$EndElements
"""
ABAQUS = """\
*HEADING
*NODE
1, 0., 0.
2, 1., 0.
3, 2., 0.
4, 0., 1.
5, 1., 1.
6, 2., 1.
*ELEMENT, TYPE=CPE4, ELSET=body
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*NSET, NSET=bottom
1, 2, 3
"""


class TimeOutError(BaseException):
    """An input took longer than `TIME_TO_GIVE_UP`; no handler on the way may swallow it."""


@dataclass
class Report:
    """Outcomes: how many were ``read``, ``refused`` and ``failed``; each defect with its input; slowest time (s)."""

    counts: Counter[str] = field(default_factory=Counter)
    defects: list[tuple[int, str, str]] = field(default_factory=list)
    slowest: float = 0.0


# -------------------------------------------------------------------------------------------------------------- corpus
def corpus() -> list[str]:
    """Good cases to start from: random problems, and one with an entry of every kind."""
    from prensa.model.schema import dump
    from prensa_bench.robustness import draw

    texts = [dump(draw(suite, 7, k)) for suite in ("elastic", "plastic") for k in range(8)]
    return [EXTRA, *FORMING, *(t for t in texts if len(t) < 2500)]


# ----------------------------------------------------------------------------------------------------------- mutations
def mutate_text(rng: np.random.Generator, text: str) -> str:
    """One to four changes of a text: characters, tokens, lines, indentation, or its end cut off."""
    for _ in range(int(rng.choice([1, 1, 2, 4]))):
        text = _CHANGES[rng.integers(len(_CHANGES))](rng, text) or "\n"
    return text


def _character(rng: np.random.Generator, text: str) -> str:
    i = int(rng.integers(len(text)))
    options = (int(rng.integers(32, 127)), int(rng.integers(1, 0x2FF)), ord(text[rng.integers(len(text))]))
    new = chr(options[rng.integers(3)])
    return text[:i] + new + text[i + int(rng.integers(2)) :]


def _token(rng: np.random.Generator, text: str) -> str:
    import re

    spots = list(re.finditer(r"[\w.+-]+", text))
    if not spots:
        return text
    spot = spots[rng.integers(len(spots))]
    other = (
        spots[rng.integers(len(spots))].group()
        if rng.random() < 0.3
        else str(rng.choice(np.array(TOKENS, dtype=object)))
    )
    return text[: spot.start()] + other + text[spot.end() :]


def _line(rng: np.random.Generator, text: str) -> str:
    lines = text.split("\n")
    i, j = (int(k) for k in rng.integers(len(lines), size=2))
    match rng.integers(5):
        case 0:
            del lines[i]
        case 1:
            lines.insert(i, lines[j])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3:
            lines[i] = " " * int(rng.integers(1, 5)) + lines[i]
        case _:
            lines[i] = lines[i].lstrip()
    return "\n".join(lines)


def _cut(rng: np.random.Generator, text: str) -> str:
    i, j = sorted(int(k) for k in rng.integers(len(text) + 1, size=2))
    return text[:i] if rng.random() < 0.3 else text[:i] + text[j:] if rng.random() < 0.5 else text[:j] + text[i:]


_CHANGES: tuple[Callable[[np.random.Generator, str], str], ...] = (
    _character,
    _token,
    _token,
    _token,
    _line,
    _line,
    _cut,
)


def mutate_size(rng: np.random.Generator, text: str) -> str:
    """One line, or a piece of it, or a token, repeated to a size between a hundred kilobytes and two megabytes."""
    lines = text.split("\n")
    i = int(rng.integers(len(lines)))
    piece = lines[i]
    match rng.integers(4):
        case 0:
            piece = str(rng.choice(np.array(TOKENS, dtype=object)))
        case 1:
            piece = piece[int(rng.integers(len(piece) + 1)) :]
        case 2:
            piece = " " * int(rng.integers(8)) + str(
                rng.choice(["- 1", "- [0, 1]", "- a", "a: 1", "[1, 2],", "{a: 1},", "#", ""])
            )
    piece += str(rng.choice(["\n", "\n", " ", ""]))
    size = int(10 ** rng.uniform(5.0, 6.3))
    huge = piece * (size // max(len(piece), 1))
    return "\n".join([*lines[: i + 1], huge, *lines[i + 1 :]])


def mutate_tree(rng: np.random.Generator, text: str) -> str:
    """One to three changes of the tree of a case: values, keys and branches."""
    from prensa.model import text as yaml

    tree = yaml.read(text, "<fuzz>")[0].plain()
    for _ in range(int(rng.choice([1, 1, 2, 3]))):
        spots = list(spots_of(tree))
        holder, key = spots[rng.integers(len(spots))]
        other, there = spots[rng.integers(len(spots))]
        match rng.integers(6):
            case 0:
                del holder[key]
            case 1:
                holder[key] = other[there] if not _inside(other[there], holder) else None
            case 2 if isinstance(holder, dict):
                holder[str(rng.choice(np.array(TOKENS, dtype=object)))[:200]] = holder.pop(key)
            case 3 if isinstance(holder, list):
                holder.extend([holder[key]] * int(rng.choice([1, 2, 60])))
            case _:
                holder[key] = _value(rng, holder[key])
        if not tree:
            break
    return yaml.write(tree) if tree else "\n"


def spots_of(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Every value of a tree, its branches too, as what holds it and the key there."""
    for key in list(tree) if isinstance(tree, dict) else range(len(tree)):
        yield tree, key
        if isinstance(tree[key], dict | list):
            yield from spots_of(tree[key])


def _inside(branch: Any, holder: Any) -> bool:
    """Whether *holder* is part of *branch*: putting it there would make a ring."""
    return branch is holder or (
        isinstance(branch, dict | list)
        and any(_inside(b, holder) for b in (branch.values() if isinstance(branch, dict) else branch))
    )


def _value(rng: np.random.Generator, old: Any) -> Any:
    hostile: tuple[Any, ...] = (0, -1, 1e308, -1e308, 5e-324, 1e-30, 1e30, 2**31, 2**63, 10**25, True, None, "", "x", [], {}, [[]], {"type": "x"},
               "1e999 mm", "nan", [0] * 3, [[0, 0]], 1e5, 3, 0.5, -0.5)  # fmt: skip
    if isinstance(old, int | float) and not isinstance(old, bool) and rng.random() < 0.7:
        return type(old)(old * rng.choice([-1.0, 0.1, 0.5, 2.0, 10.0, 1e3, 1e-6])) if abs(old) < 1e15 else 0
    return hostile[rng.integers(len(hostile))]


# ------------------------------------------------------------------------------------------------------------- running
def read(text: str, folder: Path, changes: Sequence[str] = ()) -> str:
    """Read, mesh and check a case, as ``prensa check`` does: 'read', or 'refused' in words; raises what is a defect."""
    from prensa.model.schema import loads

    return _checked(lambda: loads(text, "case.yaml", folder, changes).problem)


def read_file(path: Path) -> str:
    """As `read`, of what a path leads to."""
    from prensa.model.schema import load

    return _checked(lambda: load(path).problem)


def _checked(described: Callable[[], Any]) -> str:
    from prensa.checks.before.preflight import preflight
    from prensa.model.schema import warnings_of
    from prensa.system.discretise import discretise

    try:
        problem = described()
        warnings_of(problem)
        if sum(elements(b.mesh) * _nodes_each(problem, n) for n, b in problem.bodies.items()) <= LARGEST_MESH and len(problem.steps) <= 100:
            preflight(discretise(problem))
    except PrensaError as error:
        if not str(error).strip():
            raise AssertionError("an error without words") from error
        return "refused"
    return "read"


def elements(mesh: Any) -> float:
    """About how many elements a described mesh has; 0 where only the mesh can tell."""
    n, size = getattr(mesh, "n", None), getattr(mesh, "size", None)
    if isinstance(size, float):  # of triangles in an outline
        x, y = np.array(mesh.points, dtype=np.float64).T
        return 4.0 * float(np.ptp(x) * np.ptp(y) / size / size)  # over twice as many, and each dearer than one in rows
    if isinstance(mesh, Disc):  # a core of squares in each quarter, and what is round it
        return float(mesh.n[0]) * (float(mesh.n[0]) + 4.0 * float(mesh.n[1]))
    if isinstance(n, tuple):
        return float(np.prod([float(k) for k in n]))
    return float(n) ** 2 if isinstance(n, int) else 0.0


def _nodes_each(problem: Any, body: str) -> float:
    """About how many nodes an element of a body adds."""
    return {"q8": 3.0, "q8_full": 3.0, "t6": 2.0}.get(problem.element_name(body), 1.0)


def inputs(count: int, seed: int, folder: Path) -> Iterator[str]:
    """*count* mutated cases; every tenth reads a mutated mesh file of *folder*, every fiftieth input is huge."""
    rng = np.random.default_rng(seed)
    texts = corpus()
    for number in range(count):
        if number % 10 == 9:
            name, mesh = (("mesh.msh", GMSH), ("mesh.msh", GMSH_4), ("mesh.inp", ABAQUS))[rng.integers(3)]
            changed = (mutate_size if number % 100 == 49 else mutate_text)(rng, mesh)
            (folder / name).write_text(changed, encoding="utf-8", errors="replace")
            yield FROM_FILE.replace("FILE", name)
            continue
        text = texts[rng.integers(len(texts))] if rng.random() < 0.5 else texts[rng.integers(1 + len(FORMING))]
        if number % 100 == 24:
            yield mutate_size(rng, text)
        else:
            yield (mutate_tree, mutate_text, mutate_yaml)[rng.choice(3, p=[0.4, 0.4, 0.2])](rng, text)


Source = Callable[[int, int, Path], Iterator[tuple[str, Callable[[], str]]]]
"""Of a count, a seed and a folder: what is tried, in words, and how to try it."""


def files(count: int, seed: int, folder: Path) -> Iterator[tuple[str, Callable[[], str]]]:
    """Attempts to read the `inputs`, every twenty-fifth what is not a text file."""
    rng = np.random.default_rng(seed)
    for number, text in enumerate(inputs(count, seed, folder)):
        if number % 25 == 13:
            path = no_text(rng, text, folder)
            yield f"what is at {path} (seed {seed}, number {number})", partial(read_file, path)
        else:
            yield text, partial(read, text, folder)


def run(
    count: int, seed: int, report_defect: Callable[[str], None] = lambda _: None, source: Source | None = None,
    time_to_answer: float = TIME_TO_ANSWER, time_to_give_up: float | None = None,
) -> Report:  # fmt: skip
    """Try *count* inputs of a *source* (files); ``report_defect`` is called with each defect as it is found.

    ``time_to_answer``, ``time_to_give_up``: processor seconds, of sources that do more than read.
    """
    give_up = TIME_TO_GIVE_UP if time_to_give_up is None else time_to_give_up
    report = Report()
    with tempfile.TemporaryDirectory() as name, np.errstate(all="ignore"):
        folder = Path(name)
        read(EXTRA, folder)  # compiles the kernels: what they take is no input's fault
        read(_file_case(folder), folder)
        gc.collect()
        gc.freeze()  # to look through what the process held before is no input's fault either
        for number, (text, attempt) in enumerate((source or files)(count, seed, folder)):
            begun = time.process_time()
            try:
                with _bounded(give_up):
                    outcome = attempt()
            except (Exception, TimeOutError) as error:
                outcome = "failed"
                place = traceback.extract_tb(error.__traceback__)[-1]
                words = f"{type(error).__name__}: {str(error)[:200]} ({Path(place.filename).name}:{place.lineno})"
                report.defects.append((number, words, text))
            spent = time.process_time() - begun
            if outcome != "failed" and spent > time_to_answer:
                outcome = "failed"
                report.defects.append((number, f"took {spent:.1f} s", text))
            if outcome == "failed":
                report_defect(f"input {number}: {report.defects[-1][1]}")
            report.slowest = max(report.slowest, spent)
            report.counts[outcome] += 1
        gc.unfreeze()
    return report


def _file_case(folder: Path) -> str:
    (folder / "mesh.msh").write_text(GMSH, encoding="utf-8")
    return FROM_FILE.replace("FILE", "mesh.msh")


@contextmanager
def _bounded(give_up: float) -> Iterator[None]:
    """Bound the processor time and the address space of a block; other systems than Linux have not got both bounds."""
    if sys.platform != "linux":
        yield
        return
    import resource

    def late(*_: object) -> None:
        raise TimeOutError(f"not finished after {give_up:g} s")

    used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    before, handler = resource.getrlimit(resource.RLIMIT_AS), signal.signal(signal.SIGVTALRM, late)
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, before[1]))
    signal.setitimer(signal.ITIMER_VIRTUAL, give_up)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)
