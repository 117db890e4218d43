"""What ``prensa die`` is asked for, and what it says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from prensa.dies.ring import ShrinkRing
from prensa.dies.stress import Die
from prensa.errors import PrensaError
from prensa.friction.wear.archard import Archard
from prensa.friction.wear_law import WearLaw
from prensa.measures.units import length_unit, pressure_unit
from prensa.model.not_in_space import words_of
from prensa.model.problem import File, Problem
from prensa.model.schema import loads
from prensa.output.result import RunResult


def asked(
    thickness: float, E: float | None, nu: float | None, span: str | None, size: float | None, fix: Sequence[str],
    back_pressure: float, ring: str | None, mesh: Path | None = None,
) -> Die:  # fmt: skip
    """The die of the options.

    Raises
    ------
    PrensaError
        For an option that cannot be read.

    """
    given = None if span is None else _pair("--span", span, "FROM:TO, as in 0:20")
    around = None if ring is None else _pair("--ring", ring, "THICKNESS:INTERFERENCE, as in 20:0.05")
    held = {}
    for text in fix:
        side, equals, how = text.partition("=")
        if not equals:
            raise PrensaError(f"--fix {text}: give a side and x, y or xy, as in --fix back=y")
        held[side] = how
    nu = Die.nu if nu is None else nu
    shrunk = None if around is None else ShrinkRing(*around, E=E, nu=nu)
    drawn = None if mesh is None else _file(mesh)
    return Die(thickness, E, nu, given, size, back_pressure=back_pressure, ring=shrunk, fixed=held, mesh=drawn)


def _file(path: Path) -> File:
    if not path.is_file():
        raise PrensaError(f"--mesh {path}: there is no such file")
    return File(str(path))


def law_of(k: float | None, hardness: float | None, depth: float | None, run: RunResult, tool: str) -> WearLaw:
    """Archard's law of the options, else the law of the case; raises PrensaError where something is missing."""
    if k is None and hardness is None and depth is None:
        of_case: WearLaw = loads(run.summary["case"], bounded=False).output.wear.get(tool, Archard())
        return of_case
    return Archard(k=k, hardness=hardness, depth=depth)


def refuse_section(given: Mapping[str, object]) -> None:
    """Raise PrensaError for options of a section, by their names, that are given (no false value) with a tool in space."""
    if found := [option for option, value in given.items() if value]:
        raise PrensaError(words_of("die", options=" and ".join(found)))


def lines_of(summary: dict[str, Any], problem: Problem) -> Iterator[str]:
    """What is said of a die."""
    length, stress = length_unit(problem), pressure_unit(problem)
    mises, moved, worn = summary["mises"], summary["deflection"], summary["wear"]
    where = "({:.4g}, {:.4g})"
    yield f"{summary['tool']} at increment {summary['increment']}, time {summary['time']:.4g}: " \
          f"pressure ≤ {summary['pressure']:.4g} {stress}, forces balanced to {summary['imbalance']:.1e}"  # fmt: skip
    yield f"largest von Mises stress {mises['value']:.4g} {stress} at {where.format(*mises['at'])}"
    if ring := summary.get("ring"):
        yield f"shrink ring: largest von Mises stress {ring['value']:.4g} {stress} at {where.format(*ring['at'])}"
    yield f"largest deflection {moved['value']:.4g} {length} at {where.format(*moved['at'])}"
    if worn["relative"]:
        yield f"wear deepest at {worn['s']:.4g} {length} of the outline; relative, without --k and --hardness"
    else:
        parts = f"; {worn['parts']:.4g} parts until {worn['permitted']:.4g} {length}" if "parts" in worn else ""
        place = f"at {worn['s']:.4g} {length} of the outline"
        yield f"wear a part {worn['depth']:.3g} {length} {place}, volume {worn['volume']:.3g}{parts}"


def _pair(option: str, text: str, form: str) -> tuple[float, float]:
    first, _, second = text.partition(":")
    try:
        return float(first), float(second)
    except ValueError:
        raise PrensaError(f"{option} {text}: give {form}") from None
