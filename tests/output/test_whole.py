"""The whole of which a part was modelled: what is no plane of symmetry is refused; its forces are those of its model."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PreflightError
from prensa.geometry.reflections import NoWhole, Plane, chamber, distinct, group
from prensa.model.problem import Case
from prensa.model.schema import loads
from prensa.output import answer
from prensa.output.scene import scene
from prensa.output.whole import Share, images_of, mirror_findings, of_whole, part_of_whole, shares_of
from prensa.result.presses import use_of

SPACE = """
name: quarter
space: solid
bodies: {b: {mesh: {type: box, size: [2, 1, 2], n: [2, 1, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {die: {type: plane, touching: b.top}}
contacts: [{surface: b.top, against: die}]
fixed: {b.bottom: y, b.left: x, b.back: z}
steps: [{name: press, move: {die: {y: -0.01}}}]
output: {mirror: [left]}
"""
PLANE = """
name: half
space: plane strain
bodies: {b: {mesh: {type: rectangle, size: [2, 1], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}
tools: {die: {type: plane, touching: b.top}}
fixed: {b.bottom: y, b.left: x}
steps: [{name: press, move: {die: {y: -0.01}}}]
output: {mirror: [left]}
"""
RING = """
name: ring
space: solid
bodies:
  ring:
    mesh: {type: cylinder, radius: 10, bore: 5, height: 6, n: [2, 2, 4], angle: 60 deg}
    material: {type: j2, E: 210 GPa, nu: 0.3, flow: {type: swift, K: 800 MPa, e0: 0.005, n: 0.18}}
tools: {die: {type: plane, touching: ring.top}}
contacts: [{surface: ring.top, against: die, friction: {mu: 0.15}}]
fixed: {ring.bottom: y, ring.base: z, ring.cap: normal}
steps: [{name: press, move: {die: {y: -0.3}}, increments: 2}]
output: {mirror: [ring.base, ring.cap], pictures: false, report: false}
"""


def share(case: Case, tool: str = "die") -> Share:
    """What a tool is in the whole."""
    return shares_of(pr.discretise(case.problem), case)[tool]


def own_images(case: Case) -> np.ndarray:
    """Matrices (h, 3, 3) of the images with which the die is one."""
    return images_of(case, "die", share(case).sides)


def found(text: str) -> list[str]:
    """What is said of the planes of symmetry of a case."""
    case = loads(text)
    return [str(f) for f in mirror_findings(pr.discretise(case.problem), case)]


# --------------------------------------------------------------------------------------------------- what is refused
@pytest.mark.parametrize("text", [SPACE, PLANE])
@pytest.mark.parametrize(
    ("mirror", "words"),
    [
        ("[left]", ""), ("[left, bottom]", ""), ("[b.left]", ""), ("[left, b.left]", ""),
        ("[right]", "nothing holds 'b' along x all over their right side in every step"),
        ("[b.right]", "give 'fixed' 'b.right: x', or leave 'b.right' out"),
        ("[top]", "tool 'die' presses 'b' at their top side, so that it is no plane of symmetry"),
        ("[b.tap]", "unknown boundary 'tap'"),
    ],
)  # fmt: skip
def test_a_side_that_nothing_holds_is_no_plane_of_symmetry(text: str, mirror: str, words: str) -> None:
    """Nor one that a tool presses, or that there is not; each in one sentence."""
    said = found(text.replace("mirror: [left]", f"mirror: {mirror}"))
    assert len(said) == bool(words) and all(words in s for s in said)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("b.left: x}", "b.bottom-left: x}", "nothing holds 'b' along x all over"),  # a place on it is not enough
        ("move: {die: {y: -0.01}}", "move: {die: {y: -0.01}}, fixed: {b.left: free}", "in every step"),
        ("move: {die: {y: -0.01}}", "move: {die: {y: -0.01}}, fixed: {b.left: {x: 0.1}}", "in every step"),
        ("type: rectangle, size: [2, 1], n: [2, 2]", "type: disc, radius: 1, n: [4, 2]", "have no flat side at their left"),
    ],
)  # fmt: skip
def test_planes_of_symmetry_are_flat_and_held_all_over_in_every_step(old: str, new: str, words: str) -> None:
    """What is released, driven, round, or held in a place alone is none."""
    text = PLANE.replace(old, new)
    if "disc" in new:
        text = text.replace("fixed: {b.bottom: y, b.left: x}\n", "").replace("touching: b.top", "normal: [0, -1], at: [0, 1]")
    (said,) = found(text)
    assert words in said


@pytest.mark.parametrize(
    ("text", "mirror", "force", "words"),
    [
        (SPACE, "[left, back]", "[0, -1, 0.01]", "'body_force' on 'b' has a part across their back side"),
        (SPACE, "[left]", "[0, -1, 1]", ""),
        (SPACE, "[b.left]", "[[[0, 0], [0.5, 1], [1, 0]], 0, 0]", "a part across 'b.left'"),
        (PLANE, "[left, bottom]", "[0, -1]", "along the plane, or leave 'bottom' out"),
        (PLANE, "[left]", "[0, -1]", ""),
        (PLANE.replace("plane strain", "axisymmetric"), "[b.left]", "[1, 0]", ""),
        (PLANE.replace("plane strain", "axisymmetric"), "[bottom]", "[0, 1]", "across their bottom side"),
        (RING, "[ring.base, ring.cap]", "[0, -1, 0]", ""),
        (RING, "[ring.base]", "[1, 0, 0]", ""),
        (RING, "[ring.cap]", "[1, 0, 0]", "on 'ring' has a part across 'ring.cap'"),
        (RING, "[ring.cap]", f"[1, 0, {math.tan(math.radians(60.0))}]", ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("in_step", [False, True])
def test_body_forces_across_a_plane_are_refused(text: str, mirror: str, force: str, words: str, in_step: bool) -> None:
    """The reflection turns them round: weight along a plane is that of the whole, weight across it is not."""
    body = "ring" if text is RING else "b"
    given = f"body_force: {{{body}: {force}}}"
    text = text.replace("{name: press,", f"{{name: press, {given},") if in_step else text + given
    said = found(re.sub(r"mirror: \[[^]]*\]", f"mirror: {mirror}", text))
    assert len(said) == bool(words) and all(words in s and s.startswith("output.mirror: ") for s in said)


@pytest.mark.parametrize("text", [SPACE, PLANE])
def test_a_support_of_no_motion_and_one_of_the_first_step_hold(text: str) -> None:
    """As one of the problem does."""
    still = text.replace("b.left: x", "b.left: {x: 0}")
    first = text.replace(", b.left: x", "").replace("move: {die", "fixed: {b.left: x}, move: {die")
    for changed in (text, still, first):
        assert found(changed) == []


def test_a_smooth_flat_tool_at_rest_guides_a_plane_of_symmetry() -> None:
    """With friction, or moved, it does not."""
    text = PLANE.replace("die: {type: plane, touching: b.top}", "die: {type: plane, touching: b.top}, wall: WALL")
    text = text.replace(", b.left: x", "").replace("steps:", "contacts:\n- {surface: b.top, against: die}\n"
                                                    "- {surface: b.left, against: wall, friction: {mu: MU}}\nsteps:")  # fmt: skip
    wall = "{type: plane, normal: [1, 0], at: [0, 0]}"
    assert not found(text.replace("WALL", wall).replace("MU", "0"))
    assert "tool 'wall' presses 'b' at their left side" in found(text.replace("WALL", wall).replace("MU", "0.1"))[0]
    moved = text.replace("WALL", wall).replace("MU", "0").replace("-0.01}}", "-0.01}, wall: {x: 0.01}}")
    assert "tool 'wall' presses" in found(moved)[0]
    gone = text.replace("WALL", wall).replace("MU", "0").replace("y: -0.01}}}]", "y: -0.01}}}, {name: off, remove_tools: true}]")
    assert "tool 'wall' presses" in found(gone)[0]


def test_the_bodies_lie_on_one_side_of_a_plane_of_symmetry() -> None:
    """A held step inside of the model is none, nor a round side."""
    more = "{c: {mesh: {type: rectangle, size: [1, 1], n: [1, 1], origin: [-3, 0]}, material: {type: elastic, E: 1, nu: 0}}, b:"
    two = PLANE.replace("{b:", more).replace("b.left: x", "b.left: x, c.left: xy")
    said = found(two.replace("mirror: [left]", "mirror: [b.left]"))
    assert len(said) == 1 and "the bodies go on beyond the plane of 'b.left', by 3: their images would overlap" in said[0]
    (said,) = [s for s in found(RING.replace("ring.cap]", "ring.outer]")) if "flat" in s]
    assert "'ring.outer', which is not flat" in said


@pytest.mark.parametrize("angle", [50, 72, 100, 120])
def test_angles_that_no_whole_closes_from_are_refused(angle: int) -> None:
    """72° goes five times into a turn, but the images of a mirror are an even number; 120° three times."""
    (said,) = found(RING.replace("60 deg", f"{angle} deg"))
    assert f"'ring.base' and 'ring.cap' meet at {angle}°, which is 180° over no whole number" in said


def test_parallel_planes_and_those_around_a_prism_make_no_whole() -> None:
    """Their images go on without an end."""
    held = SPACE.replace("b.back: z", "b.back: z, b.front: z")
    (said,) = found(held.replace("[left]", "[b.back, b.front]"))
    assert "'b.back' and 'b.front' are parallel" in said
    c, s = math.cos(math.pi / 3), math.sin(math.pi / 3)
    prism = [Plane((1.0, 0.0, 0.0), -1.0, "a"), Plane((-c, s, 0.0), -1.0, "b"), Plane((-c, -s, 0.0), -1.0, "c")]
    with pytest.raises(NoWhole, match="'a', 'b' and 'c' never close to a whole"):
        chamber(prism)


@pytest.mark.parametrize(
    ("mirror", "words"),
    [
        ("up", "'up' is no side; write 'left', 'right', 'bottom', 'top', 'back', 'front', or the flat side of a body"),
        ("c.left", "unknown body 'c'; known: 'b'"),
    ],
)
def test_a_mirror_that_is_no_side(mirror: str, words: str) -> None:
    """Of what is misspelt, or of a body that there is not."""
    with pytest.raises(pr.CaseError, match=words) as error:
        loads(SPACE.replace("[left]", f"[{mirror}]"), "case.yaml")
    assert "case.yaml:9:" in str(error.value)


@pytest.mark.parametrize(("angle", "count"), [(60, 6), (90, 4), (45, 8)])
def test_a_press_counts_flat_sides_by_name(angle: int, count: int) -> None:
    """Its force is that of all images of a sector; one across its way doubles the stroke; without its own it is refused."""
    text = RING.replace("touching: ring.top", "touching: ring.top, press: 900 kN").replace("angle: 60", f"angle: {angle}")
    with pytest.raises(pr.CaseError, match=r"give the press of 'die' 'mirror: \[ring\.base, ring\.cap\]' too"):
        loads(text)
    loads(text.replace("press: 900 kN", "press: {capacity: 150 kN, mirror: []}"))
    for sides, strokes in (("ring.base, ring.cap", 1), ("ring.base, ring.cap, ring.bottom", 2)):
        given = loads(text.replace("press: 900 kN", f"press: {{capacity: 900 kN, mirror: [{sides}]}}"))
        use = use_of(given.problem, "die")
        assert use is not None and (use.forces, use.strokes, use.energies) == (count, strokes, count * strokes)
        assert not [f for f in mirror_findings(pr.discretise(given.problem), given) if f.fatal]


def test_a_press_names_no_other_bodies_or_round_sides() -> None:
    """With file, line and column."""
    text = RING.replace("touching: ring.top", "touching: ring.top, press: {capacity: 900 kN, mirror: rang.cap}")
    with pytest.raises(pr.CaseError, match=r"'tools\.die\.press\.mirror' names 'rang\.cap': unknown body 'rang'") as error:
        loads(text, "case.yaml")
    assert "case.yaml:8:" in str(error.value)
    given = loads(text.replace("rang.cap", "ring.outer"))
    (found,) = [f for f in mirror_findings(pr.discretise(given.problem), given) if f.fatal]
    assert found.path == "tools.die.press.mirror" and "is not flat" in found.message


@pytest.mark.parametrize("held", ["xz", "xyz"])
@pytest.mark.parametrize("angle", [60, 90])
def test_a_cut_that_is_held_along_its_radius_is_no_plane_of_symmetry(angle: int, held: str) -> None:
    """Its metal cannot spread; a quarter's too. Held along its normal alone it is one, and so is what is held so elsewhere."""
    text = RING.replace("angle: 60", f"angle: {angle}")
    given = loads(text.replace("ring.cap: normal", f"ring.cap: {held}"))
    (found,) = mirror_findings(pr.discretise(given.problem), given)
    normal = "x" if angle == 90 else "normal"
    assert found.fatal and found.path == "output.mirror" and f"along its normal alone, 'ring.cap: {normal}'" in found.message
    fine = loads(text.replace("ring.cap: normal", f"ring.cap: {normal}"))
    assert not list(mirror_findings(pr.discretise(fine.problem), fine))
    unnamed = loads(text.replace("ring.cap: normal", f"ring.cap: {held}").replace("mirror: [ring.base, ring.cap]", "mirror: []"))
    assert "ring.cap" not in part_of_whole(pr.discretise(unnamed.problem), unnamed)  # it would be refused then


def test_planes_that_would_be_refused_are_not_hinted_at() -> None:
    """Where a body that is tied on top is free beside the side that is held."""
    text = SPACE.replace("bodies: {b:", "bodies: {c: {mesh: {type: box, size: [2, 1, 2], n: [2, 1, 2], origin: [0, 1, 0]}, "
                         "material: {type: elastic, E: 1000, nu: 0.3}}, b:")  # fmt: skip
    text = text.replace("touching: b.top", "touching: c.top").replace("surface: b.top", "surface: c.top")
    text = text.replace("steps:", "ties: [{slave: c.bottom, master: b.top}]\nsteps:")
    text = "\n".join(line for line in text.splitlines() if not line.startswith("output"))
    free, both = loads(text), loads(text.replace("b.left: x", "b.left: x, c.left: x"))
    words = [part_of_whole(pr.discretise(case.problem), case) for case in (free, both)]
    assert "b.left" not in words[0] and "b.left" in words[1]


def test_a_run_is_refused_before_it_begins(tmp_path: Path) -> None:
    """Its folder is not made."""
    case = loads(PLANE.replace("mirror: [left]", "mirror: [right]"))
    with pytest.raises(PreflightError, match=r"output\.mirror: nothing holds 'b' along x"):
        pr.run(case, out=tmp_path / "r", quiet=True)
    assert not (tmp_path / "r").exists()


# ----------------------------------------------------------------------------------------------------------- the group
def sector(angle: float, *more: Plane) -> list[Plane]:
    """Planes of a sector about the y axis, into it."""
    return [Plane((0.0, 0.0, 1.0), 0.0, "base"), Plane((math.sin(angle), 0.0, -math.cos(angle)), 0.0, "cap"), *more]


BOTTOM = Plane((0.0, 1.0, 0.0), 0.0, "bottom")


@pytest.mark.parametrize(
    ("planes", "order"),
    [
        ([], 1), ([BOTTOM], 2), (sector(math.pi / 2), 4), (sector(math.pi / 2, BOTTOM), 8),
        *((sector(math.pi / n), 2 * n) for n in (3, 4, 5, 6, 18, 90)), (sector(math.pi / 3, BOTTOM), 12),
        # rotations of a cube and their reflections: the part between x = 0, x = y and y = z is a 48th
        ([Plane((1.0, 0.0, 0.0), 0.0, "a"), Plane((-(0.5**0.5), 0.5**0.5, 0.0), 0.0, "b"),
          Plane((0.0, -(0.5**0.5), 0.5**0.5), 0.0, "c")], 48),
    ],
)  # fmt: skip
def test_the_order_of_the_group(planes: list[Plane], order: int) -> None:
    """Its elements are orthogonal, half of them reflections and turned reflections, and each product is one of them."""
    made = group(chamber(planes))
    assert len(made) == order and np.array_equal(made[0], np.eye(3))
    assert np.allclose(made @ made.transpose(0, 2, 1), np.eye(3), rtol=0, atol=1e-12)
    assert round(np.linalg.det(made).sum()) == (0 if planes else 1)
    if order <= 48:
        products = np.einsum("aij,bjk->abik", made, made).reshape(-1, 9)
        near = np.abs(products[:, None] - made.reshape(1, -1, 9)).max(axis=2).min(axis=1)
        assert near.max() < 1e-12


def test_normals_of_meshes_with_seven_digits_close() -> None:
    """They are those of the exact angle; a part that is off by more is refused."""
    base, cap = sector(math.pi / 6 + 4e-7)
    assert len(group(chamber([base, cap]))) == 12
    with pytest.raises(NoWhole, match=r"meet at 30\.00"):
        chamber(sector(math.pi / 6 + 1e-4))
    assert len(distinct([base, base, cap], 1e-6)) == 2


# --------------------------------------------------------------------------------- forces of the whole against its model
def last_force(text: str) -> np.ndarray:
    """Force (3,) on the die at the end of a run with fixed increments."""
    case = loads(text)
    *_, last = pr.solve(case.problem, replace(case.numerics, tolerance=1e-12))
    return np.array(last.force("die")[:3])


@pytest.mark.parametrize(("angle", "n", "order"), [(60, 4, 6), (45, 3, 8)])
def test_a_sector_has_its_share_of_half_a_ring(angle: int, n: int, order: int) -> None:
    """To 1e-9 along the axis, on the same mesh; across it the forces of the whole cancel, and those of half a ring do not."""
    text = RING.replace("n: [2, 2, 4]", f"n: [2, 2, {n}]").replace("60 deg", f"{angle} deg")
    half = RING.replace("n: [2, 2, 4]", f"n: [2, 2, {n * order // 2}]").replace("60 deg", "180 deg")
    half = half.replace("ring.cap: normal", "ring.cap: z")
    part, more, case = last_force(text), last_force(half), loads(text)
    images = own_images(case)
    assert len(images) == order
    whole = of_whole(images, part)
    of_half = of_whole(own_images(loads(half.replace("ring.base, ring.cap", "back"))), more)
    assert abs(whole[1] - of_half[1]) < 1e-9 * abs(of_half[1])
    assert np.abs(whole[[0, 2]]).max() < 1e-12 * abs(whole[1]) and np.hypot(part[0], part[2]) > 1e-6 * abs(part[1])
    assert abs(of_half[2]) < 1e-12 * abs(whole[1])


BOX = """
name: box
space: solid
bodies:
  b:
    mesh: {type: box, size: [4, 2, 4], origin: [-2, -1, -2], n: [4, 2, 4]}
    material: {type: j2, E: 210 GPa, nu: 0.3, flow: {type: swift, K: 800 MPa, e0: 0.005, n: 0.18}}
tools: {die: {type: plane, touching: b.top}, table: {type: plane, normal: [0, 1, 0], at: [0, -1, 0]}}
contacts:
- {surface: b.top, against: die, friction: {mu: 0.2}}
- {surface: b.bottom, against: table, friction: {mu: 0.2}}
fixed: {b.middle: xz}
steps: [{name: press, by: {die: {y: -0.1}, table: {y: 0.1}}, increments: 2}]
"""


@pytest.mark.parametrize(("size", "fixed", "mirror", "order"), [
    ("[2, 2, 2], origin: [0, -1, 0], n: [2, 2, 2]", "b.left: x, b.back: z", "[left, back]", 4),
    ("[2, 1, 2], origin: [0, 0, 0], n: [2, 1, 2]", "b.left: x, b.back: z, b.bottom: y", "[left, back, bottom]", 4),
])  # fmt: skip
def test_a_quarter_and_an_eighth_have_their_share_of_the_box(size: str, fixed: str, mirror: str, order: int) -> None:
    """To 1e-9; across the mid-height the other die presses, so that an eighth counts four times too."""
    part = BOX.replace("[4, 2, 4], origin: [-2, -1, -2], n: [4, 2, 4]", size).replace("b.middle: xz", fixed)
    part += f"output: {{mirror: {mirror}}}\n"
    if "bottom: y" in fixed:
        part = part.replace(", table: {type: plane, normal: [0, 1, 0], at: [0, -1, 0]}}", "}").replace(", table: {y: 0.1}", "")
        part = part.replace("- {surface: b.bottom, against: table, friction: {mu: 0.2}}\n", "")
    whole = BOX.replace("fixed: {b.middle: xz}\n", "")
    a, b, case = last_force(part), last_force(whole), loads(part)
    images = own_images(case)
    assert len(images) == order
    assert abs(of_whole(images, a)[1] - b[1]) < 1e-9 * abs(b[1])


# ------------------------------------------------------------------------------------------------------ what a run says
def test_the_answer_of_a_sector(tmp_path: Path) -> None:
    """Six times the force of a sixth, in the terminal's lines and in the summary; the part alone says that it may be one."""
    done = pr.run(loads(RING), out=tmp_path / "a", quiet=True)
    (peak,) = done.summary["largest_force"]
    assert peak["whole"] == 6 and peak["of_whole"] == pytest.approx(6.0 * peak["value"], rel=1e-12)
    assert any("(whole part: 6 times, " in line for line in done.summary["answer"]) and not done.summary["part"]
    made, _ = scene(done.increments)  # what the report draws
    assert (len(made["mirror"]), len(made["images"])) == (2, 5)
    turns = np.array(made["images"])[:, :9].reshape(-1, 3, 3)
    assert np.allclose(np.linalg.det(turns), [-1, -1, 1, 1, -1], rtol=0, atol=1e-12)
    alone = loads(RING.replace("mirror: [ring.base, ring.cap], ", ""))
    done = pr.run(alone, out=tmp_path / "b", quiet=True)
    assert done.summary["largest_force"][0]["whole"] == 1
    words = "'ring.base' and 'ring.cap' are held along their normals"
    assert words in done.summary["part"] and done.summary["answer"][-1] == done.summary["part"]
    assert words in json.loads((tmp_path / "b" / "summary.json").read_text())["part"]


@pytest.mark.parametrize(
    ("fixed", "moved", "names"),
    [
        ("b.bottom: y, b.left: x, b.back: z", "y", "'b.left' and 'b.back'"),
        ("b.bottom: y, b.left: x, b.back: z", "x", "'b.bottom' and 'b.back'"),
        ("b.bottom: xyz", "y", ""), ("b.bottom: xyz, b.left: x", "y", "'b.left'"), ("b.bottom: xyz, b.left: xyz", "y", ""),
    ],
)
def test_what_may_be_a_part_is_said(fixed: str, moved: str, names: str) -> None:
    """Of sides that are held along their normal alone and along which a tool moves; of no others."""
    text = SPACE.replace("b.bottom: y, b.left: x, b.back: z", fixed).replace("{y: -0.01}", f"{{{moved}: -0.01}}")
    case = loads(text.replace("output: {mirror: [left]}\n", ""))
    said = part_of_whole(pr.discretise(case.problem), case)
    assert names in said and bool(said) == bool(names)
    again = loads(text)  # which names 'left'
    beside = part_of_whole(pr.discretise(again.problem), again)
    others = [name for name in names.split(" and ") if name not in ("", "'b.left'")]
    assert all(n in beside for n in others) and bool(beside) == bool(others)
    assert not others or "across 'left' alone" in beside


@pytest.mark.parametrize(("mirror", "words"), [("[left]", "mirror: [left, b.back]"), ("[left, back]", ""), ("[]", "")])
def test_what_may_be_a_part_is_said_beside_a_press(mirror: str, words: str) -> None:
    """Of planes that the press does not name either; one that says there are none is believed."""
    text = SPACE.replace("touching: b.top", f"touching: b.top, press: {{capacity: 3 kN, mirror: {mirror}}}")
    case = loads(text.replace("output: {mirror: [left]}\n", ""))
    said = part_of_whole(pr.discretise(case.problem), case)
    assert words in said and bool(said) == bool(words)


@pytest.mark.parametrize("text", [SPACE, PLANE])
def test_other_bodies_in_the_plane_of_a_side_are_held_too(text: str) -> None:
    """A body that is tied to the one whose side is named, and whose own side in that plane nothing holds."""
    one, two = ("[2, 1, 2]", "[0, -1, 0]") if "solid" in text else ("[2, 1]", "[0, -1]")
    mesh = text[text.index("mesh: {type"): text.index(", material")]
    lower = mesh.replace(f"size: {one}", f"size: {one}, origin: {two}")
    text = text.replace("{b:", f"{{c: {{{lower}, material: {{type: elastic, E: 1000, nu: 0.3}}}}, b:")
    text = text.replace("b.bottom: y", "c.bottom: y").replace("[left]", "[b.left]")
    text = text.replace("tools:", "ties: [{slave: c.top, master: b.bottom}]\ntools:")
    if "solid" in text:
        text = text.replace("b.back: z", "b.back: z, c.back: z")
    (said,) = found(text)
    assert "nothing holds 'c' along x all over what lies in the plane of 'b.left' in every step" in said
    assert "hold it in 'fixed', or leave 'b.left' out" in said
    assert not found(text.replace("b.left: x", "b.left: x, c.left: x"))


def columns(tool: str, **values: list[float]) -> dict[str, np.ndarray]:
    """Rows of a history with a tool's ways, turns, forces and moments."""
    names = [*(f"u{a}" for a in "xyz"), *(f"r{a}" for a in "xyz"), *(f"f{a}" for a in "xyz"), *(f"m{a}" for a in "xyz")]
    rows = len(next(iter(values.values())))
    table = {f"{tool}.{c}": np.array(values.get(c, [0.0] * rows)) for c in names}
    return table | {"time": np.arange(1.0, rows + 1), "step": np.array(["press"] * rows), "increment": np.arange(1, rows + 1)}


@pytest.mark.parametrize(
    ("mirror", "values", "whole", "of_whole"),
    [
        ("[back]", {"ux": [3], "uy": [-1], "fx": [3], "fy": [4], "fz": [12]}, 2, 10.0),  # what the halves press with cancels
        ("[left]", {"ux": [3], "uy": [-1], "fx": [3], "fy": [4]}, None, None),  # its image goes the other way
        ("[left, back]", {"uy": [-1], "fy": [4], "fx": [3]}, 4, 16.0),
        ("[back]", {"ux": [1], "rz": [-0.1], "fx": [3], "fy": [4]}, 2, 6.0),  # a roll
        ("[left, back]", {"uy": [-1], "ry": [0.1], "fy": [4]}, 1, 4.0),  # images of a screw turn the other way
    ],
)
def test_tools_that_move_along_several_axes(
    mirror: str, values: dict[str, list[float]], whole: int | None, of_whole: float | None
) -> None:
    """Those planes count along which all their ways lie, and the forces between the images do not."""
    case = loads(moving(SPACE.replace("[left]", mirror), values))
    peak = answer.peaks(columns("die", **values), case, {"die": share(case)._asdict()})[0]
    assert (peak.whole, peak.of_whole) == (whole, of_whole)
    assert ("whole part" in answer.sentence(peak)) == bool(whole and whole > 1)


def moving(text: str, values: dict[str, list[float]]) -> str:
    """A case whose die, with friction, moves and turns as the last rows of its columns say."""
    ways = {c.removeprefix("u"): v[-1] for c, v in values.items() if c[0] in "ur"}
    by = ", ".join(f"{axis}: {way}" for axis, way in ways.items())
    text = text.replace("move: {die: {y: -0.01}}", f"by: {{die: {{{by}}}}}")
    return text.replace("against: die}", "against: die, friction: {mu: 0.1}}")


def test_a_tool_of_a_sector_that_moves_outwards_is_one_with_an_image() -> None:
    """Of three tools about the axis, each in the middle of two parts; forces along the plane between these are doubled."""
    x, half = {"ux": [1.0]}, math.pi / 6
    case = loads(moving(RING.replace("move: {die: {y: -0.3}}", "move: {die: {y: -0.01}}"), x))
    images = own_images(case)
    assert len(images) == 2 and np.allclose(of_whole(images, np.array([3.0, 1.0, 5.0])), [6.0, 2.0, 0.0])
    middle = {"ux": [math.cos(half)], "uz": [math.sin(half)]}
    assert len(own_images(loads(moving(RING.replace("move: {die: {y: -0.3}}", "move: {die: {y: -0.01}}"), middle)))) == 1


# ---------------------------------------------------------------------------------------------------- pictures of the whole
def test_pictures_of_a_sector_show_the_whole_ring() -> None:
    """Six images without a gap; stresses are turned with them, and agree where the images meet."""
    from prensa.output import plot
    from prensa.output.mirrors import whole_of

    case = loads(RING)
    *_, last = pr.solve(case.problem)
    whole = whole_of(last, case.problem, case.output.mirror)
    assert len(whole.images) == 6
    body = last.bodies["ring"]
    x = np.concatenate([image.of(body.X) for image in whole.images])
    angles = np.unique(np.degrees(np.arctan2(x[:, 2], x[:, 0])).round(6) % 360)
    assert np.allclose(np.diff(angles), 15.0, atol=1e-5) and len(angles) == 24
    box = plot.limits(last, case.problem, case.output.mirror)
    assert np.allclose([box[0], box[4]], [-box[1], -box[5]], rtol=1e-9)
    names = ("xx", "yy", "zz", "xy", "yz", "xz")
    for image in whole.images:
        moved = image.of(body.x) - image.of(body.X)
        for k, axis in enumerate("xyz"):
            u = image.values(f"displacement.{axis}", body, plot.field_values(body, f"displacement.{axis}"))
            assert np.allclose(u, moved[:, k], rtol=0, atol=1e-12)
        there = [image.values(f"stress.{c}", body, plot.field_values(body, f"stress.{c}")) for c in names]
        xx, yy, zz, xy, yz, xz = there
        turned = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
        xx, yy, zz, xy, yz, xz = body.stress.T
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
        # principal stresses are the same, and tractions on turned planes are turned
        assert np.allclose(np.linalg.eigvalsh(turned), np.linalg.eigvalsh(own), rtol=0, atol=1e-9)
        n = np.array([1.0, 0.0, 0.0])
        R = np.eye(3) if image.turn is None else image.turn
        assert np.allclose(turned @ (R @ n), (own @ n) @ R.T, rtol=0, atol=1e-9)
    assert last.plot("stress.xx", mirror=case.output.mirror, size=(3, 3), dpi=40).axes
