"""What a run answered, in a few lines: how it ended, the largest force of each moved tool, the case's measures, warnings.

The end of the terminal, ``summary.json`` and the top of the report say the same because all of them ask here.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prensa.measures.columns import directions, force_columns, place_columns
from prensa.measures.units import energy_unit, force_unit, length_unit, moment_unit
from prensa.model.problem import Case, Problem, Step
from prensa.model.seconds import duration_of
from prensa.model.units import ENERGY, factor
from prensa.model.until import reached
from prensa.output import damage, press
from prensa.output.whole import Share, images_of, moment_of_whole, of_whole
from prensa.precision import DRAWN, NEGLIGIBLE
from prensa.result.presses import use_of
from prensa.system.schedule import integrated

Table = Mapping[str, NDArray[Any]]


class Peak(NamedTuple):
    """The largest force, or moment, of a tool: ``value`` in ``unit`` along ``axis``.

    ``axis``: x, y, z, rx, ry or rz; empty where the tool moves along several axes or turns, and the value is the size of the
    force, or turns about several, and that of the moment.
    ``travel`` in ``travel_unit``: how far the tool was from its first place, None of a tool at rest; ``whole``: how many parts
    of the whole, with its mirror images, press the tool, None where it is one with no image; ``of_whole``: the value then;
    ``alike``: how many such tools the whole has that go the same way.
    """

    tool: str
    what: str
    axis: str
    value: float
    unit: str
    travel: float | None
    travel_unit: str
    step: str
    increment: int
    time: float
    whole: int | None
    of_whole: float | None = None
    alike: int = 1


def peaks(table: Table, case: Case, whole: Mapping[str, Mapping[str, Any]]) -> list[Peak]:
    """Largest forces along their ways of the tools that move, and moments of those that turn; of all where none does.

    In axisymmetry forces are those along the axis: radial ones of a whole ring balance. ``whole``: what tools are in the whole,
    as ``summary.json`` has it (see `prensa.output.whole.Share`); nothing is said of those that it lacks.
    """
    problem = case.problem
    if not len(table["time"]):
        return []
    ways = {tool: _way(table, tool, problem) for tool in problem.tools}
    chosen = [t for t in ways if ways[t]] or list(ways)
    shares = {tool: Share(tuple(said["sides"]), said["alike"]) for tool, said in whole.items()}
    found = [
        _peak(table, case, tool, ways[tool], moment, shares.get(tool)) for tool in chosen for moment in (False, True)
    ]
    return [peak for peak in found if peak is not None and peak.value]


def lines(table: Table, case: Case, summary: Mapping[str, Any]) -> list[str]:
    """The answer of a run, a sentence a line: its end, largest forces, damages, last values of the case's measures.

    ``table``: columns of ``history.csv``; ``summary``: content of ``summary.json``, of which older ones lack some.
    """
    end, presses = ending(table, case.problem, summary), list(of_presses(table, case.problem, summary))
    # what a press says of a run that failed is no more than so far: then the end comes first
    out = [*presses, end] if summary["status"] == "completed" else [end, *presses]
    out += [_of_blow(blow, case.problem) for blow in press.blows(table, case.problem)]
    out += map(sentence, peaks(table, case, summary.get("whole", {})))
    damages = damage.stated(summary["damage"]) if "damage" in summary else damage.damages(table, case.problem)
    out += damage.sentences(damages, case.problem, partial(shown, both=False))
    # what is found by itself before what the case measures, of which there may be more than the first screen of a phone holds
    out += [_filled(body, found, summary, length_unit(case.problem)) for body, found in summary.get("fill", {}).items()]
    out += [_worn(tool, found, case.problem) for tool, found in summary.get("wear", {}).items()]
    for name, measure in summary.get("measures", {}).items():
        last = measure["last"]
        out.append(f"{name}: {'no value' if last is None else shown(last, measure['unit'])}")
    return out + [words for words in [summary.get("part", "")] if words]


def _worn(tool: str, found: Mapping[str, Any], problem: Problem) -> str:
    """The deepest wear of a tool in words, and parts until a permitted depth."""
    unit = length_unit(problem)
    place = f"at {shown(found['s'], unit)} of its outline"
    if found["relative"]:
        return f"wear of {tool}: deepest {place}; give 'k' and 'hardness' for a depth"
    parts = ""
    if "parts" in found:
        count = float(f"{found['parts']:.3g}")
        parts = f", {count:.0f} parts until {shown(found['permitted'], unit)}"
    return f"wear of {tool}: {_number(found['depth'])} {unit} a part {place}{parts}"


def _filled(body: str, found: Mapping[str, Any], summary: Mapping[str, Any], length: str = "") -> str:
    """How far a die is filled, in words: volumes of what is missing and where the largest part of it is."""
    unit, places = found["unit"], found["places"]
    of = "" if len(summary["bodies"]) == 1 else f" around {body}"
    most = "" if not places else (
        f"{', most' if len(places) > 1 else ''} at ({places[0]['x']:.4g}, {places[0]['y']:.4g}){f' {length}' if length else ''}"
        + (f": {shown(places[0]['volume'], unit)}" if len(places) > 1 else "")
    )  # fmt: skip
    if found["fill"] is not None:
        return f"die filled to {100 * found['fill']:.4g} %{of}: {shown(found['missing'], unit)} missing{most}"
    count = len(places)
    trapped = shown(sum(p["volume"] for p in places), unit)
    return f"{count} closed pocket{'s' * (count > 1)} between tools and body{of}: {trapped}{most}"


def sentence(peak: Peak) -> str:
    """A largest force in words: 'largest force of punch: 78.6 kN (78630 N) at 4.5 mm'."""
    where = f"time {peak.time:.4g}" if peak.travel is None else shown(peak.travel, peak.travel_unit)
    times, all_of_it = peak.whole or 1, abs(peak.value if peak.of_whole is None else peak.of_whole)
    many = "twice, " if times == 2 else f"{times} times, "
    many *= math.isclose(all_of_it, times * abs(peak.value), rel_tol=DRAWN)  # else some of it stays between the images
    each = f"on each of {peak.alike} in the whole" if peak.alike > 1 else ""
    whole = f"whole part: {many}{shown(all_of_it, peak.unit, both=False)}" if times > 1 else ""
    both = ", ".join(words for words in (whole, each) if words)
    return f"largest {peak.what} of {peak.tool}: {shown(abs(peak.value), peak.unit)} at {where}{f' ({both})' if both else ''}"


def of_presses(table: Table, problem: Problem, summary: Mapping[str, Any]) -> Iterator[str]:
    """Whether each press is enough: 'enough: 82 % of 400 kN at 8 mm'.

    Of one that ended a step, which the end says, its force where it was its energy that was used; else nothing.
    """
    made = list(press.verdicts(table, problem))
    stopped = summary.get("stopped_by", {})
    for v in made:
        steps = (s for s in problem.steps if s.until is not None and s.name in stopped)
        ended = any(stopped[s.name].startswith(reached(k, v.tool, "")) for s in steps for k in ("press", "energy"))
        spent = ended and v.passed is None
        if spent:
            of_force = next(f for f in press.verdicts(table, problem, of_force=True) if f.tool == v.tool)
            if v.of == "force" or not np.isfinite(of_force.limit):
                continue
            v = of_force
        if not v.utilisation > 0.0:
            way = shown(float(press.strokes(table, problem, v.tool).max()), length_unit(problem))
            yield f"{v.tool} met nothing: no force on its press in {way}; look at where it starts and which way it goes"
            continue
        limit = _energy(v.limit, problem) if v.of == "energy" else shown(v.limit, force_unit(problem), both=False)
        share = f"{100 * v.utilisation:.3g} % of {limit}"
        where = shown(v.stroke, length_unit(problem)) if v.of == "force" else f"in step {v.step!r}"
        share += " by its torque" if v.by_torque else ""
        share += " in force" if spent else ""
        word = "so far" if summary["status"] != "completed" else "enough" if v.passed is None else "not enough"
        text = f"{word}: {share} {'at ' if v.of == 'force' else ''}{where}"
        text += "" if v.passed is None else f", passed at {shown(v.passed, length_unit(problem))}"
        if v.short is not None:
            text += f"; the capacity curve ends at {shown(v.short, length_unit(problem))}, its last value counts beyond"
        yield text if len(made) == 1 else f"press of {v.tool} {text}"


def _of_blow(blow: press.Blow, problem: Problem) -> str:
    """What a blow gave and where it went."""
    parts = ((blow.plastic, "plastic"), (blow.friction, "friction"), (blow.stored, "elastic"))
    went = ", ".join(f"{_energy(v, problem)} {name}" for v, name in parts)
    off = "missing" if blow.missing >= 0.0 else "too much"  # by the elements: finer ones have less of it
    missing = f"{100 * abs(blow.missing) / blow.gave:.1g} % {off}" if blow.gave else "nothing given"
    of = "" if len(problem.tools) == 1 else f" by {blow.tool}"
    gave = f"step {blow.step!r}: {_energy(blow.gave, problem)} given{of}"
    return f"{gave}: {went} ({missing}); efficiency {100 * blow.efficiency:.1f} %"


def _energy(value: float, problem: Problem) -> str:
    """An energy in J or kJ; per length in plane problems of thickness 1."""
    unit = energy_unit(problem)
    if "/" in unit:
        return shown(value, unit, both=False)
    joules = value * factor(f"1 {problem.units.force}*{problem.units.length}", "m", "N", ENERGY.exponents)
    return f"{_number(joules / 1e3)} kJ" if abs(joules) >= 1e3 else f"{_number(joules)} J"


def weighed(warnings: Iterable[str], about: Mapping[str, str]) -> list[str]:
    """Warnings, the most severe first: a failure, then the result, the case, and files that could not be drawn.

    ``about``: what each is about, one of `ABOUT`; of those that it lacks, the case.
    """
    return sorted(warnings, key=lambda text: ABOUT.index(about.get(text, "case")))


ABOUT = ("failure", "result", "case", "files")
"""What a warning is about, the most severe first."""


def in_short(warnings: Sequence[str], unsaid: Collection[str] = ()) -> Iterator[str]:
    """All warnings of a run: what is wrong of each, without the remedy, and in full those that were not shown before."""
    if warnings:
        yield f"{len(warnings)} warning{'s, the most severe first' if len(warnings) > 1 else ''}:"
        yield from (f"  {text if text in unsaid else text.splitlines()[0].split('; ')[0]}" for text in warnings)


# ----------------------------------------------------------------------------------------------------------- the end
def ending(table: Table, problem: Problem, summary: Mapping[str, Any]) -> str:
    """What ended a run, with the travel there where a tool is moved."""
    status = str(summary["status"])
    if not len(table["time"]):
        return status if status == "completed" else f"{status} before an increment was completed"
    steps = {step.name: (number, step) for number, step in enumerate(problem.steps)}
    if status == "completed":
        by = summary.get("stopped_by", {})
        early = [_stop(table, problem, steps[s][1], by.get(s, "")) for s in summary.get("ended_early", {}) if s in steps]
        return "; ".join(early) or status
    time, name = float(table["time"][-1]), str(table["step"][-1])
    number, step = steps[name]
    at = f"{status} at time {time:.4g} of {len(problem.steps)}"
    over = time >= number + 1 or name in summary.get("ended_early", {})
    way = "" if over else _gone(table, problem, step)
    return f"{at}, {'after' if over else 'in'} step {name!r}{', ' + way if way else ''}"


def _stop(table: Table, problem: Problem, step: Step, words: str) -> str:
    """How a step ended before its time; words: what the solver said."""
    met = next((c for c in (step.until.criteria() if step.until else ()) if words.startswith(reached(*c[:3]))), None)
    tool = met[1] if met is not None and met[1] in problem.tools else ""
    way = _gone(table, problem, step, tool)
    if met is None:
        why = f", as {words}" if words else ""
        text = f"stopped{' ' + way if way else ''}{why}"
    else:
        of = "" if len(problem.tools) == 1 else f" of {met[1]}"
        kind, target = met[0], _target(table, problem, step, *met)
        text = f"stopped at {target}{of}{' ' + way if way and kind != 'travel' else ''}"
    return text if len(problem.steps) == 1 else f"step {step.name!r} {text}"


def _target(table: Table, problem: Problem, step: Step, kind: str, name: str, key: str, target: float) -> str:
    """What was reached at the end of a step; of a press its force or its energy there."""
    if kind == "energy":
        return _energy(target, problem)
    if kind == "press":
        use, number = use_of(problem, name), problem.steps.index(step)
        assert use is not None
        last = {c: v[np.flatnonzero(table["step"] == step.name)[-1:]] for c, v in table.items()}
        made = press.course(last, problem, use)
        if made.of_energy[0] > made.force[0] / made.capacity[0]:
            return _energy(use.energy(number), problem)
        kind, target = "force", float(made.capacity[0])
    units = {"force": force_unit(problem), "travel": length_unit(problem)}
    unit = {"m": moment_unit(problem), "rz": "rad"}.get(key, units[kind])
    return shown(abs(target), unit, both=False)


def _gone(table: Table, problem: Problem, step: Step, tool: str = "") -> str:
    """How far a tool has gone in a step, and of how much where the description says: 'after 2.855 mm of 10'."""
    rows = np.flatnonzero(table["step"] == step.name)
    if not len(rows):
        return ""
    last, before = int(rows[-1]), int(rows[0]) - 1
    for name in [tool] if tool else problem.tools:
        columns, d = place_columns(problem), directions(problem)
        start = [float(table[f"{name}.{c}"][before]) if before >= 0 else 0.0 for c in columns]
        gone = [float(table[f"{name}.{c}"][last]) - s for c, s in zip(columns, start)]
        if not any(gone):
            continue
        planned = _planned(problem, step, name, dict(zip(columns, start)))
        turns = not any(gone[:d])
        way, whole = (math.hypot(*v[d:] if turns else v[:d]) for v in (gone, planned))
        of = f" of {abs(whole):.4g}" if whole else _pushed(table, problem, step, name, last)
        return f"after {abs(way):.4g} {'rad' if turns else length_unit(problem)}{of}"
    return ""


def _pushed(table: Table, problem: Problem, step: Step, tool: str, row: int) -> str:
    """Of a tool that a step pushes, whose travel nothing plans: its force in a row, and the force that the step asks for."""
    push = step.push.get(tool)
    asked = [(c, _last(getattr(push, c, None))) for c in "xy"] if push is not None else []
    wanted = {c: v for c, v in asked if v}
    if not wanted:
        return ""
    there = math.hypot(*(float(table[f"{tool}.f{c}"][row]) for c in wanted))
    unit = force_unit(problem)
    return f", at {shown(there, unit, both=False)} of {shown(math.hypot(*wanted.values()), unit, both=False)}"


def _last(value: Any) -> float | None:
    """A number, or the last one of a table."""
    value = value[-1][1] if isinstance(value, tuple) else value
    return float(value) if isinstance(value, int | float) else None


def _planned(problem: Problem, step: Step, tool: str, start: Mapping[str, float]) -> list[float]:
    """The ways of a tool, by the columns of its places, in a step that goes to its end; 0 where no number says so."""
    out = [0.0] * len(start)
    number, crank = problem.steps.index(step), step.crank.get(tool)
    for kind, motions in (("move", step.move), ("by", step.by), ("control", step.control)):
        motion = motions.get(tool)
        for k, column in enumerate(start):
            value = _last(getattr(motion, column.removeprefix("u"), None))
            if value is not None:
                out[k] = value - (start[column] if kind == "move" else 0.0)
    for k, column in enumerate(start):
        rate = getattr(step.velocity.get(tool), column.removeprefix("u"), None)
        if rate is not None:
            out[k] = float(integrated(rate, 0.0, number, number + 1.0, duration_of(step)).values[-1])
        if crank is not None and getattr(crank, column.removeprefix("u"), None) is not None:
            out[k] = crank.way(1.0)
    return out


# ----------------------------------------------------------------------------------------------------------- the force
def _way(table: Table, tool: str, problem: Problem) -> str:
    """Along what a tool moves in a run: x, y, xy, …, rz, or nothing."""
    sizes = {c: float(np.abs(table[f"{tool}.{c}"]).max(initial=0.0)) for c in place_columns(problem)}
    ways = place_columns(problem)[: directions(problem)]
    most = max(sizes[c] for c in ways)
    along = "".join(c[1] for c in ways if sizes[c] > NEGLIGIBLE * most)
    return along or turning_about(table, tool, problem)


def turning_about(table: Table, tool: str, problem: Problem) -> str:
    """Motion, rx, ry or rz, by which a tool turns most in a run; nothing of one that does not turn."""
    turns = place_columns(problem)[directions(problem) :]
    most = max(turns, key=lambda c: float(np.abs(table[f"{tool}.{c}"]).max(initial=0.0)))
    return most if table[f"{tool}.{most}"].any() else ""


def _peak(table: Table, case: Case, tool: str, way: str, moment: bool, share: Share | None) -> Peak | None:
    problem, d = case.problem, directions(case.problem)
    round_ = problem.space == "axisymmetric"
    turns = turning_about(table, tool, problem)
    if moment and (round_ or not turns):
        return None
    kinds, places = (columns(problem)[d:] if moment else columns(problem)[:d] for columns in (force_columns, place_columns))
    alone = sum(bool(table[f"{tool}.{c}"].any()) for c in places) == 1
    axis = (turns if alone else "") if moment else "y" if round_ else way if way in ("x", "y", "z") else ""
    columns = [c for c in kinds if not axis or c[1] == axis[-1]]
    values = table[f"{tool}.{columns[0]}"] if len(columns) == 1 else _size(table, tool, columns)
    if not np.isfinite(values).any():
        return None
    k = int(np.nanargmax(np.abs(values)))
    turned = moment or way == turns
    gone = [float(table[f"{tool}.{c}"][k]) for c in (place_columns(problem)[d:] if turned else place_columns(problem)[:d])]
    travel = math.hypot(*gone) if way else None
    return Peak(
        tool, "moment" if moment else "force", axis, float(values[k]), moment_unit(problem) if moment else force_unit(problem),
        travel, "rad" if turned else length_unit(problem), str(table["step"][k]), int(table["increment"][k]),
        float(table["time"][k]), *_of_whole(table, case, tool, axis, kinds, k, share),
    )  # fmt: skip


def size_of_force(table: Table, tool: str, problem: Problem) -> NDArray[Any]:
    """Size (n,) of a tool's force in each increment."""
    return _size(table, tool, force_columns(problem)[: directions(problem)])


