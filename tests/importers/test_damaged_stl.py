"""Damaged STL files: each one right answer or one sentence."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.importers import stl
from prensa.verify.stl import icosphere, write

POINTS, TRIANGLES = icosphere(10.0, 1)
VOLUME = stl.joined("ball", POINTS, TRIANGLES).volume


def ball(folder: Path, binary: bool = True) -> bytes:
    """Bytes of a sound file."""
    return Path(write(folder / "ball.stl", POINTS, TRIANGLES, binary)).read_bytes()


def damaged(folder: Path, data: bytes) -> stl.Surface:
    """The surface of a file of these bytes."""
    (folder / "made.stl").write_bytes(data)
    return stl.read(str(folder / "made.stl"), str(hash(data)))


def commas(data: bytes) -> bytes:
    return data.replace(b".", b",")


def a_word(data: bytes) -> bytes:
    return data.replace(b"vertex", b"vertex a lot of", 1)


def quads(data: bytes) -> bytes:
    return data.replace(b"endloop", b"vertex 0 0 0\nendloop", 1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t[:-400], r"'made\.stl' is cut off: its text ends without 'endsolid'"),
        (lambda t: t[: t.index(b"vertex", 900) + 9], "is cut off: its text ends without 'endsolid'"),
        (commas, r"'made\.stl', line 4: 'vertex .*' does not have three numbers \(with decimal points\)"),
        (a_word, r"'made\.stl', line 4: 'vertex a lot of' does not have three numbers"),
        (quads, "has 80 facets and 241 corners, and a facet of an STL file has three"),
        (lambda t: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" * 9, "is not an STL file that can be read"),
        (lambda t: b"solid nothing\nendsolid nothing\n", r"'made\.stl' has no triangles"),
        (lambda t: b"", r"'made\.stl' has no triangles"),
        (lambda t: t.replace(b"vertex", b"vertex nan 0 0 vertex", 1).replace(b"endfacet", b"endfacet endfacet", 1), "facets and"),
    ],
    ids=["last facets", "within a number", "commas", "words", "quadrangles", "another format", "no facets", "empty", "one more"],
)  # fmt: skip
def test_texts_that_are_none(tmp_path: Path, change, words: str) -> None:
    """Cut off, with commas, of another format: said with the line where there is one."""
    with pytest.raises(ValueError, match=words):
        damaged(tmp_path, change(ball(tmp_path, binary=False)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b: b[:-30], "is cut off: its header says 80 triangles, and 79 are in it"),
        (lambda b: b[:80] + struct.pack("<I", 10) + b[84:], "is damaged: its header says 10 triangles, and 80 are in it"),
        (lambda b: b[:84 + 12] + struct.pack("<f", np.nan) + b[84 + 16:], "coordinates that are not finite numbers"),
        (lambda b: b[:84 + 12] + struct.pack("<f", 1e30) + b[84 + 16:], r"80 of 80 triangles .* beside its size of 1e\+30"),
    ],
    ids=["short", "wrong number", "not a number", "far away"],
)  # fmt: skip
def test_binary_files_that_are_damaged(tmp_path: Path, change, words: str) -> None:
    """Their size against the number in the header, and coordinates."""
    with pytest.raises(ValueError, match=words):
        damaged(tmp_path, change(ball(tmp_path)))


def test_files_of_other_manners_are_read(tmp_path: Path) -> None:
    """A binary one that begins with "solid", capitals and line ends of Windows, a name that is not ASCII, two solids."""
    text, data = ball(tmp_path, binary=False), ball(tmp_path)
    for made in (
        b"solid of binary".ljust(80) + data[80:],
        text.upper().replace(b"\n", b"\r\n"),
        "solid Düse\n".encode() + text.split(b"\n", 1)[1],
        text + text,
    ):  # fmt: skip
        surface = damaged(tmp_path, made)
        assert surface.closed and surface.volume == pytest.approx(VOLUME, rel=1e-6)


@pytest.mark.parametrize("gap", [1e-3, 1e-5])
def test_triangles_that_do_not_hang_together_are_refused(gap: float) -> None:
    """Corners of neighbours apart by more than round-off: an edge of its own for each would be a tool of borders."""
    shift = 1.0 + gap * np.random.default_rng(0).normal(size=(len(TRIANGLES), 3, 1))
    with pytest.raises(ValueError, match=r"80 triangles of 'made\.stl' are in \d+ parts that share no edge: it is not a surface"):
        stl.joined("made.stl", (POINTS[TRIANGLES] * shift).reshape(-1, 3), np.arange(3 * len(TRIANGLES)).reshape(-1, 3))


@pytest.mark.parametrize("first", [1.0, 1.5, 0.5])
def test_of_two_bodies_one_may_not_be_inside_out(first: float) -> None:
    """It is turned, whichever is larger, unless it is a cavity; all of them inside out stay so, for 'reverse' to be given."""
    shift, n = np.array([40.0, 0.0, 0.0]), len(POINTS)
    two = np.concatenate([first * POINTS, POINTS + shift])
    good = stl.joined("two", two, np.concatenate([TRIANGLES, TRIANGLES + n]))
    assert (good.parts, good.turned) == (2, 0) and good.volume == pytest.approx((first**3 + 1.0) * VOLUME)
    for both in ((TRIANGLES, TRIANGLES[:, ::-1] + n), (TRIANGLES[:, ::-1], TRIANGLES + n)):
        mended = stl.joined("two", two, np.concatenate(both))
        assert mended.turned == len(TRIANGLES)
        assert abs(mended.volume) == pytest.approx((first**3 + 1.0) * VOLUME)
    assert stl.joined("two", two, np.concatenate([TRIANGLES, TRIANGLES + n])[:, ::-1]).volume < 0.0
    hollow = stl.joined("hollow", np.concatenate([POINTS, 0.5 * POINTS]), np.concatenate([TRIANGLES, TRIANGLES[:, ::-1] + n]))
    assert hollow.turned == 0 and hollow.volume == pytest.approx(0.875 * VOLUME)


def test_holes_of_bodies_are_reported(tmp_path: Path) -> None:
    """With their edges and place; half a ball and a flat sheet are open on purpose."""
    with_hole = pr.Stl(write(tmp_path / "hole.stl", POINTS, TRIANGLES[1:]))
    assert len(with_hole.notes()) == 1 and "hole.stl: the surface is open at 3 edges, as near (" in with_hole.notes()[0]
    half = TRIANGLES[POINTS[TRIANGLES].mean(axis=1)[:, 1] < 0.0]
    assert pr.Stl(write(tmp_path / "half.stl", POINTS, half)).notes() == ()
    sheet = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    assert pr.Stl(write(tmp_path / "sheet.stl", sheet, np.array([[0, 1, 2], [0, 2, 3]]))).notes() == ()


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16", "utf-16-be", "latin-1"])
def test_texts_of_editors_are_read(tmp_path: Path, code: str) -> None:
    """With a mark at their start, two bytes a letter, other ends of lines."""
    text = ball(tmp_path, binary=False).decode().replace("\n", "\r\n")
    data = ("\ufeff" * (code == "utf-16-be") + text).encode(code)
    assert damaged(tmp_path, data).volume == pytest.approx(VOLUME, rel=1e-6)


def test_a_body_without_thickness_is_refused(tmp_path: Path) -> None:
    """Flattened, as by a scale of zero along one axis: said with what to export; a thin one is read."""
    with pytest.raises(ValueError, match=r"the closed surface of 'flat\.stl' encloses nothing beside its size of 19\.6"):
        stl.read(write(tmp_path / "flat.stl", POINTS * [1.0, 1e-8, 1.0], TRIANGLES), "flat")
    thin = stl.read(write(tmp_path / "thin.stl", POINTS * [1.0, 1e-3, 1.0], TRIANGLES), "thin")
    assert thin.closed and thin.volume == pytest.approx(1e-3 * VOLUME, rel=1e-4)
