"""Options of the calibration commands, converted to arguments of its functions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from prensa.errors import ArgumentError
from prensa.inverse.experiment import Observe, Test
from prensa.inverse.files import Calibration, read_calibration
from prensa.inverse.identify import Identification, identify
from prensa.model.names import suggest
from prensa.model.problem import Case
from prensa.model.schema import has_tests, load


def asked(
    file: Path | Case, changes: Iterable[str], data: Path | None, observe: Iterable[str], sigma: Iterable[str],
    fit: Iterable[str], along: str | None, starts: int | None, refine: bool | None,
) -> Calibration:  # fmt: skip
    """The calibration that a file describes, or a case with options; options go before what the file says.

    Raises
    ------
    PrensaError
        If the file or an option is wrong, or options are missing that a case needs, or given that a calibration file has.

    """
    if isinstance(file, Path) and has_tests(file):
        own = {"--data": data, "--observe": list(observe), "--sigma": list(sigma), "--fit": list(fit), "--along": along}
        found = _of_file(file, changes, own)
    else:
        case = file if isinstance(file, Case) else load(file, changes)
        columns, bounds = observed(observe, sigma), bounds_of(fit)
        if data is None or not columns or not bounds:
            raise ArgumentError(
                f"{case.problem.name!r} is a case: give --data, --observe COLUMN=MEASURE and --fit PATH as well, or name a "
                "calibration file, which has 'tests' and 'parameters'"
            )
        found = Calibration(case.problem.name, (Test(case, data, columns, along or "time"),), bounds)
    found = replace(found, starts=starts or found.starts)
    return found if refine is None else replace(found, refine=refine)


def identified(
    file: Path | Case, changes: Iterable[str], observe: Iterable[str], sigma: Iterable[str], fit: Iterable[str],
    rows: int | None,
) -> Identification:  # fmt: skip
    """What the readings of a calibration file, or those that options plan for a case, would determine.

    Raises
    ------
    PrensaError
        As `asked`.

    """
    if isinstance(file, Path) and has_tests(file):
        own = {"--observe": list(observe), "--sigma": list(sigma), "--fit": list(fit), "--rows": rows}
        found = _of_file(file, changes, own)
        return identify(tests=found.tests, parameters=list(found.parameters))
    case = file if isinstance(file, Case) else load(file, changes)
    return identify(case, observed(observe, sigma), list(fit), 20 if rows is None else rows)


def _of_file(file: Path, changes: Iterable[str], own: Mapping[str, object]) -> Calibration:
    """A calibration file; it has what its ``own`` options say, so that these are not given."""
    extra = next((name for name, value in own.items() if value), None)
    if extra is not None:
        raise ArgumentError(f"{file} is a calibration file, which says what {extra} says; leave {extra} out")
    return read_calibration(file, changes)


def lines_of(found: Calibration) -> Iterator[str]:
    """What a calibration file says, in lines: tests with their readings, and parameters."""
    readings = sum(e.count for e in found.experiments)
    yield f"{found.name}: {len(found.experiments)} tests, {readings} readings, {len(found.parameters)} parameters"
    for e in found.experiments:
        columns = ", ".join(f"{c.name} ({len(c.rows)} readings, error {c.sigma.max():.3g} {c.measure.unit})" for c in e.channels)
        yield f"{e.name}: {e.problem.name}, along {e.along}: {columns}"
    for path, pair in found.parameters.items():
        yield f"{path}: " + (f"from {pair[0]:g} to {pair[1]:g}" if pair else "any value of the same sign")
    for e in found.experiments:
        yield from e.notes


def summary_of(found: Calibration) -> dict[str, Any]:
    """The same as data."""
    tests = [
        {"name": e.name, "case": e.problem.name, "along": e.along, "readings": {c.name: len(c.rows) for c in e.channels}}
        for e in found.experiments
    ]
    return {"name": found.name, "tests": tests, "parameters": dict(found.parameters), "starts": found.starts}


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
