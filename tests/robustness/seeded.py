# ruff: noqa: E501 (one mistake a line)
"""Seeded mistakes: one change of a good case each, and what must be said about it. The table of the docs is made of them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from typer.testing import CliRunner

from coining import coining
from prensa.cli import app
from prensa.verify.stl import icosphere, write

CASE = """\
name: flattening
space: plane strain
bodies:
  strip:
    mesh: {type: rectangle, size: [4, 2], n: [8, 4]}
    material: {type: j2, E: 70e3, nu: 0.3, flow: {type: voce, s0: 60, Q: 120, b: 8}}
tools:
  die: {type: plane, touching: strip.top}
contacts:
  - {surface: [strip.top, strip.right], against: die, friction: {type: coulomb, mu: 0.1}}
fixed: {strip.bottom: y, strip.left: x}
steps:
  - {name: press, move: {die: {y: -0.2}}, increments: 4}
"""

SECTION = "type: extruded, section: {type: circle, radius: 20}, axis: [0, 0, 1]"
IN_SPACE = coining("[5, 3, 5]", "roll", SECTION, "{type: coulomb, mu: 0.1}", 0.5, 5)
SWIFT = "type: j2, E: 210e3, nu: 0.3, flow: {type: swift, K: 600, e0: 0.01, n: 0.2}"
ROLL = f"{SECTION}, touching: block.top, at: [0, 0, 0]"
BALL = "type: sphere, radius: 20, touching: block.top, at: [0, 0, 0]"
VICKERS = "type: pyramid, of: vickers, radius: 2, turn: [0, 20 deg, 0], touching: block.top, at: [0, 0, 0]"
CAP = "type: stl, file: cap.stl"
BRICKS = "type: box, size: [10, 5, 10], n: [5, 3, 5]"

ELASTIC = ("type: j2, E: 70e3, nu: 0.3, flow: {type: voce, s0: 60, Q: 120, b: 8}", "type: elastic, E: 1e3, nu: 0.3")
POINTS = "mesh: {type: rectangle, size: [4, 2], n: [8, 4]}"
CYLINDER = ("type: plane, touching: strip.top", "type: circle, radius: 2, touching: strip.top")


WEDGE = "type: profile, points: [[-9, 4], [0, 0], [9, 4]], fillet: 0.2, touching: strip.top"
TINY = "type: polygon, points: [[0.4, 0], [0.6, 0], [0.6, 1], [0.4, 1]], fillet: 0.05, touching: strip.top"
BLOCK = "type: polygon, points: [[-1, 0], [2, 0], [2, 1], [-1, 1]], fillet: 0, touching: strip.top"
MU = "contacts.0.friction.mu"
BRIDGE = (
    ELASTIC, ("n: [8, 4]", "n: [8, 1]"), ("[4, 2]", "[4, 0.5]"), ("strip.top, strip.right", "strip.top"),
    ("strip.bottom: y, strip.left: x", "strip.left: xy, strip.right: xy"), ("{y: -0.2}", "{y: -8}"),
    ("increments: 4}", "increments: 1}\nnumerics: {max_cutbacks: 0}"),
)  # fmt: skip


T6 = ("    material:", "    element: t6\n    material:")


def sprung(stiffness: str) -> tuple[str, str]:
    return "touching: strip.top}", f"touching: strip.top, spring: {{y: {stiffness}}}}}"


ROLLED = (
    (CYLINDER[0], "type: circle, radius: 20, at: [9, 21.7]"), (", strip.left: x}", "}"),
    ("move: {die: {y: -0.2}}", "feed: {strip.left: {x: 4}}, by: {die: {rz: 0.3}}"),
)  # fmt: skip


class Seeded(NamedTuple):
    """``what`` in words, ``changes`` (old, new) of the case, ``place`` line:column or '' (a run's), ``words`` it must say.

    ``verb``: with which the mistake is met, ``check``, ``run`` or that of a study with its ``options``; ``warns``: it is a
    warning, not an error. ``case``: the good one.
    """

    what: str
    changes: tuple[tuple[str, str], ...]
    place: str
    words: tuple[str, ...]
    warns: bool = False
    verb: str = "check"
    options: tuple[str, ...] = ()
    case: str = CASE


def mesh(points: str, cells: str, top: str = "[2, 3]") -> tuple[str, str]:
    return (
        POINTS,
        f"mesh: {{type: points, points: {points}, cells: {cells}, boundaries: {{top: {top}, right: [1, 2], bottom: [0, 1], left: [0, 3]}}}}",
    )


SQUARE = "[[0, 0], [4, 0], [4, 2], [0, 2]"
FLOW = "{type: voce, s0: 60, Q: 120, b: 8}"

SEEDED = {
    "names and values": [
        Seeded("misspelt key", (("move:", "mvoe:"),), "13:19", ("unknown key 'mvoe'", "did you mean 'move'?")),
        Seeded("unknown kind of tool", (("type: plane", "type: plan"),), "8:15", ("unknown tool 'plan'", "'plane'")),
        Seeded("missing boundary", (("strip.top, str", "strip.tpo, str"),), "10:16", ("unknown boundary 'tpo'", "'top'")),
        Seeded("missing body", (("strip.left", "stirp.left"),), "11:26", ("unknown body 'stirp'", "'strip'")),
        Seeded("missing tool", (("{die: {y", "{dye: {y"),), "13:26", ("unknown tool 'dye'", "'die'")),
        Seeded("name in capitals", (("{die: {y", "{Die: {y"),), "13:26", ("unknown tool 'Die'", "did you mean 'die'?")),
        Seeded(
            "space left out of a round part", (*[("strip", "billet")] * 6, ("space: plane strain\n", "")), "3:3",
            ("'space' is missing", "half the section of a round body", "'space: axisymmetric'"), True,
        ),
        Seeded(
            "list written twice", (("increments: 4}", "increments: 4}\nsteps:\n  - {name: back, move: {die: {y: 0}}}"),), "14:1",
            ("'steps' appears twice (first at line 12)", "put the entries of both under one 'steps:'"),
        ),
        Seeded("key written twice", (("steps:", "fixed: {}\nsteps:"),), "12:1", ("'fixed' appears twice",)),
        Seeded(
            "thickness of a body of revolution", (("plane strain", "axisymmetric\nthickness: 2"),), "3:1",
            ("an axisymmetric problem has no thickness", "whole circumference", "leave it out"),
        ),
        Seeded(
            "two steps of one name", (("steps:\n", "steps:\n  - {name: press}\n"),), "14:12",
            ("two steps are called 'press'",),
        ),
        Seeded(
            "contact given twice", (("fixed:", "  - {surface: [strip.top, strip.right], against: die}\nfixed:"),), "11:5",
            ("appears twice", "keep one"),
        ),
        Seeded("decimal comma in a list", (("[4, 2]", "[4,5, 2]"),), "5:29", ("has 3 values", "numbers have a decimal point")),
        Seeded("steps without dashes", (("  - {name: press, move", "  press: {move"),), "12:1", ("a list is expected", "begin each entry with '- '")),
        Seeded("time of a step", (("increments: 4", "time: 4"),), "13:43", ("unknown key 'time'", "did you mean 'duration'?")),
        Seeded("increment of time", (("increments: 4", "dt: 0.01"),), "13:43", ("unknown key 'dt'", "give 'increments', their number")),
        Seeded("temperature of the case", (("space:", "temperature: 20\nspace:"),), "2:1", ("'temperature'", "takes it as 'T'")),
        Seeded("density", (("nu: 0.3,", "nu: 0.3, rho: 7850,"),), "6:44", ("unknown key 'rho'", "inertia is neglected")),
        Seeded("size of elements for their number", (("n: [8, 4]", "h: 0.5"),), "5:43", ("unknown key 'h'", "give 'n'")),
        Seeded("negative size", (("[4, 2]", "[4, -2]"),), "5:39", ("is -2", "greater than 0")),
        Seeded("no elements", (("[8, 4]", "[8, 0]"),), "5:50", ("is 0", "at least 1")),
        Seeded("not a number", (("70e3", ".nan"),), "6:29", (".nan is not a finite number",)),
        Seeded("incompressible elasticity", (("nu: 0.3", "nu: 0.5"),), "6:39", ("less than 0.5",)),
        Seeded("negative Poisson's ratio of a metal", (("nu: 0.3", "nu: -0.3"),), "6:5", ("is negative", "did you mean 0.3"), warns=True),
        Seeded("unit of another dimension", (("E: 70e3", "E: 70 kN"),), "6:29", ("is not a stress", "'10 GPa'")),
        Seeded("negative friction", (("mu: 0.1", "mu: -0.1"),), "10:85", ("at least 0",)),
        Seeded("softening friction without an end", (("mu: 0.1", "mu: {mu0: 0.3, slope: -1}"),), "10:81", ("'limit'",)),
        Seeded("friction as a number", (("{type: coulomb, mu: 0.1}", "0.1"),), "10:65", ("0.1 is not a valid friction", "{type: coulomb, mu: 0.1}")),
        Seeded(
            "metal of the library, and a tool without a place", ((ELASTIC[0], "type: j2, of: AA6061-O"), (", touching: strip.top", "")), "8:3",
            ("tool 'die' has no position", "'touching'"),
        ),
        Seeded("file of a flow curve alone", ((FLOW, "curve.csv"),), "6:50", ("a curve from a file is {type: table, points: curve.csv}",)),
        Seeded("flow stress as a number", ((FLOW, "60"),), "6:50", ("is 60; a mapping with 'type'", "voce")),
        Seeded("shear factor on an elastic body", (ELASTIC, ("coulomb, mu: 0.1", "shear, m: 0.5")), "10:55", ("give 'k'",)),
        Seeded(
            "table that goes back in time", (("y: -0.2", "y: [[0, 0], [1, -0.2], [0.5, -0.1]]"),), "13:32",
            ("times of a table must increase",),
        ),
        Seeded(
            "tool moved and pushed", (("increments", "push: {die: {y: -3}}, increments"),), "13:56", ("keep one",),
        ),
    ],
    "meshes": [
        Seeded("element without area", (mesh("[[0, 0], [4, 0], [4, 0], [0, 0]]", "[[0, 1, 2, 3]]"),), "5:5", ("area 0",)),
        Seeded("folded element", (mesh("[[0, 0], [4, 0], [1, 0.5], [0, 2]]", "[[0, 1, 2, 3]]"),), "5:5", ("element 0 near (1.25, 0.625) is folded",)),
        Seeded("node that does not exist", (mesh(SQUARE + "]", "[[0, 1, 2, 9]]"),), "5:5", ("outside 0 … 3",)),
        Seeded("node of no element", (mesh(SQUARE + ", [9, 9]]", "[[0, 1, 2, 3]]"),), "5:5", ("belongs to no element",)),
        Seeded(
            "set without a side", (mesh(SQUARE + "]", "[[0, 1, 2, 3]]", "[1, 3]"),), "5:5", ("'top'", "no element edge"),
        ),
        Seeded(
            "two parts that are not joined",
            (
                mesh(
                    "[[0, 0], [4, 0], [4, 1], [0, 1], [4, 1], [0, 1], [4, 2], [0, 2]]", "[[0, 1, 2, 3], [5, 4, 6, 7]]", "[6, 7]"
                ),
            ),
            "5:5", ("same place", "open"),
        ),
        Seeded(
            "mesh across the axis", (("plane strain", "axisymmetric"), ("n: [8, 4]", "n: [8, 4], origin: [-1, 0]")), "5:5",
            ("lies at x ≥ 0", "x = -1"),
        ),
        Seeded(
            "sharp edge over a node", (("type: plane, touching", "type: stamp, width: 4, touching"),), "8:3",
            ("sharp edge", "give 'fillet"),
        ),
    ],
    "strips and wires": [
        Seeded("nose longer than the strip", ((POINTS, "mesh: {type: strip, length: 4, thickness: 2, n: [8, 4], nose: {length: 5, thickness: 1}}"),), "5:5",
               ("the nose is 5 long, but the whole mesh is 4", "make the nose shorter")),
        Seeded("wire in plane strain", ((POINTS, "mesh: {type: wire, length: 4, diameter: 2, n: [8, 4]}"),), "5:18",
               ("a wire is round; use 'strip'", "'space: axisymmetric'")),
    ],
    "units": [
        Seeded("blanks between thousands", (("E: 70e3", "E: 70 000 MPa"),), "6:29", ("between its thousands", "write '70000 MPa'")),
        Seeded("dash of a text program for a minus", (("y: -0.2", "y: –0.2"),), "13:35", ("U+2013", "write '-0.2'")),
        Seeded("modulus in GPa", (("E: 70e3", "E: 70"),), "6:5", ("did you mean 70e3 or '70 GPa'?",), True),
        Seeded(
            "modulus of steel in GPa, elastic", ((ELASTIC[0], "type: elastic, E: 210, nu: 0.3"),), "6:5",
            ("did you mean '210 GPa'?",), True,
        ),
        Seeded(
            "modulus in MPa, case in metres",
            (
                ("space:", "units: {length: m, force: N}\nspace:"), (ELASTIC[0], "type: elastic, E: 210e3, nu: 0.3"),
                ("{y: -0.2}", "{y: -0.002}"),
            ),
            "7:5", ("did you mean '210000 MPa'?",), True,
        ),
        Seeded("modulus in MPa, case in centimetres", (("space:", "units: {length: cm, force: N}\nspace:"),), "7:5", ("did you mean '70000 MPa'?",), True),
        Seeded("flow stress in GPa", (("E: 70e3", "E: 210e3"), ("s0: 60, Q: 120", "s0: 0.25, Q: 0.2")), "6:5", ("less than that of any metal", "did you mean '0.25 GPa'?"), True),
        Seeded(
            "thickness in metres, case in millimetres", (("plane strain", "plane strain\nthickness: 0.01"),), "3:1",
            ("0.01 mm out of the plane", "is the unit right?"), True,
        ),
        Seeded(
            "thickness of a sheet for its width", (("plane strain", "plane strain\nthickness: 0.5"), ("[4, 2]", "[4, 0.5]"), ("-0.2", "-0.05")), "3:1",
            ("is the thickness of body 'strip' in the plane", "the width of a sheet"), True,
        ),
        Seeded("flow stress in Pa", (("s0: 60", "s0: 60e6"),), "6:5", ("flow stress 6e+07", "check the units"), True),
        Seeded("body in metres, case in millimetres", (("[4, 2]", "[0.004, 0.002]"), ("-0.2", "-0.0002")), "5:5", ("measures 0.004 mm",), True),
        Seeded("radius in metres", (CYLINDER, ("radius: 2", "radius: 0.002")), "8:23", ("same unit",)),
        Seeded(
            "push in mN", (("move: {die: {y: -0.2}}, increments: 4", "push: {die: {y: -300e3}}"),), "13:32",
            ("a push of 3e+05 N is", "times what 'strip' can carry", "is the unit right?"), True,
        ),
        Seeded("travel in micrometres", (("y: -0.2", "y: 200"),), "13:32", ("a travel of 200 mm",), True),
        Seeded(
            "turn in degrees", (CYLINDER, ("{y: -0.2}", "{y: -0.2, rz: 90}")), "13:41", ("90 radians", "'90 deg'"), True
        ),
        Seeded(
            "everything in Pa, case in millimetres", (("E: 70e3", "E: 70e9"), ("s0: 60, Q: 120", "s0: 60e6, Q: 120e6")), "6:5",
            ("is not realistic", "did you mean '7e+10 Pa'?"), True,
        ),
        Seeded("friction in percent", (("mu: 0.1", "mu: 10"),), "10:55", ("did you mean 0.1?",), True),
    ],
    "materials and tables": [
        Seeded("flow stress that vanishes", (("Q: 120", "Q: -70"),), "6:44", ("must stay positive", "-10")),
        Seeded("softening flow curve", (("Q: 120", "Q: -20"),), "6:44", ("flow stress falls from", "depend on the mesh"), True),
        Seeded(
            "table of flow stress that falls", ((FLOW, "{type: table, points: [[0, 60], [0.2, 90], [0.5, 70]]}"),), "6:44",
            ("flow stress falls",), True,
        ),
        Seeded("hardening in another unit", (("b: 8}", "b: 8, H: 9e5}"),), "6:44", ("faster than E",), True),
        Seeded(
            "strains in per cent", ((FLOW, "{type: table, points: [[0, 60], [20, 100], [100, 150]]}"),), "6:64",
            ("the strains go up to 100", "did you mean '100 %'"), True,
        ),
        Seeded(
            "prestrain in per cent", ((FLOW, "{type: swift, K: 200, e0: 2, n: 0.2}"),), "6:72",
            ("a prestrain of 2, 200 %", "did you mean '2 %'?"), True,
        ),
        Seeded(
            "exponent in per cent", ((FLOW, "{type: ludwik, s0: 60, K: 200, n: 22}"),), "6:81",
            ("an exponent of 22", "did you mean 0.22?"), True,
        ),
        Seeded(
            "exponent above 1", ((FLOW, "{type: swift, K: 200, e0: 0.1, n: 1.5}"),), "6:81",
            ("an exponent of 1.5", "metals harden with exponents below 1"), True,
        ),
        Seeded(
            "rate of strain without a duration", ((FLOW, "{type: johnson_cook, A: 60, B: 90, n: 0.3, C: 0.02, rate0: 1}"),), "6:44",
            ("depends on the rate of strain", "taken to last 1 s; give 'duration'"), True,
        ),
        Seeded(
            "table that begins where the tool is not",
            (("increments: 4}", "increments: 4}\n  - {name: back, move: {die: {y: [[1, 0], [2, 0.1]]}}}"),), "14:31",
            ("tool 'die' would jump", "it is at -0.2 then", "[1, -0.2]", "'by'"), True,
        ),
        Seeded(
            "table in seconds",
            (("{y: -0.2}}, increments: 4", "{y: [[0, 0], [10, -0.2]]}}, duration: 10"),), "13:32",
            ("the table continues to time 10", "ends at 1, at -0.02 of -0.2", "times count steps"), True,
        ),
        Seeded(
            "step that repeats the travel of the one before",
            (("increments: 4}", "increments: 4}\n  - {name: more, move: {die: {y: -0.2}}}"),), "14:31",
            ("step 'more' moves nothing", "measured from the initial place", "write -0.4", "'by: {die: {y: -0.2}}'"), True,
        ),
        Seeded(
            "step that repeats the push of the one before",
            (("move: {die: {y: -0.2}}, increments: 4}", "push: {die: {y: -300}}}\n  - {name: more, push: {die: {y: -300}}}"),), "14:31",
            ("step 'more' changes nothing", "y = -300 of 'die' is there already", "write -600"), True,
        ),
        Seeded(
            "step that repeats the travel of a support",
            (("increments: 4}", "increments: 4}\n  - {name: on, fixed: {strip.right: {x: 0.1}}}\n  - {name: more, fixed: {strip.right: {x: 0.1}}}"),), "15:40",
            ("step 'more' moves nothing", "'strip.right' is at x = 0.1 already", "write 0.2"), True,
        ),
        Seeded(
            "step that says nothing", (("increments: 4}", "increments: 4}\n  - {name: more}"),), "14:5", ("step 'more' is empty", "a 'duration' if time is to pass"), True,
        ),
        Seeded(
            "table that ends before its step", (("y: -0.2", "y: [[0, 0], [0.5, -0.2]]"),), "13:32",
            ("covers the times 0 … 0.5", "held at -0.2"), True,
        ),
        Seeded(
            "traction whose table ends before its step",
            (("increments: 4}", "increments: 4}\n  - {name: pull, loads: {strip.right: {traction: [[[1, 0], [1.5, 3]], 0]}}}"),), "14:51",
            ("covers the times 1 … 1.5", "held at 3"), True,
        ),
        Seeded(
            "table in the time of its step",
            (("increments: 4}", "increments: 4}\n  - {name: back, move: {die: {y: [[0, -0.2], [1, 0]]}}}"),), "14:31",
            ("step 'back' 1 … 2", "stays at 0", "times are counted over all steps"), True,
        ),
    ],
    "rolls": [
        Seeded("roll that turns against the feed", (*ROLLED, ("rz: 0.3", "rz: -0.3")), "13:58", ("moves against the feed of 'strip.left'", "reverse the sign of 'rz'"), True),
        Seeded("feed away from the roll", (*ROLLED, ("x: 4}", "x: -4}")), "13:39", ("a feed of -4 does not bring 'strip' into contact", "check its sign"), True),
        Seeded("gap larger than the strip", (*ROLLED, ("21.7]", "22.5]")), "13:39", ("does not bring 'strip' into contact", "nearer than 0.5244 to 'die'", "the gap between the tools"), True),
    ],
    "tools and contacts": [
        Seeded(
            "tool inside the body", (("touching: strip.top", "normal: [0, -1], at: [0, 1.9]"),), "8:3",
            ("starts 0.1 inside", "node 44 (4, 2)", "move the tool by (0, 0.1)"), True,
        ),
        Seeded(
            "tool so deep in the body that nodes lie beyond its centre",
            (ELASTIC, ("type: plane, touching: strip.top", "type: circle, radius: 0.8, at: [2, 1.8]")), "8:3",
            ("nearer to its far side", "move the tool out"),
        ),
        Seeded(
            "reversed normal", (("touching: strip.top", "normal: [0, 1], at: [0, 2]"), ("[strip.top, strip.right]", "strip.top")),
            "8:22", ("same way as that of 'strip.top'", "reverse 'normal'"),
        ),
        Seeded(
            "reversed normal of a tool to be placed", (("touching: strip.top", "normal: [0, 1], touching: strip.top"),), "8:3",
            ("never meets", "direction"),
        ),
        Seeded(
            "tool beside the boundary it is to touch", (CYLINDER, ("radius: 2", "radius: 2, at: [9, 0]")), "8:3",
            ("never meets 'strip.top'", "change 'at'"),
        ),
        Seeded(
            "contact never found: motion the wrong way", (("touching: strip.top", "normal: [0, -1], at: [0, 2.5]"), ("y: -0.2", "y: 0.2")),
            "10:5", ("never touches", "nearer than 0.5", "sign"), True,
        ),
        Seeded(
            "tool that touches moved away", (("y: -0.2", "y: 0.2"),), "10:5",
            ("touches 'strip.top+strip.right' at first", "it never presses", "sign"), True,
        ),
        Seeded(
            "tool pushed away", (("move: {die: {y: -0.2}}", "push: {die: {y: 100}}"),), "13:26",
            ("pushes the tool away from 'strip.top+strip.right'", "check the sign and the axis of the force"), True,
        ),
        Seeded(
            "tool deep inside a plastic body", (("touching: strip.top", "normal: [0, -1], at: [0, 1.6]"),), "8:3",
            ("starts 0.4 inside", "move the tool by (0, 0.4)"),
        ),
        Seeded(
            "tool inside a side that has no contact with it", (("contacts:", "  wall: {type: plane, normal: [-1, 0], at: [3.9, 0]}\ncontacts:"),), "9:3",
            ("of 'strip.right'", "lies 0.1 inside tool 'wall'", "add '{surface: strip.right, against: wall}'", "'no_contact'"),
        ),
        Seeded(
            "tool moved into a side that has no contact with it",
            (
                ("contacts:", "  wall: {type: plane, normal: [-1, 0], at: [4.5, 0]}\ncontacts:"),
                ("  - {name: press", "  - {name: push, move: {wall: {x: -1}}}\n  - {name: press"), ("touching: strip.top", "normal: [0, -1], at: [0, 2.1]"),
            ),
            "9:3", ("at time", "'strip.right'", "add '{surface: strip.right, against: wall}'"), True,
        ),
        Seeded(
            "narrow tool between two nodes of a side that has no contact with it",
            (("contacts:", "  pin: {type: polygon, points: [[0, 0], [2, 0], [2, 0.2], [0, 0.2]], at: [3.8, 0.65]}\ncontacts:"),), "9:3",
            ("the edge between nodes 17 and 26 of 'strip.right'", "inside tool 'pin'", "surface: strip.right"),
        ),
        Seeded(
            "tool within the body", (("contacts:", "  pin: {type: circle, radius: 0.4, at: [2.2, 1]}\ncontacts:"),), "9:3",
            ("lies inside body 'strip'", "move the tool out"),
        ),
        Seeded(
            "one side in two contacts with a tool", (("fixed:", "  - {surface: strip.top, against: die}\nfixed:"),), "11:15",
            ("'strip.top' is against 'die' in contacts.0 already", "name it in one of them"),
        ),
        Seeded(
            "bodies that overlap",
            (("tools:", "  other:\n    mesh: {type: rectangle, size: [4, 2], n: [8, 4], origin: [0, -0.6]}\n    material: {type: elastic, E: 70e3, nu: 0.3}\ntools:"), ("strip.left: x", "strip.left: x, other.top: xy")),
            "7:3", ("overlaps body 'strip', by 0.85", "'ties'"), True,
        ),
        Seeded(
            "bodies that lie on one another without a tie",
            (("tools:", "  other:\n    mesh: {type: rectangle, size: [4, 2], n: [8, 4], origin: [0, -2]}\n    material: {type: elastic, E: 70e3, nu: 0.3}\ntools:"), ("strip.left: x", "strip.left: x, other.bottom: xy")),
            "7:3", ("lies on body 'strip'", "'ties'"), True,
        ),
        Seeded(
            "contact with the wrong side", (("[strip.top, strip.right]", "strip.bottom"),), "8:3",
            ("same way as that of 'strip.bottom'", "name the boundary"),
        ),
        Seeded(
            "tool that no contact names", (("contacts:", "  pad: {type: circle, radius: 2, at: [0, 9]}\ncontacts:"),), "9:3",
            ("no contact involves this tool",), True,
        ),
        Seeded("tool radius below two elements", (CYLINDER, ("radius: 2", "radius: 0.8")), "8:23", ("two elements", "refine"), True),
        Seeded("tip of a profile below two elements", ((CYLINDER[0], WEDGE),), "8:59", ("as sharp as a radius of", "'fillet' of 1"), True),
        Seeded("polygon that fits between two nodes", ((CYLINDER[0], TINY),), "8:74", ("one node at most",)),
        Seeded(
            "sharp edge of a polygon over a node", ((CYLINDER[0], BLOCK),), "8:3", ("sharp edge", "give 'fillet"),
        ),
        Seeded(
            "profile walked the wrong way round", ((CYLINDER[0], "type: profile, points: [[9, 4], [0, 0], [-9, 4]], fillet: 3, touching: strip.top"),),
            "8:3", ("walk along them with the tool on the left",),
        ),
        Seeded(
            "profile placed the wrong way round", ((CYLINDER[0], "type: profile, points: [[9, 0], [-9, 0]], at: [0, 0]"), ("[strip.top, strip.right]", "strip.top")),
            "8:3", ("reverse the order of its 'points'",),
        ),
        Seeded(
            "container whose points go counter-clockwise", ((CYLINDER[0], "type: profile, points: [[-1, -1], [5, -1], [5, 2.5], [-1, 2.5]], closed: true, at: [0, 0]"),),
            "8:3", ("points are in the wrong order", "reverse them", "reverse: true"),
        ),
        Seeded(
            "body that does not fit into its cavity", ((CYLINDER[0], "type: circle, radius: 3, concave: true, touching: strip.top"),),
            "8:3", ("does not fit into it",),
        ),
        Seeded(
            "polygon on the far side of the body", ((CYLINDER[0], "type: polygon, points: [[-6, -2], [6, -2], [6, -1], [-6, -1]], fillet: 0.4, at: [0, 0]"), ("[strip.top, strip.right]", "strip.top")),
            "8:3", ("put it on the other side",),
        ),
        Seeded("tool that fits between two nodes", (CYLINDER, ("radius: 2", "radius: 0.1")), "8:23", ("one node at most",)),
        Seeded("absolute penalty of the paper", (("mu: 0.1}", "mu: 0.1}, enforcement: {type: penalty, k_n: 1e10}"),), "10:91", ("k_n = 1e+10, beta = 5.3e+04", "leave it out"), True),
        Seeded(
            "small strain where there is none", (("y: -0.2", "y: -1"), ("plane strain", "plane strain\nkinematics: small")), "3:1",
            ("tools press 'strip' in by 1", "strains or rotations of 0.5", "use 'finite'"), True,
        ),
        Seeded(
            "small strain that a support exceeds", (("increments: 4}", "fixed: {strip.right: {x: 0.8}}, increments: 4}"), ("plane strain", "plane strain\nkinematics: small")), "3:1",
            ("supports of 'strip' move by 0.8 against each other, 4 apart", "use 'finite'"), True,
        ),
        Seeded(
            "sides that meet at a corner, on the undeformed surface",
            (("plane strain", "plane strain\nkinematics: small\ncontact_geometry: reference"),), "12:6",
            ("does not have at its corner at (4, 2)", "a contact of its own"),
        ),
        Seeded("tool through the support", (("y: -0.2", "y: -2.5"),), "10:5", ("reaches 0.5 beyond node 7", "travel larger")),
        Seeded(
            "tools that cross",
            (
                ("contacts:", "  bed: {type: plane, normal: [0, 1], at: [0, 0]}\ncontacts:\n  - {surface: strip.bottom, against: bed}"),
                ("strip.bottom: y, ", ""), ("y: -0.2", "y: -2.5"),
            ),
            "12:5", ("'bed' and 'die' cross", "overlap by"),
        ),
        Seeded(
            "two tools on the same points",
            (("contacts:", "  twin: {type: plane, touching: strip.top}\ncontacts:\n  - {surface: strip.top, against: twin}"),
             ("{die: {y: -0.2}}", "{die: {y: -0.2}, twin: {y: -0.2}}")),
            "12:5", ("press the same points", "keep one"), True,
        ),
    ],
    "new meshes": [
        Seeded("size in metres", (T6, ("steps:", "remesh: {size: {far: 0.0005 mm}}\nsteps:")), "13:17", ("it asks for", "a body has 5 000 000 at most", "or leave it out")),
        Seeded("size of the body for that of an element", (T6, ("steps:", "remesh: {size: {far: 4}}\nsteps:")), "13:17", ("elements of 4 in body 'strip'", "'far' is the size of an element"), True),
        Seeded("sizes exchanged", (T6, ("steps:", "remesh: {size: {far: 0.1, near_tools: 0.2}}\nsteps:")), "13:10", ("'near_tools' is 0.2, more than 'far', 0.1",)),
        Seeded("remesh: true", (T6, ("steps:", "remesh: true\nsteps:")), "13:9", ("write 'auto', 'off' or a mapping",)),
        Seeded(
            "fillet finer than the smallest elements", (T6, (CYLINDER[0], "type: stamp, width: 3, fillet: 0.01, at: [0, 2]"), ("steps:", "remesh: auto\nsteps:")),
            "9:32", ("new meshes have no elements smaller than", "'remesh.size.least:"), True,
        ),
        Seeded("way between meshes in metres", (T6, ("steps:", "remesh: {when: {travel: 0.0001}}\nsteps:")), "13:17", ("makes 2e+03 meshes, and 'at_most' allows 200", "is the unit right?"), True),
        Seeded("elastic body", (ELASTIC, T6, ("steps:", "remesh: auto\nsteps:")), "13:9", ("no body flows plastically", "leave it out")),
    ],
    "springs and forces": [
        Seeded("stiffness of another dimension", (sprung("5 kN"),), "8:55", ("'5 kN' is not a force per length", "like '2 kN/mm'")),
        Seeded("spring pushed", (sprung("500"), ("move: {die: {y: -0.2}}", "push: {die: {y: -100}}")), "13:32", ("is mounted on a spring", "by force over stiffness")),
        Seeded("spring as stiff as nothing is", (sprung("1e12"),), "8:52", ("times that of the bodies", "needs no spring"), True),
        Seeded("stiffness in kN/mm without its unit", (sprung("5"),), "", ("the spring, 5, took up the rest", "use 'push'"), True, "run"),
        Seeded("turn in a push", (("move: {die: {y: -0.2}}", "push: {die: {y: -100, rz: 5}}"),), "13:41", ("unknown key 'rz'", "did you mean 'm'?")),
        Seeded("moment in units of force", (("move: {die: {y: -0.2}}", "push: {die: {y: -100, m: 10 kN}}"),), "13:44", ("'10 kN' is a force, and a moment is meant", "3 kN*mm/mm")),
        Seeded("small turn in degrees", (CYLINDER, ("{y: -0.2}", "{y: -0.2, rz: 7}")), "13:41", ("a turn of 7 radians, 401 degrees", "for degrees write '7 deg'"), True),
    ],
    "symmetry": [
        Seeded(
            "round tool off the line of symmetry", ((CYLINDER[0], "type: circle, radius: 2, at: [0.5, 4]"),), "8:34",
            ("reaches across the line of symmetry of 'strip', x = 0, by 1.5", "there would be two tools that overlap", "under 'no_contact'"), True,
        ),
        Seeded(
            "round tool off the axis, across it", (("plane strain", "axisymmetric"), (CYLINDER[0], "type: circle, radius: 2, at: [0.5, 4]")), "8:34",
            ("reaches across the axis by 1.5", "centre it there"), True,
        ),
        Seeded(
            "billet that hangs in its container", (("plane strain", "axisymmetric"), ("fixed: {strip.bottom: y, strip.left: x}\n", ""),
             ("contacts:", "  wall: {type: plane, normal: [-1, 0], at: [4, 0]}\ncontacts:\n  - {surface: strip.right, against: wall, friction: {type: coulomb, mu: 0.1}}"),
             ("[strip.top, strip.right]", "strip.top")),
            "4:3", ("only friction holds it along y against the tools that press it",), True,
        ),
        Seeded("plane stress of a long body", (("space: plane strain", "space: plane stress\nthickness: 1000"),), "3:1", ("plane stress is for thin sheets", "'space: plane strain'"), True),
    ],
    "supports": [
        Seeded(
            "body free to slide", ((", strip.left: x", ""), (", friction: {type: coulomb, mu: 0.1}", "")), "4:3",
            ("free to move along x", "hold it there with 'fixed'"),
        ),
        Seeded("body free to turn", (("strip.bottom: y, strip.left: x", "strip.bottom-left: xy"), ("strip.top, strip.right", "strip.right"),
                ("touching: strip.top", "normal: [-1, 0], at: [9, 0]"), ("{y: -0.2}", "{x: -5}")), "4:3", ("turn about", "until a tool touches"), True),
        Seeded(
            "body free along its axis", (("plane strain", "axisymmetric"), ("strip.bottom: y, ", ""), ("touching: strip.top", "normal: [0, -1], at: [0, 3]")),
            "4:3", ("move along -y", "nothing carries what they press with"), False,
        ),
        Seeded(
            "symmetry line of a plane problem at a bore", (("plane strain", "axisymmetric"), ("n: [8, 4]", "n: [8, 4], origin: [4.5, 0]")),
            "11:26", ("it holds a bore of radius 4.5", "leave it out", "{x: 0}"), True,
        ),
        Seeded(
            "clamped end under the tool", (("strip.left: x", "strip.left: xy"),), "10:5",
            ("is held along the normal of tool 'die'", "support 'strip.left', which meets the contact surface there, only along that surface"),
        ),
        Seeded(
            "held nodes under the tool", (("strip.bottom: y,", "strip.bottom: y, strip.top: y,"),), "10:5",
            ("is held along the normal of tool 'die'", "take the support off"),
        ),
    ],
    "ends of steps": [
        Seeded(
            "force of another tool", (("increments: 4}", "until: {force: {punch: {y: 20}}}}"),), "13:59", ("unknown tool 'punch'", "known: 'die'"),
        ),
        Seeded(
            "travel beyond the step's", (("increments: 4}", "until: {travel: {die: {y: -0.3}}}}"),), "13:66", ("never reaches y = -0.3", "let it go further"), True,
        ),
        Seeded(
            "table from the initial place after an early end",
            (("increments: 4}", "until: {force: {die: {y: 20}}}}\n  - {name: on, move: {die: {y: [[1, -0.2], [2, -0.3]]}}}"),),
            "14:29", ("wherever step 'press' ended", "with 'by'"),
        ),
        Seeded(
            "table across an early end", (("move: {die: {y: -0.2}}, increments: 4}", "move: {die: {y: [[0, 0], [2, -0.2]]}}, until: {force: {die: {y: 20}}}}\n  - {name: on}"),),
            "13:32", ("the table continues after time 1", "end it at 1"),
        ),
        Seeded(
            "tool that is gone", (("increments: 4}", "increments: 4}\n  - {name: release, remove_tools: true}\n  - {name: again, by: {die: {y: -0.1}}}"),),
            "15:24", ("step 'release' removes all tools", "'die' does nothing then"),
        ),
        Seeded(
            "travel with the wrong sign", (("increments: 4}", "until: {travel: {die: {y: 0.1}}}}"),), "13:66", ("never reaches y = 0.1", "check the sign"), True,
        ),
        Seeded(
            "force in kN without its unit", (("increments: 4}", "until: {force: {die: {y: 0.2}}}}"),), "", ("ends after", "is that number in the units of the case?"), True, "run",
        ),
        Seeded(
            "contact that is not lost", (("increments: 4}", "until: {contact: {die: leaves}}}"),), "", ("until.contact.die (it touches) was not met", "let the tool go back further"), True, "run",
        ),
        Seeded(
            "force with the wrong sign", (("increments: 4}", "until: {force: {die: {y: -20}}}}"),), "", ("until.force.die.y", "was not met", "check the sign"), True, "run",
        ),
        Seeded(
            "end that is there from the beginning", (("increments: 4}", "until: {contact: {die: touches}}}"),), "", ("until.contact.die is met when the step begins",), False, "run",
        ),
    ],
    "found only by running": [
        Seeded(
            "side that walks through a wall", (("contacts:", "  wall: {type: plane, normal: [-1, 0], at: [4, 0]}\ncontacts:\n  - {surface: strip.bottom, against: wall}"),), "",
            ("of 'strip.right'", "inside tool 'wall', which no contact of that side is against", "'surface: strip', the whole outline"), verb="run",
        ),
        Seeded(
            "tool that steps through the body in one increment",
            (*BRIDGE, ("type: plane, touching: strip.top", "type: circle, radius: 1.0, at: [2, 4]")),
            "", ("passed through node",), False, "run",
        ),
        Seeded(
            "polygon that steps through the body in one increment",
            (*BRIDGE, ("type: plane, touching: strip.top", "type: polygon, points: [[-1, -0.6], [1, -0.6], [1, 0.6], [-1, 0.6]], fillet: 0.5, at: [2, 4]")),
            "", ("passed through node",), False, "run",
        ),
        Seeded(
            "tool pushed away from the body", (("move: {die: {y: -0.2}}", "push: {die: {y: 5}}"),), "", ("touches nothing", "sign"), False, "run",
        ),
        Seeded(
            "penalty so soft that the tool sinks in",
            (("mu: 0.1}", "mu: 0.1}, enforcement: {type: penalty, beta: 0.001}"),), "", ("inside the tool", "'beta'"), True, "run",
        ),
        Seeded(
            "penalised support that hides the residual",
            ((ELASTIC[0], "type: elastic, E: 1e3, nu: 0"),
             ("contacts:", "  vice: {type: plane, normal: [1, 0], at: [0, 0]}\ncontacts:\n  - {surface: strip.left, against: vice, enforcement: {type: penalty, k_n: 1e6}}"),
             ("strip.left: x", "strip.right: x"), ("{die: {y: -0.2}}", "{die: {y: -1e-9}, vice: {x: 0.2}}")),
            "", ("not above the tolerance of equilibrium", "forces are at work elsewhere"), True, "run",
        ),
        Seeded(
            "small strain that is none in the answer", (("y: -0.2", "y: -1"), ("plane strain", "plane strain\nkinematics: small")), "",
            ("no longer holds", "'kinematics: finite'", "'allow_large_strain: true'"), False, "run",
        ),
        Seeded(
            "flow curve that ends before the strains do", ((FLOW, "{type: table, points: [[0, 60], [0.01, 100]]}"),), "",
            ("ends at a plastic strain of 0.01", "was used up to"), True, "run",
        ),
        Seeded(
            "tool that turns through the body in one increment",
            ((", friction: {type: coulomb, mu: 0.1}", ""), ELASTIC, ("[strip.top, strip.right]", "strip.top"),
             (CYLINDER[0], "type: polygon, points: [[-2, -2], [2, -2], [2, 2], [-2, 2]], fillet: 1, at: [2, 4]"),
             ("strip.bottom: y, strip.left: x", "strip.bottom: xy"), ("y: -0.2", "y: -0.05"),
             ("increments: 4}", "increments: 4}\n  - {name: turn, move: {die: {rz: 360 deg}}, increments: 1}\nnumerics: {max_cutbacks: 0}")),
            "", ("turned by 360° in one increment, right through 'strip'",), False, "run",
        ),
        Seeded(
            "tool half the height inside an elastic body",
            (ELASTIC, ("strip.bottom: y", "strip.bottom: xy"), ("touching: strip.top", "normal: [0, -1], at: [0, 0.8]"), ("[strip.top, strip.right]", "strip.top")),
            "", ("starts 1.2 inside 'strip.top'", "Shorter increments begin with the same overlap", "'touching'"), False, "run",
        ),
        Seeded(
            "free side that folds under the support beside it",
            (("[strip.top, strip.right]", "strip.top"), ("mu: 0.1", "mu: 3"), ("strip.bottom: y", "strip.bottom: xy"), ("y: -0.2", "y: -0.92"), ("increments: 4", "increments: 8")),
            "", ("folds over itself", "'strip.right' slides past the support 'strip.bottom'", "put a tool there"), True, "run",
        ),
        Seeded(
            "metal without room", (("strip.left: x", "strip.left: x, strip.right: x"), ("[strip.top, strip.right]", "strip.top"), ("-0.2", "-0.4")), "",
            ("has lost more than 20 % of its volume", "leave it no room"), True, "run",
        ),
        Seeded(
            "metal without a flow curve", ((ELASTIC[0], "type: elastic, E: 70e3, nu: 0.3"), ("-0.2", "-0.4")), "",
            ("is elastic with the modulus of a metal", "give it a 'j2' material"), True, "run",
        ),
        Seeded(
            "plate that tips over the edge of the sheet",
            (ELASTIC, ("[4, 2]", "[4, 1]"), ("strip.bottom: y, strip.left: x", "strip.bottom: xy"), ("strip.top, strip.right", "strip.top"), (CYLINDER[0], "type: profile, points: [[-9, 0], [9, 0]], at: [6, 1]"),
             ("move: {die: {y: -0.2}}, increments: 4}", "push: {die: {y: -20, m: 0}}}\nnumerics: {max_cutbacks: 1}")),
            "", ("along a line through (6, 1)", "reaches from"), False, "run",
        ),
        Seeded(
            "contact that is never made",
            (("touching: strip.top", "normal: [0, -1], at: [0, 2.5]"), ("strip.left: x", "strip.left: x, strip.right: {x: 0.01}")),
            "", ("never touched", "so its forces are zero"), True, "run",
        ),
        Seeded(
            "body released by its only support",
            (("increments: 4}", "increments: 4}\n  - {name: up, move: {die: {y: 1}}, fixed: {strip.bottom: free, strip.left: free}, increments: 2}"),),
            "", ("without its contacts body 'strip' can move along x and y and to turn", "support the body"), False, "run",
        ),
    ],
    "three dimensions": [
        Seeded(what, changes, place, words, warns, case=IN_SPACE)
        for what, changes, place, words, warns in (
            ("block in metres, case in millimetres", (("[10, 5, 10]", "[0.01, 0.005, 0.01]"),), "5:5", ("measures 0.01 mm", "is the unit right?"), True),
            ("tool in metres, case in millimetres", (("radius: 20", "radius: 0.02"),), "8:50", ("0.02 mm against bodies of 10 mm", "are both in the same unit?"), True),
            ("travel in micrometres, case in millimetres", (("y: -0.5", "y: -500"),), "13:33", ("a travel of 500 mm past bodies of 10 mm", "is the unit right?"), True),
            (
                "STL file with z upwards", ((ROLL, f"{CAP}, touching: block.top, at: [0, 0, 15]"),), "8:3",
                ("faces -z, but the tool moves along -y", "'turn: [-90 deg, 0, 0]'"), True,
            ),
            ("STL file that stands in the body", ((ROLL, f"{CAP}, turn: [-90 deg, 0, 0], at: [0, 24, 0]"),), "8:3", ("starts 1.031 inside 'block.top'", "move the tool by (0, 1.031, 0) mm"), False),
            ("normals of an STL file inside out", ((ROLL, "type: stl, file: ball.stl, touching: block.top, at: [0, 0, 0]"),), "8:3", ("inside out", "'reverse: true'"), False),
            ("cavity in the place of a roll", (("radius: 20}", "radius: 6, concave: true}"),), "8:3", ("does not fit into it", "leave 'concave' out"), False),
            ("contact with another side than the one that is pressed", (("surface: block.top", "surface: block.right"),), "8:3", ("of 'block.top'", "add '{surface: block.top, against: roll}' to 'contacts', or"), True),
            ("space left out", (("space: solid\n", ""),), "4:5", ("bricks need 'space: solid'", "where 'space' is left out a case is in plane strain", "write 'space: solid'"), False),
            ("place of two components", (("at: [0, 0, 0]", "at: [0, 0]"),), "8:101", ("'space: solid' has 3", "write [x, y, z]"), False),
            ("plane of symmetry held along itself", (("block.left: x", "block.left: y"),), "10:5", ("is held along the normal of tool 'roll'", "write 'block.left: x'"), False),
            ("body inside the tool", (("touching: block.top, at: [0, 0, 0]", "at: [0, 24, 0]"),), "8:3", ("starts 1 inside 'block.top'", "move the tool by (0, 1, 0) mm"), False),
            ("plane of symmetry left out", ((", block.back: z", ""), (", friction: {type: coulomb, mu: 0.1}", "")), "4:3", ("free to move along z", "like 'block.back: z'"), False),
            ("plane of symmetry left out, with friction", ((", block.back: z", ""),), "4:3", ("only friction holds it along z", "'block.back: z'"), True),
            (
                "planes of symmetry left out under a ball", ((ROLL, BALL), (", block.left: x, block.back: z", "")), "4:3",
                ("only contact holds it along x and z", "'block.left: x, block.back: z'"), True,
            ),
            (
                "roll off the plane of symmetry", (("at: [0, 0, 0]", "at: [0.5, 0, 0]"),), "8:101",
                ("plane of symmetry of 'block', x = 0, by 19.5 and is centred at x = 0.5", "centre it there", "under 'no_contact'"), True,
            ),
            (
                "roll moved across a plane of symmetry", (("y: -0.5", "x: 1, y: -0.5"),), "13:5",
                ("plane of symmetry of 'block', x = 0, and moves or turns across it", "move it along the plane, or model the whole"), True,
            ),
            (
                "pyramid turned against the planes of a quarter", ((ROLL, VICKERS), ("steps:", "output: {mirror: [left, back]}\nsteps:")), "8:3",
                ("plane of symmetry 'left', x = 0, and is not its own mirror image", "turn it by -20° about +y"), False,
            ),
            (
                "flat die moved across a plane of symmetry",
                ((ROLL, "type: plane, touching: block.top"), ("y: -0.5", "x: 1, y: -0.5"), ("steps:", "output: {mirror: [left, back]}\nsteps:")), "14:5",
                ("plane of symmetry 'left', x = 0, and moves or turns across it", "move it along the plane, or model the whole"), False,
            ),
            (
                "cut of a sector that nothing holds",
                (
                    (BRICKS, "type: cylinder, radius: 10, height: 5, n: [3, 3, 4], angle: 90 deg"), (ROLL, "type: plane, touching: block.top"),
                    (", block.left: x, block.back: z", ", block.base: z"),
                ),
                "4:3", ("a sector ends in the plane x = 0", "'block.cap: x'"), True,
            ),
            (
                "cut of a sector that nothing holds, its bottom held all ways",
                (
                    (BRICKS, "type: cylinder, radius: 10, bore: 5, height: 5, n: [3, 3, 4], angle: 60 deg"), (ROLL, "type: plane, touching: block.top"),
                    ("block.bottom: y, block.left: x, block.back: z", "block.bottom: xyz, block.base: z"),
                ),
                "4:3", ("the cut side 'block.cap' of the sector is free", "lacks 'block.cap: normal'"), True,
            ),
            (
                "round side as a plane of symmetry, of a part that is pushed",
                (
                    (BRICKS, "type: cylinder, radius: 10, bore: 5, height: 5, n: [3, 3, 4], angle: 60 deg"), (ROLL, "type: plane, touching: block.top"),
                    ("block.left: x, block.back: z", "block.base: z, block.cap: normal"), ("move: {roll: {y: -0.5}}", "push: {roll: {y: -500}}"),
                    ("steps:", "output: {mirror: [block.inner]}\nsteps:"),
                ),
                "12:10", ("'block.inner', which is not flat", "leave it out"), False,
            ),
            (
                "half that is shown as a whole, and is not held where it is cut",
                ((", block.left: x, block.back: z", ", block.left: x"), ("block.bottom: y", "block.bottom: xyz"), ("steps:", "output: {mirror: back}\nsteps:")),
                "12:10", ("is no plane of symmetry", "modelled twice"), False,
            ),
            ("motion of the wrong sign", (("y: -0.5", "y: 0.5"),), "10:5", ("only goes away from it, by up to 0.5", "check the sign and the axis"), True),
            ("force of the wrong sign", (("move: {roll: {y: -0.5}}", "push: {roll: {y: 500}}"),), "13:26", ("pushes the tool away from 'block.top'", "check the sign and the axis"), True),
            ("motion along the wrong axis", (("y: -0.5", "z: -0.5"),), "10:5", ("only goes along it", "it never presses"), True),
            (
                "sector in degrees without the unit",
                ((BRICKS, "type: cylinder, radius: 10, height: 5, n: [3, 3, 4], angle: 90"), (", block.left: x, block.back: z", ", block.base: z, block.cap: x")),
                "5:72", ("must be at most 6.28319", "for degrees write '90 deg'"), False,
            ),
            (
                "tool turned by degrees without the unit",
                ((ROLL, "type: pyramid, of: vickers, radius: 2, touching: block.top, at: [0, 0, 0], turn: [0, 45, 0]"),),
                "8:85", ("a turn of 45 radians", "write '45 deg'"), True,
            ),
            ("tool that never touches", (("touching: block.top, at: [0, 0, 0]", "at: [0, 26, 0]"),), "10:5", ("never touches 'block.top'", "never comes nearer than 0.5"), True),
            ("side of another name", (("block.back: z", "block.rear: z"),), "11:41", ("unknown boundary 'rear'", "'back', 'front'"), False),
            ("axis of a roll towards the body", (("axis: [0, 0, 1]", "axis: [0, 1, 0]"),), "8:3", ("never meets 'block.top'", "'axis' points at the boundary"), False),
            ("plane that looks away from the body", ((ROLL, "type: plane, normal: [0, 1, 0], at: [0, 5, 0]"),), "8:23", ("stands behind the surface", "reverse 'normal'"), False),
            ("body without a support beneath", (("block.bottom: y, ", ""),), "4:3", ("free to move along -y", "'fixed'"), False),
            (
                "table that the body never comes to",
                (
                    ("block.bottom: y, ", ""), ("tools:\n", "tools:\n  table: {type: plane, normal: [0, 1, 0], at: [0, -2, 0]}\n"),
                    ("contacts:\n", "contacts:\n  - {surface: block.bottom, against: table}\n"),
                ),
                "4:3", ("free to move along -y", "let a tool stand against it"), False,
            ),
            ("thickness of a body in space", (("space: solid", "space: solid\nthickness: 10"),), "3:1", ("have no thickness",), False),
            ("mesh of the plane", ((BRICKS, "type: rectangle, size: [10, 5], n: [5, 3]"),), "5:5", ("'rectangle' is a mesh of the plane", "'extruded'"), False),
            ("tool of the plane", ((ROLL, "type: circle, radius: 20, touching: block.top, at: [0, 0, 0]"),), "8:3", ("is a tool of the plane", "type: extruded"), False),
            ("far upset, which wears elements out", ((ROLL, "type: plane, touching: block.top"), ("y: -0.5", "y: -4")), "4:3", ("together by 4 of 5", "'remesh: auto'"), True),
            (
                "force that presses far", ((ROLL, "type: plane, touching: block.top"), ("move: {roll: {y: -0.5}}", "push: {roll: {y: -500 kN}}")),
                "4:3", ("as far as it yields to their force", "'remesh: auto'"), True,
            ),
            ("steel without a flow curve, pressed far", ((ROLL, "type: plane, touching: block.top"), (SWIFT, "type: elastic, E: 210e3, nu: 0.3"), ("y: -0.5", "y: -2")), "6:5", ("together by 2 of 5", "metals yield long before"), True),
            ("tool turned by an unknown key", (("touching: block.top,", "touching: block.top, turn: 30 deg,"),), "8:101", ("unknown key 'turn'", "its 'axis' says how it stands"), False),
            ("semicolons in a list", (("[10, 5, 10]", "[10; 5; 10]"),), "5:30", ("commas separate the entries of a list", "write 10, 5, 10"), False),
            ("new meshes in space", (("steps:", "remesh: auto\nsteps:"),), "12:1", ("'remesh' is not available in space yet",), False),
            ("far too fine a mesh", (("n: [5, 3, 5]", "n: [500, 250, 500]"),), "5:5", ("6.25e+07 elements", "take fewer"), False),
        )
    ],
    "studies": [
        Seeded(f"{what}: `{' '.join((verb, *options))}`", (), "", words, verb=verb, options=options)
        for what, verb, options, words in (
            ("nothing to vary", "sweep", ("--measure", "die.fy"), ("nothing to vary",)),
            ("nothing to measure", "sweep", ("--set", f"{MU}=0,0.1"), ("no measure",)),
            ("no values", "sweep", ("--set", f"{MU}=", "--measure", "die.fy"), ("there is no value",)),
            ("misspelt path", "sweep", ("--set", "contacts.0.friction.nu=0,0.1", "--measure", "die.fy"), ("unknown key 'nu'",)),
            ("misspelt measure", "sweep", ("--set", f"{MU}=0,0.1", "--measure", "max(die.fz)"), ("die.fz",)),
            ("range without a number", "sweep", ("--set", f"{MU}=lin(0,0.1)", "--measure", "die.fy"), ("lin(a, b, n)",)),
            ("one value that cannot be", "sweep", ("--set", f"{MU}=0.1,-0.1", "--measure", "die.fy"), ("at least 0",)),
            ("scatter beyond what can be", "sweep", ("--set", f"{MU}=normal(0,1)", "--measure", "die.fy"), ("cut the tails",)),
            ("samples of nothing", "sweep", ("--set", f"{MU}=0,1", "--measure", "die.fy", "--samples", "8"), ("is scattered",)),
            ("order from two meshes", "converge", ("--mesh", "1,2", "--measure", "die.fy"), ("at least three",)),
        )
    ],
}  # fmt: skip


def case_of(seeded: Seeded) -> str:
    """The good case with the mistake in it."""
    text = seeded.case
    for old, new in seeded.changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def said(seeded: Seeded, folder: Path) -> tuple[int, list[str]]:
    """Exit code, and the lines reported for a seeded mistake, the file called ``case.yaml``."""
    if "ball.stl" in case_of(seeded):
        points, triangles = icosphere(20.0, 1)
        write(folder / "ball.stl", points, triangles[:, ::-1])
    if "cap.stl" in case_of(seeded):
        points, triangles = icosphere(20.0, 2)
        write(folder / "cap.stl", points, triangles[(points[triangles, 2] < -9.0).all(axis=1)])
    path = folder / "case.yaml"
    path.write_text(case_of(seeded), encoding="utf-8")
    options = [
        "--out",
        str(folder / "out"),
        "--quiet",
        "--set",
        "output.pictures=false",
        "--set",
        "output.report=false",
    ]
    given = {"check": [], "run": options}.get(seeded.verb, [*seeded.options, "--out", str(folder / "study"), "--jobs", "1"])
    result = CliRunner().invoke(app, [seeded.verb, str(path), *given])
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).replace(str(path), "case.yaml") for line in result.stderr.splitlines()]
    return result.exit_code, [line for line in lines if line.strip()]


def the_line(seeded: Seeded, lines: list[str]) -> str:
    """The line that reports the mistake; '' if none has its words."""
    return next((line for line in lines if all(word in line for word in seeded.words)), "")