def _size(table: Table, tool: str, columns: Iterable[str]) -> NDArray[Any]:
    return np.asarray(np.linalg.norm([table[f"{tool}.{c}"] for c in columns], axis=0))


def _of_whole(
    table: Table, case: Case, tool: str, axis: str, kinds: Sequence[str], k: int, share: Share | None
) -> tuple[int | None, float | None, int]:
    """How many parts of the whole press a tool, its force, or moment (columns ``kinds``), in row k then, how many are alike.

    A tool at rest may be one with its images or not; in the plane one that moves along several axes, and moments, are left out.
    """
    d, moment = directions(case.problem), kinds[0][0] == "m"
    moved = any(np.any(table[f"{tool}.{c}"]) for c in place_columns(case.problem))
    if share is None or not moved or (d == 2 and (moment or not axis)):
        return None, None, 1
    images = images_of(case, tool, share.sides)
    if len(images) == 1 and not axis and share.alike == 1:
        return None, None, 1
    own = np.array([float(table[f"{tool}.{c}"][k]) for c in kinds])
    own = moment_of_whole(images, own) if moment else of_whole(images, own)
    along = [i for i, c in enumerate(kinds) if not axis or c[1] == axis[-1]]
    return len(images), float(own[along[0]]) if len(along) == 1 else float(np.linalg.norm(own[along])), share.alike


# ------------------------------------------------------------------------------------------------------------- numbers
def shown(value: float, unit: str, both: bool = True) -> str:
    """A number with its unit, large ones of N and Pa in kN and MPa; with what the files have beside it if *both*."""
    text = f"{_number(value)} {unit}".rstrip()
    larger = scaled(value, unit)
    return text if not larger else f"{larger} ({text})" if both else larger


def scaled(value: float, unit: str) -> str:
    """A large number of N or Pa in kN or MPa, with that unit; nothing of others."""
    for small, large, size in (("N", "kN", 1e3), ("Pa", "MPa", 1e6)):
        if unit.split("/")[0].split(" ")[0] == small and abs(value) >= size:
            return f"{_number(value / size)} {large}{unit.removeprefix(small)}"
    return ""


def _number(value: float) -> str:
    """Four significant digits; no power of ten where plain digits are as clear."""
    if value and 1e-4 <= abs(value) < 1e7:
        return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    return f"{value:.4g}"
