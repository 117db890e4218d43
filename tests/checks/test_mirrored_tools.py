"""Tools at planes of symmetry that a case names: their own images there, while they move too; and what they are in the whole."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import prensa as pr
from prensa.checks.before.off_centre import off_centre
from prensa.cli import app
from prensa.model.schema import loads
from prensa.output import answer
from prensa.output.whole import Share, findings, images_of, mirror_findings, of_whole, shares_of
from prensa.result.presses import use_of

QUARTER = """\
name: quarter
space: solid
bodies: {b: {mesh: {type: box, size: [6, 2, 6], n: [6, 2, 6]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools:
  die: {TOOL, touching: b.top}
contacts: [{surface: b.top, against: die, friction: {mu: MU}}]
fixed: {b.bottom: y, b.left: x, b.back: z}
steps:
- {name: press, by: {die: {y: -0.2}}}
output: {mirror: [left, back]}
"""
BOX, WEDGE = "type: box, size: [6, 2, 6], n: [6, 2, 6]", "type: cylinder, radius: 6, height: 2, n: [4, 2, 4], angle: 60 deg"
SECTOR = QUARTER.replace(BOX, WEDGE).replace("b.left: x, b.back: z", "b.base: z, b.cap: normal")
SECTOR = SECTOR.replace("[left, back]", "[b.base, b.cap]")
FLAT = "type: plane"
BALL = "type: sphere, radius: 2"
PLATE = f"type: polyhedron, points: {[[x, y, z] for x in (-3, 9) for y in (0, 2) for z in (-3, 9)]}"
PUNCH = "type: revolved, section: {type: stamp, width: 4, fillet: 0.5}"
PLAN = "plan: {type: polygon, points: [[-3, -4], [3, -4], [3, 4], [-3, 4]]}"
ORIGIN = "at: [0, 0, 0]"


def case(tool: str, by: str = "y: -0.2", mu: float = 0.1, text: str = QUARTER, **changes: str) -> pr.Case:
    """A part under a tool."""
    text = text.replace("TOOL", tool).replace("y: -0.2", by).replace("MU", str(mu))
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    return loads(text)


def refused(given: pr.Case) -> list[str]:
    return [str(f) for f in mirror_findings(pr.discretise(given.problem), given)]


def share(given: pr.Case, tool: str = "die") -> Share:
    return shares_of(pr.discretise(given.problem), given)[tool]


# ------------------------------------------------------------------------------------------------------ where they stand
@pytest.mark.parametrize(
    ("tool", "mirror", "words"),
    [
        ("type: pyramid, of: vickers, turn: [0, 20 deg, 0]", "[left, back]", "turn it by -20° about +y ('turn'), or model"),
        ("type: pyramid, of: vickers, turn: [0, 30 deg, 0]", "[back]", "turn it by 15° about +y"),
        ("type: pyramid, of: berkovich", "[left, back]", "image there (off by 1.41 near the bodies)"),
        ("type: pyramid, of: berkovich, turn: [0, 50 deg, 0]", "[left]", "turn it by -20° about +y"),
        (f"{PLATE}, turn: [0, 0, 5 deg]", "[left, back]", "is not its own mirror image there"),
        ("type: plane, normal: [0.2, -1, 0]", "[left, back]", "let its 'normal' lie along the plane"),
        ("type: plane, normal: [0.1, -1, 0.3]", "[back]", "'back', z = 0, and is not its own mirror image"),
        ("type: sphere, radius: 2, at: [0.5, 0, 0]", "[left]", "by 1.5 and is centred at x = 0.5"),
    ],
)
def test_tools_that_are_not_their_own_images_are_refused(tool: str, mirror: str, words: str) -> None:
    """Across planes that ``mirror`` names, in one sentence with the plane and a remedy; across held sides they are warned of."""
    given = case(tool if "at:" in tool or "plane" in tool else f"{tool}, {ORIGIN}", mirror=("[left, back]", mirror))
    (said,) = refused(given)
    assert said.startswith("tools.die") and words in said and f"without {mirror.strip('[]').split(',')[0]!r} in 'mirror'" in said
    (warned,) = [str(f) for f in off_centre(pr.discretise(given.problem))]
    assert "under 'no_contact'" in warned
    assert [str(f) for f in findings(pr.discretise(given.problem), given) if "mirror image" in str(f)] == [said]


@pytest.mark.parametrize(
    "tool",
    [FLAT, f"{PLATE}, {ORIGIN}", f"{PUNCH}, {ORIGIN}", f"{BALL}, {ORIGIN}", f"{BALL}, at: [3, 0, 3]",
     f"type: pyramid, of: vickers, {ORIGIN}", f"type: pyramid, of: vickers, turn: [0, 45 deg, 0], {ORIGIN}",
     *(f"type: extruded, section: {{{section}}}, axis: [0, 0, 1], at: [0, 0, {z}]"
       for section in ("type: circle, radius: 2", "type: stamp, width: 4, fillet: 1") for z in (2.5, 30)),
     f"type: swept, section: {{type: profile, points: [[-8, 0], [0, 0], [0, 8]]}}, {PLAN}, {ORIGIN}"],
)  # fmt: skip
def test_others_are_not(tool: str) -> None:
    """Own images, plates that are only drawn beyond, tools on one side, a roll whose reference point is far along its axis."""
    given = case(tool)
    assert refused(given) == [] and list(off_centre(pr.discretise(given.problem))) == []


def test_one_of_three_planes_of_a_berkovich_pyramid_is_enough() -> None:
    """Of a half, or of a sector of 60° whose planes are its own."""
    assert refused(case(f"type: pyramid, of: berkovich, {ORIGIN}", mirror=("[left, back]", "[back]"))) == []
    assert refused(case(f"type: pyramid, of: berkovich, {ORIGIN}", text=SECTOR)) == []
    assert "'b.base'" in refused(case(f"type: pyramid, of: berkovich, turn: [0, 10 deg, 0], {ORIGIN}", text=SECTOR))[0]


def test_a_face_of_a_groove_is_one_of_two() -> None:
    """Where the bodies see it, it does not reach the plane of symmetry; where they come to its end, it is warned of."""
    groove = "type: plane, normal: [-1, 5, 0]"
    bottom = {
        "touch": ("touching: b.top", "touching: b.bottom"), "fixed": ("b.bottom: y", "b.top: y"),
        "side": ("b.top, against", "b.bottom, against"),
    }  # fmt: skip
    given = case(groove, by="y: 0.2", **bottom)
    assert refused(given) == [] and list(off_centre(pr.discretise(given.problem))) == []
    assert share(given) == Share(("back",), 2)
    far = case(groove, by="y: 1.5", **bottom)
    assert refused(far) == []
    (said,) = off_centre(pr.discretise(far.problem))
    assert "draw both of its faces as one tool" in str(said)


def test_a_triangulated_ball_is_its_own_image_to_its_chords(tmp_path: Path) -> None:
    """Its triangles are turned against the planes; a ball off the plane is found as an exact one is."""
    points, triangles = pr.Sphere(radius=2.0).facets(np.array([0.0, -1.0, 0.0]), 1.0)
    c, s = math.cos(0.3), math.sin(0.3)
    points = points @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    lines = ["solid ball"]
    for a in points[triangles[:, ::-1]]:
        corners = [f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in a]
        lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
    (tmp_path / "ball.stl").write_text("\n".join([*lines, "endsolid ball"]))
    tool = f"type: stl, file: {tmp_path / 'ball.stl'}"
    assert refused(case(f"{tool}, {ORIGIN}")) == []
    assert "'left', x = 0" in refused(case(f"{tool}, at: [0.5, 0, 0]"))[0]


# -------------------------------------------------------------------------------------------------------- how they move
@pytest.mark.parametrize(
    ("tool", "by", "rough", "smooth"),
    [
        (FLAT, "y: -0.2, x: 0.3", True, False),
        (FLAT, "y: -0.2, ry: 0.1", True, False),
        (FLAT, "y: -0.2, rz: 0.05", True, True),
        (FLAT, "y: -0.2", False, False),
        (f"{PUNCH}, {ORIGIN}", "y: -0.2, ry: 0.1", True, False),
        (f"{PUNCH}, {ORIGIN}", "y: -0.2, x: 0.1", True, True),
        (f"{PLATE}, {ORIGIN}", "y: -0.2, z: 0.1", True, False),
        (f"type: pyramid, of: vickers, {ORIGIN}", "y: -0.2, ry: 0.1", True, True),
        ("type: sphere, radius: 1, at: [3, 0, 3]", "y: -0.2, x: 0.5, rz: 0.1", False, False),
    ],
)
def test_tools_that_move_across_the_plane_are_refused(tool: str, by: str, rough: bool, smooth: bool) -> None:
    """With friction; without it only what moves across its own surface. Those that do not reach the plane may go anywhere."""
    for mu, wrong in ((0.1, rough), (0.0, smooth)):
        said = refused(case(tool, by, mu))
        assert len(said) == wrong
        assert all(s.startswith("steps.0: tool 'die' reaches across the plane of symmetry") for s in said)
        assert all("and moves or turns across it" in s for s in said)


def test_motions_that_are_their_own_image() -> None:
    """A roll about the normal of one plane, a die along it; in a sector a die outwards is refused at the other side alone."""
    roll = "type: extruded, section: {type: circle, radius: 2}, axis: [0, 0, 1], at: [3, 0, 0]"
    assert refused(case(roll, "y: -0.2, x: 0.5, rz: 0.3")) == []
    assert refused(case(FLAT, "y: -0.2, z: 0.2, rx: 0.1", mirror=("[left, back]", "[left]"))) == []
    assert refused(case(FLAT, "y: -0.2", text=SECTOR)) == []
    assert refused(case(FLAT, "y: -0.2, ry: 0.2", 0.0, text=SECTOR)) == []
    assert "'b.cap', (" in refused(case(FLAT, "y: -0.2, x: 0.2", text=SECTOR))[0]


@pytest.mark.parametrize(
    ("tool", "step", "free"),
    [
        (FLAT, "push: {die: {y: -10}}", False),
        (FLAT, "push: {die: {y: -10, x: 1}}", True),
        (FLAT, "by: {die: {y: -0.2}}, push: {die: {mz: 0}}", True),
        ("type: plane, spring: {x: 100}", "by: {die: {y: -0.2}}", True),
        ("type: plane, spring: {y: 100}", "move: {die: {y: -0.2}}", False),
        ("type: sphere, radius: 1, spring: {x: 100}, at: [3, 0, 3]", "by: {die: {y: -0.2}}", False),
    ],
)
def test_tools_that_are_free_across_the_plane_are_refused(tool: str, step: str, free: bool) -> None:
    """Pushed, sprung, or turned by a moment: the other half is not there to hold them."""
    said = refused(case(tool, step=("by: {die: {y: -0.2}}", step)))
    assert len(said) == free and all("is free to move or turn across it" in s and "hold it across the plane" in s for s in said)


def test_a_tool_that_comes_down_off_the_plane_later() -> None:
    """Lifted and moved aside it may be; there it is compared with its image again."""
    steps = "- {name: press, by: {die: {y: -0.2}}}\n- {name: up, by: {die: {y: 1}}}\n- {name: aside, by: {die: {x: 0.7}}}\n"
    press = "- {name: press, by: {die: {y: -0.2}}}\n"
    given = case(f"{BALL}, {ORIGIN}", steps=(press, steps))
    assert refused(given) == [] and share(given) == Share(("left", "back"), 1)
    (said,) = refused(case(f"{BALL}, {ORIGIN}", steps=(press, steps + "- {name: again, by: {die: {y: -1.2}}}\n")))
    assert said.startswith("steps.3: tool 'die' reaches across the plane of symmetry 'left', x = 0, and is not its own")


# ----------------------------------------------------------------------------------------------- what they are in the whole
@pytest.mark.parametrize(
    ("tool", "by", "sides", "alike"),
    [
        ("type: sphere, radius: 1, at: [3, 0, 3]", "y: -0.2", (), 4),
        ("type: sphere, radius: 1, at: [3, 0, 0]", "y: -0.2", ("back",), 2),
        ("type: sphere, radius: 1, at: [3, 0, 3]", "y: -0.2, x: 0.1", (), 2),
        ("type: sphere, radius: 1, at: [3, 0, 3]", "x: -0.2, z: 0.1", (), 1),
        ("type: pyramid, of: vickers, at: [3, 0, 3]", "y: -0.2", (), 4),
        (FLAT, "y: -0.2", ("left", "back"), 1),
        (FLAT, "y: -0.2, x: 0.2", ("back",), 1),
    ],
)
def test_tools_off_the_planes_are_others_than_their_images(tool: str, by: str, sides: tuple[str, ...], alike: int) -> None:
    """Whether they reach the plane where the bodies are decides; those count that go the same way."""
    assert share(case(tool, by)) == Share(sides, alike)


def test_each_of_four_balls_has_the_force_of_the_one_that_is_modelled() -> None:
    """To 1e-9, against the whole block under four balls, on the same mesh."""
    ball = "type: sphere, radius: 1, at: [3, 0, 3]"
    whole = QUARTER.replace("size: [6, 2, 6], n: [6, 2, 6]", "size: [12, 2, 12], origin: [-6, 0, -6], n: [12, 2, 12]")
    whole = whole.replace(", b.left: x, b.back: z", "").replace("output: {mirror: [left, back]}\n", "")
    names = {f"{k}": (x, z) for k, (x, z) in enumerate(((3, 3), (-3, 3), (3, -3), (-3, -3)))}
    kind = "type: sphere, radius: 1, touching: b.top"
    tools = "".join(f"  ball{k}: {{{kind}, at: [{x}, 0, {z}]}}\n" for k, (x, z) in names.items())
    contacts = ", ".join(f"{{surface: b.top, against: ball{k}, friction: {{mu: 0.1}}}}" for k in names)
    moved = ", ".join(f"ball{k}: {{y: -0.1}}" for k in names)
    whole = whole.replace("  die: {TOOL, touching: b.top}\n", tools).replace("die: {y: -0.2}", moved)
    whole = whole.replace("{surface: b.top, against: die, friction: {mu: MU}}", contacts)
    part = case(ball, "y: -0.1")
    (*_, a), (*_, b) = (pr.solve(c.problem, replace(c.numerics, tolerance=1e-12)) for c in (part, loads(whole)))
    own = share(part)
    assert own == Share((), 4)
    expected = of_whole(images_of(part, "die", own.sides), np.array(a.force("die")[:3]))
    assert np.abs(np.array(b.force("ball0")[:3]) - expected).max() < 1e-9 * abs(expected[1])
    assert sum(b.force(f"ball{k}")[1] for k in names) == pytest.approx(own.alike * expected[1], rel=1e-9)


def test_answer_and_summary_of_four_balls(tmp_path: Path) -> None:
    """Its force is that of one; how many there are is said, by ``check`` too."""
    short = ("mirror: [left, back]", "mirror: [left, back], pictures: false, report: false")
    given = case("type: sphere, radius: 1, at: [3, 0, 3]", "y: -0.1", output=short)
    done = pr.run(given, out=tmp_path, quiet=True)
    (peak,) = done.summary["largest_force"]
    assert (peak["whole"], peak["alike"], peak["of_whole"]) == (1, 4, peak["value"])
    assert done.summary["whole"] == {"die": {"sides": (), "alike": 4}}
    assert any(line.endswith("(on each of 4 in the whole)") for line in done.summary["answer"])


@pytest.mark.parametrize(
    ("by", "push", "times"),
    [("y: 0", "y: -100", 4), ("x: 0.2", "y: -100", 2), ("z: 0.2", "y: -100", 2)],
)
def test_check_and_answer_say_the_same_of_a_tool_with_two_motions(by: str, push: str, times: int, tmp_path: Path) -> None:
    """All its motions count for both."""
    key, way = by.split(":")
    mirror = {"x": "[back]", "z": "[left]"}.get(key, "[left, back]")
    step = f"push: {{die: {{{push}}}}}" + (f", by: {{die: {{{by}}}}}" if key != "y" else "")
    text = QUARTER.replace("TOOL", FLAT).replace("MU", "0.1").replace("by: {die: {y: -0.2}}", step)
    text = text.replace("[left, back]", mirror)
    path = tmp_path / "case.yaml"
    path.write_text(text)
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 0 and f"-100 N on what is modelled, -{times * 100} N on the whole part" in done.stdout
    given = loads(text)
    table = {f"die.{c}": np.zeros(1) for c in ("ux", "uy", "uz", "rx", "ry", "rz", "fx", "fy", "fz", "mx", "my", "mz")}
    table |= {"die.uy": np.array([-0.1]), "die.fy": np.array([-100.0])}
    table |= {"time": np.ones(1), "step": np.array(["press"]), "increment": np.ones(1)}
    if key != "y":
        table[f"die.u{key}"] = np.array([float(way)])
    (peak,) = answer.peaks(table, given, {"die": share(given)._asdict()})
    assert peak.whole == times


@pytest.mark.parametrize("tool", [FLAT, "type: sphere, radius: 1, at: [3, 0, 3]", "type: sphere, radius: 1, at: [3, 0, 0]"])
def test_a_press_drives_all_tools_that_go_the_same_way(tool: str) -> None:
    """Its force is that on all of them together."""
    given = case(f"{tool}, press: {{capacity: 1e6, mirror: [left, back]}}")
    own, use = share(given), use_of(given.problem, "die")
    assert use is not None and use.forces == len(images_of(given, "die", own.sides)) * own.alike == 4


def test_a_press_names_planes_too() -> None:
    """A tool that is no image of itself across those of its press is refused there."""
    none = {"none": ("\noutput: {mirror: [left, back]}", "\noutput: {mirror: []}")}
    tool = "type: pyramid, of: vickers, turn: [0, 20 deg, 0], at: [0, 0, 0], press: {capacity: 1e6, mirror: [left]}"
    assert len(refused(case(tool, **none))) == 1


def test_check_says_it_once_with_its_line(tmp_path: Path) -> None:
    """File, line, tool, plane and remedy."""
    path = tmp_path / "case.yaml"
    path.write_text(QUARTER.replace("TOOL", f"type: pyramid, of: vickers, turn: [0, 20 deg, 0], {ORIGIN}").replace("MU", "0.1"))
    done = CliRunner().invoke(app, ["check", str(path)])
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    assert done.exit_code and len(lines) == 1
    assert all(words in lines[0] for words in ("case.yaml:5:", "tools.die", "'left', x = 0", "turn it by -20°"))


# ------------------------------------------------------------------------------------------------------------- in the plane
HALF = """\
name: half
space: plane strain
bodies: {b: {mesh: {type: rectangle, size: [6, 2], n: [6, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools:
  die: {TOOL, touching: b.top}
contacts: [{surface: b.top, against: die, friction: {mu: MU}}]
fixed: {b.bottom: y, b.left: x}
steps:
- {name: press, by: {die: {y: -0.2}}}
output: {mirror: [left, bottom]}
"""
ROUND, FACE = "type: circle, radius: 2", "type: stamp, width: 4, fillet: 0.5"
KINKED = "type: profile, points: [[-8, 0], [0, 0], [8, 0.4]], at: [0, 0]"
FLANK = "type: profile, points: [[60, 0], [3, 0], [0, -3]], at: [0, 0]"


@pytest.mark.parametrize(
    ("tool", "by", "rough", "smooth"),
    [
        (f"{ROUND}, at: [0, 0]", "y: -0.2", "", ""),
        (f"{ROUND}, at: [0, 0]", "y: -0.2, rz: 0.1", "moves or turns across it", ""),
        (f"{ROUND}, at: [0, 0]", "y: -0.2, x: 0.2", "steps.0: tool 'die' reaches across the line of symmetry 'left', x = 0",
         "move it along the line, or model the whole, without 'left' in 'mirror'"),
        (f"{ROUND}, at: [0.5, 0]", "y: -0.2", "by 1.5 and is centred at x = 0.5", "by 1.5 and is centred at x = 0.5"),
        (f"{FACE}, at: [0.5, 0]", "y: -0.2", "by 1.5 and is centred at x = 0.5", "by 1.5 and is centred at x = 0.5"),
        (f"{FACE}, at: [0, 0]", "y: -0.2, x: 0.2", "moves or turns across it", "moves or turns across it"),
        (f"{ROUND}, at: [4, 0]", "y: -0.2, x: 0.2, rz: 0.1", "", ""),  # there are two of them
        ("type: plane", "y: -0.2", "", ""),
        ("type: plane", "y: -0.2, x: 0.2", "moves or turns across it", ""),
        ("type: plane, normal: [0.2, -1]", "y: -0.2", "let its 'normal' lie along the plane", "is not its own mirror image"),
        (KINKED, "y: -0.2", "is not its own mirror image there", "is not its own mirror image there"),
        (KINKED.replace("[-8, 0]", "[-8, 0.4]"), "y: -0.2", "", ""),
    ],
)  # fmt: skip
def test_tools_at_lines_of_symmetry_are_looked_at_as_in_space(tool: str, by: str, rough: str, smooth: str) -> None:
    """Where they stand, and how they move while they touch; what goes along the line, or is one of two, is left alone."""
    for mu, words in ((0.1, rough), (0.0, smooth)):
        said = refused(case(tool, by, mu, HALF))
        assert len(said) == bool(words) and all(words in s for s in said)


def test_the_axis_of_revolution_mirrors_what_is_round() -> None:
    """A profile is drawn on both sides of it, and only its half at positive radii counts."""
    given = case(KINKED, text=HALF.replace("plane strain", "axisymmetric"), mirror=("[left, bottom]", "[b.left, bottom]"))
    assert refused(given) == []


def test_what_is_refused_at_a_line_is_not_warned_of() -> None:
    """The warning of a tool beside the line is the same fault."""
    given = case(f"{ROUND}, at: [0.5, 0]", text=HALF)
    assert len([f for f in findings(pr.discretise(given.problem), given) if "there would be two tools" in str(f)]) == 1


def test_a_flank_of_a_vee_is_one_of_two_in_the_plane() -> None:
    """Its line goes on beyond the line of symmetry, where no body sees it."""
    below = {"side": ("b.top, against", "b.bottom, against"), "touch": ("touching: b.top", "below: b.bottom")}
    given = case(FLANK, by="y: 0.1", text=HALF.replace("b.bottom: y, ", "").replace("left, bottom", "left"), **below)
    assert refused(given) == []


def test_a_tool_that_turns_beside_a_line_is_another_one_than_its_image() -> None:
    """Two rolls of which one is modelled turn opposite ways: each has its own force."""
    given = case(f"{ROUND}, at: [3, 0]", by="rz: 0.1", text=HALF)
    assert share(given) == Share()
    assert share(case(f"{ROUND}, at: [3, 0]", by="y: -0.1", text=HALF)) == Share(("left",))
    assert share(case(f"{ROUND}, at: [0, 0]", by="y: -0.1, rz: 0.1", mu=0.0, text=HALF)) == Share(("left",))
