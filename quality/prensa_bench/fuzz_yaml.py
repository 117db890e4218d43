# ruff: noqa: E501 (tables of odd values)
"""Broken inputs that are YAML's own: what the format can say and a case must not, and files that are no text at all.

Beside `prensa_bench.fuzz`, which calls these: anchors and aliases that multiply, keys twice, documents empty or many, words that
other readers take for dates, octal numbers and booleans, numbers beyond all bounds, lists in lists, endless words; bytes
that are no UTF-8, folders, links to themselves and devices where a file is expected.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

Generator = np.random.Generator

SCALARS = (
    "2026-11-22", "2026-11-22T09:00:00Z", "09:00", "12:30:45", "010", "0o10", "0b11", "0xFFFFFFFFFFFFFFFFFF", "1e400", "-1e400", "1E+400",
    "1e-400", "1" + "0" * 400, ".nan", ".NaN", "nan", "NaN", ".inf", "-.INF", "+.inf", "inf", "Infinity", "-infinity", "true", "True", "yes", "on",
    "off", "n", "False", "!!bool yes", "!!int 3", "!!timestamp 2026-11-22", "!!binary gIGC", "!!set {a, b}", "!!omap [a: 1]", "!x y", "=", "<<",
    "1,5", "1.2.3", "+", "-", "--1", "1e", "e5", ".", "1__0", "١٢", "½", "∞", "\u2212" + "1", "1\u00a0mm", "1e400 mm", "nan mm", "1 mm mm",
)  # fmt: skip
PREFIXES = ("", "", "&a ", "! ", "!!str ", "!!float ", "!!seq ", "- ", "? ", "*a ", "'", '"', "|\n", ">-\n", "[", "{")
EMPTY = (
    "", " ", "\n", "\t", "#", "# nothing\n", "---", "---\n...\n", "---\n---\n", "...", "null", "~", "[]", "{}", "''", "0", "- ", "? ", ": ",
    "%YAML 1.2\n---\n", "%TAG ! x\n---\n", "\ufeff", "\ufeff\ufeff", "\x00", "\r\n\r\n",
)  # fmt: skip


def mutate_yaml(rng: Generator, text: str) -> str:
    """One or two changes that only the format knows."""
    for _ in range(int(rng.choice([1, 1, 2]))):
        text = _YAML_CHANGES[rng.integers(len(_YAML_CHANGES))](rng, text)
    return text


def _scalar(rng: Generator, text: str) -> str:
    """A value, not a key, replaced by a word of several meanings, with or without something before it."""
    spots = list(re.finditer(r"(?<=[:\[,-] )[^\s,\[\]{}:]+|(?<=\[)[^\s,\[\]{}:]+", text))
    new = str(rng.choice(np.array(PREFIXES, dtype=object))) + str(rng.choice(np.array(SCALARS, dtype=object)))
    if not spots:
        return new
    spot = spots[rng.integers(len(spots))]
    return text[: spot.start()] + new + text[spot.end() :]


def _bomb(rng: Generator, text: str) -> str:
    """Aliases of aliases: k of the one before, n times, put before or behind the case, and sometimes used in it."""
    depth, width, list_like = int(rng.integers(2, 12)), int(rng.integers(2, 12)), rng.random() < 0.5
    rows = ["b0: &b0 [x, 1]" if list_like else "b0: &b0 {x: 1}"]
    for k in range(1, depth):
        inside = [f"*b{k - 1}" if list_like else f"k{j}: *b{k - 1}" for j in range(width)]
        rows.append(f"b{k}: &b{k} " + (f"[{', '.join(inside)}]" if list_like else f"{{{', '.join(inside)}}}"))
    bomb = "\n".join(rows) + "\n"
    lines = text.split("\n")
    i = int(rng.integers(len(lines)))
    if rng.random() < 0.5:
        lines[i] = lines[i].partition(":")[0] + f": *b{depth - 1}"
    return bomb + "\n".join(lines) if rng.random() < 0.8 else "\n".join(lines) + "\n" + bomb


def _merge(rng: Generator, text: str) -> str:
    """An anchor at one value, and an alias, a merge key or the anchor itself at another, perhaps before it or inside it."""
    lines = text.split("\n")
    i, j = (int(k) for k in rng.integers(len(lines), size=2))
    lines[i] = re.sub(r": ?", ": &m ", lines[i], count=1)
    word = str(rng.choice(["*m", "{<<: *m}", "<<: *m", "[*m, *m]", "&m *m", "*n"]))
    lines[j] = re.sub(r":.*", f": {word}", lines[j], count=1)
    return "\n".join(lines)


def _twice(rng: Generator, text: str) -> str:
    """A key of a flow mapping or a line twice, with the same or another value."""
    spots = list(re.finditer(r"\b(\w+): ([^\s,\[\]{}:]+)", text))
    if spots and rng.random() < 0.5:
        spot = spots[rng.integers(len(spots))]
        value = spot.group(2) if rng.random() < 0.5 else str(rng.choice(np.array(SCALARS, dtype=object)))
        return text[: spot.end()] + f", {spot.group(1)}: {value}" + text[spot.end() :]
    lines = text.split("\n")
    i = int(rng.integers(len(lines)))
    return "\n".join([*lines[: i + 1], *lines[i:]])


def _documents(rng: Generator, text: str) -> str:
    """An empty document, or one more before or behind."""
    empty = str(rng.choice(np.array(EMPTY, dtype=object)))
    return [empty, text + "\n---\n" + empty, empty + "\n---\n" + text, text + "\n...\n" + text][rng.integers(4)]


def _nested(rng: Generator, text: str) -> str:
    """A value inside so many lists or mappings, some not closed."""
    spots = list(re.finditer(r"(?<=: )[^\s,\[\]{}:]+", text))
    if not spots:
        return text
    spot, n = spots[rng.integers(len(spots))], int(rng.choice([1, 2, 5, 49, 51, 1000, 20_000]))
    a, b = [("[", "]"), ("{a: ", "}"), ("[[0, 1], ", "]"), ("- ", "")][rng.integers(4)]
    new = a * n + spot.group() + b * (n if rng.random() < 0.7 else n - 1)
    return text[: spot.start()] + new + text[spot.end() :]


def _long(rng: Generator, text: str) -> str:
    """A word, a key or a comment without an end."""
    lines = text.split("\n")
    i = int(rng.integers(len(lines)))
    n = int(10 ** rng.uniform(2.0, 5.5))
    word = str(rng.choice(["a", "9", "é", "-", "a.", "0.", "\\u0041", '\\"', " ", "\t", "&", "*", "%", "a: "])) * n
    shape = str(rng.choice(["{}: {}", '{}: "{}"', "{}: '{}'", "{}: |\n  {}", "{} # {}", "{}{}: 1", "{}: [{}]"]))
    lines[i] = shape.format(lines[i].partition(":")[0], word)
    return "\n".join(lines)


_YAML_CHANGES: tuple[Callable[[Generator, str], str], ...] = (
    _scalar, _scalar, _scalar, _bomb, _merge, _merge, _twice, _twice, _documents, _nested, _long,
)  # fmt: skip


# ----------------------------------------------------------------------------------------------------------- on disk
def no_text(rng: Generator, text: str, folder: Path) -> Path:
    """Path of what stands in *folder* where a case file is expected: wrong bytes, nothing, a folder, a link, a device, …"""
    path = folder / f"{'ö' if rng.random() < 0.1 else 'x'}.yaml"
    if path.is_symlink() or path.is_file():
        path.unlink()
    elif path.is_dir():
        path.rmdir()
    match rng.integers(8):
        case 0:
            path.mkdir()
        case 1:
            path.symlink_to(path)
        case 2:
            path.symlink_to(str(rng.choice(["/dev/null", "nowhere", ".", "/proc/self/mem"])))
        case 3:
            return Path(
                str(
                    rng.choice(
                        np.array(
                            ["", ".", "..", "/", "x" * 5000, "a\0b", "x.yaml/y", "/dev/null/x", "\udcff"], dtype=object
                        )
                    )
                )
            )
        case _:
            path.write_bytes(_bytes(rng, text))
    return path


def _bytes(rng: Generator, text: str) -> bytes:
    """The case in another encoding, with wrong bytes in it, cut inside a character, or no case at all."""
    raw = text.encode("utf-8", errors="replace")
    match rng.integers(6):
        case 0:
            return text.encode(
                str(rng.choice(["utf-16", "utf-32", "utf-16-be", "utf-8-sig", "cp037", "utf-7"])), "replace"
            )
        case 1:
            i = int(rng.integers(len(raw) + 1))
            return raw[:i] + rng.bytes(int(rng.integers(1, 20))) + raw[i:]
        case 2:
            return raw + "ö".encode()[:1]
        case 3:
            return rng.bytes(int(10 ** rng.uniform(0, 4)))
        case 4:
            magic = [b"\x89HDF\r\n\x1a\n", b"\x1f\x8b\x08", b"PK\x03\x04", b"%PDF-1.7\n", b"\x7fELF", b"\x00" * 4096]
            return magic[rng.integers(len(magic))] + rng.bytes(200)
        case _:
            return raw.replace(b"\n", [b"\r\n", b"\r", b"\x85", b"\x0b", b"\xe2\x80\xa8"][rng.integers(5)])
