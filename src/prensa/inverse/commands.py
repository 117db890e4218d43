"""What the command line says of a calibration, as its functions take it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from prensa.errors import ArgumentError
from prensa.inverse.experiment import Observe
from prensa.model.names import suggest


def observed(columns: Iterable[str], errors: Iterable[str]) -> dict[str, Observe]:
    """Measures by column from ``force=die.force.y`` and errors from ``force=2%``.

    Raises
    ------
    ArgumentError
        For texts without ``=`` and errors of columns that are not observed.

    """
    out: dict[str, Observe] = {}
    for text in columns:
        name, measure = _split(text, "--observe", "force=die.force.y")
        out[name] = Observe(measure)
    for text in errors:
        name, error = _split(text, "--sigma", "force=2%")
        if name not in out:
            raise ArgumentError(f"--sigma {text}: no column {name!r} is observed{suggest(name, out)}")
        out[name] = replace(out[name], sigma=error)
    return out


def bounds_of(fits: Iterable[str]) -> dict[str, tuple[float, float] | None]:
    """Bounds by path from ``friction.mu=0.02..0.5`` or a path alone.

    Raises
    ------
    ArgumentError
        For bounds that are no two numbers.

    """
    out: dict[str, tuple[float, float] | None] = {}
    for text in fits:
        path, equals, bounds = text.partition("=")
        low, _, high = bounds.partition("..")
        try:
            out[path.strip()] = (float(low), float(high)) if equals else None
        except ValueError:
            raise ArgumentError(f"--fit {text}: write a path and two bounds, as in friction.mu=0.02..0.5") from None
    return out


def _split(text: str, option: str, example: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (equals and name.strip() and value.strip()):
        raise ArgumentError(f"{option} {text}: write it as {option} {example}")
    return name.strip(), value.strip()
