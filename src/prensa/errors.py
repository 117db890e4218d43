"""Errors that a person can act on: each says what, where and what to try."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from prensa.precision import DRAWN


def coordinates(place: Iterable[float]) -> str:
    """A place in words, without brackets."""
    return ", ".join(f"{v:.4g}" for v in place)


def per_cent(share: float) -> str:
    """A share, not in per cent, in words: two digits, without a power of ten, as '0.31 %' or '100 %'."""
    return f"{float(f'{100.0 * share:.2g}'):.6g} %"


def along(way: Iterable[float]) -> str:
    """A direction in words: an axis, such as -y, or else its components, in brackets."""
    components = [float(v) for v in way]
    length = math.hypot(*components)
    for axis, v in zip("xyz", components):
        if abs(v) > (1.0 - DRAWN) * length:
            return ("-" if v < 0.0 else "+") + axis
    return f"({coordinates(v / length + 0.0 for v in components)})"


class PrensaError(Exception):
    """Base of every error that prensa raises on purpose; its text is meant for the user."""


MOST_REPORTED = 50  # mistakes of a case that are reported at once
LONGEST_MESSAGE = 1000  # characters of a message


@dataclass(frozen=True, order=True)
class Mark:
    """A place in a case: ``source`` (file or override; empty in Python), ``line``, ``column`` from 1 (0: all of it)."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


@dataclass(frozen=True, order=True)
class Mistake:
    """One mistake of a case file: its place and one line of text, ``message; remedy``."""

    mark: Mark
    message: str

    def __str__(self) -> str:
        words = self.message
        if len(words) > LONGEST_MESSAGE:  # somebody's whole file as one value
            words = f"{words[: LONGEST_MESSAGE // 2]} … {words[-LONGEST_MESSAGE // 2 :]}"
        return f"{self.mark}: {words}" if self.mark.source else words


class CaseError(PrensaError, ValueError):
    """All the mistakes of a case; ``str`` is one line for each of the first, ``file.yaml:12:5: message; remedy``."""

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self.mistakes: tuple[Mistake, ...] = tuple(mistakes)
        more = len(self.mistakes) - MOST_REPORTED
        rest = [f"… and {more} mistakes more"] if more > 0 else []
        super().__init__("\n".join([*map(str, self.mistakes[:MOST_REPORTED]), *rest]))


class ArgumentError(PrensaError, TypeError):
    """An argument of a function is of another kind than it takes."""


def shown(value: object, longest: int = 60) -> str:
    """A value in a message: short values as Python writes them, others by their kind."""
    if value is None or isinstance(value, bool | int | float | complex | str | bytes):
        try:
            text = repr(value)
        except ValueError:  # more digits than Python writes
            return "a number of thousands of digits"
        return text if len(text) <= longest else f"{text[: longest - 1]}…"
    name = {"dict": "mapping", "ndarray": "array"}.get(type(value).__name__, type(value).__name__)
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return f"{'an' if name[:1] in 'AEIOaeio' else 'a'} {name}"


def take(function: str, name: str, value: object, kinds: type | tuple[type, ...], remedy: str) -> None:
    """Refuse an argument that is none of *kinds*.

    Raises
    ------
    ArgumentError
        ``function: name is …; remedy``.

    """
    if not isinstance(value, kinds):
        raise ArgumentError(f"{function}: {name} is {shown(value)}; {remedy}")


def take_path(function: str, value: object) -> Path:
    """Refuse what is not a path, as `take`; returns the path."""
    take(function, "path", value, (str, os.PathLike), "give the path of a file or folder")
    path = Path(value)  # type: ignore[arg-type]
    try:
        path.exists()
    except (OSError, ValueError) as error:  # too long, or with characters that no path has
        raise PrensaError(
            f"{function}: the path {shown(str(path))} cannot be looked up ({type(error).__name__})"
        ) from None
    return path


class SolveError(PrensaError):
    """The history could not be completed: says what, where, why and what to try.

    ``last`` is the last good increment; ``reason`` why the one after it failed, one of the types in `prensa.system.failure`.
    """

    def __init__(self, message: str, last: object = None, reason: object = None):
        super().__init__(message)
        self.last, self.reason = last, reason


class Severity(IntEnum):
    """What follows from a finding."""

    WARN = 0
    """It is reported."""
    CUT = 1
    """The increment is not accepted; a shorter one may be."""
    REFUSE = 2
    """The run does not begin, or ends."""


@dataclass(frozen=True)
class Finding:
    """What a check has found.

    ``message``: what is wrong, by how much and where, and after that the remedy; ``path`` into the description (keys joined by
    dots), empty where the finding belongs to no key. ``seen_in_run``: a run finds out what comes of it, and warns of that.
    ``support``: the support that it asks for, as ``block.left: x``, since several checks may miss the same one.
    """

    path: str
    message: str
    severity: Severity = Severity.WARN
    seen_in_run: bool = field(default=False, kw_only=True)
    support: str = field(default="", kw_only=True)

    @property
    def fatal(self) -> bool:
        """Whether nothing can come of the run."""
        return self.severity is Severity.REFUSE

    def __str__(self) -> str:
        return f"{self.path}: {self.message}" if self.path else self.message


class PreflightError(PrensaError):
    """What makes a solution impossible, one line each: ``path: message; remedy``."""

    def __init__(self, notices: list[Finding]) -> None:
        self.notices = notices
        super().__init__("\n".join(map(str, notices)))


def refuse(notices: list[Finding]) -> None:
    """Raise `PreflightError` if something that was found before a run is fatal."""
    fatal = [n for n in notices if n.fatal]
    if fatal:
        raise PreflightError(fatal)
