"""``report.html``: a run in one file that needs no other, written from the files in its folder."""

from __future__ import annotations

import base64
import importlib.util
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from prensa.checks.thresholds import IMBALANCE
from prensa.errors import take_path
from prensa.measures.columns import directions, force_columns, place_columns
from prensa.model.problem import Case, Problem
from prensa.output import answer, dies, style
from prensa.output.files import file_name, write_text
from prensa.output.history import energies_of
from prensa.output.maxima import largest_force, maxima
from prensa.output.packing import as_text
from prensa.output.pictures import PICTURES, by_importance, caption, order
from prensa.output.stored import Placement, Stored
from prensa.output.summary import COMPLETED, ENDED, SUMMARY, has_ended
from prensa.output.summary import read_summary as read_summary

REPORT = "report.html"
MOST_PAGE = 10_000_000  # bytes of the page, which can be mailed then, however many steps the run has
MOST_STILLS = 3_000_000  # of these, characters of the pictures that are drawn without a script
MOST_SENTENCES = 20_000  # and of the list of the increments that are shown
MOST_INPUT = 1_000_000  # and of the case: one whose meshes are arrays is larger
BOKEH = ("bokeh.min.js", "bokeh-api.min.js")  # the library that draws, as it is in Python's package


def write_report(directory: str | Path) -> Path:
    """Write ``report.html`` of the run in *directory* from its summary, history and pictures; returns its path.

    The page needs nothing but itself: pictures are inside, nothing is fetched. Of a run that is still going or was killed it
    shows what there is, without pictures: those are drawn when a run ends, what is there is of an earlier end.

    Raises
    ------
    PrensaError
        If *directory* holds no summary of a run.

    """
    import jinja2

    directory = take_path("write_report", directory)
    summary = read_summary(directory)
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("prensa.output"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    stored = stored_run(directory, summary)
    stills, of = _stills(directory, stored) if summary["status"] in ENDED else ([], 0)
    environment.filters |= {"number": number, "seconds": lambda s: f"{s:.2f}" if s < 100 else f"{s:.0f}"}
    template = environment.get_template("report.html")
    given = {"run": summary, "pictures": stills, "drawn": of, "input": _input(summary), **_tables(stored, summary)}
    rest = template.render(**given, **_interactive(stored, None))
    page = template.render(**given, **_interactive(stored, MOST_PAGE - len(rest.encode()))) if stored.with_fields else rest
    if summary["status"] not in ENDED and has_ended(directory):
        return write_report(directory)  # meanwhile: what it writes of itself is not to be replaced by what was before
    return write_text(directory / REPORT, page, shared=True)


def stored_run(directory: Path, summary: Mapping[str, Any] | None = None) -> Stored:
    """The increments in *directory*, as many as *summary* (None: that of now) counts; raises PrensaError where no run is."""
    from prensa.model.schema import loads

    summary = read_summary(directory) if summary is None else summary
    placements = {t: Placement(tuple(p["at"]), tuple(p["direction"])) for t, p in summary.get("tools", {}).items()}
    case, most = loads(summary["case"], SUMMARY, bounded=False), summary["totals"]["increments"]
    return Stored(directory, case, placements, summary["status"] == COMPLETED, most)


def number(value: float, digits: int = 5) -> str:
    """*value* for a reader: significant digits, powers of ten only where zeros would fill the cell, a true minus sign."""
    if not math.isfinite(value):  # of a table that was damaged
        return "—"
    if value == 0 or 1e-3 <= abs(value) < 1e7:
        text = f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"
        return text.replace("-", "−")
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa.replace('-', '−')} · 10{raised}"


# ------------------------------------------------------------------------------------------------------------- details
def _interactive(stored: Stored, room: int | None) -> dict[str, Any]:
    """The interactive part: the library that draws it, the script that drives that, and what it shows in so many characters.

    Without ``room`` (None) all but what it shows, from which the room that is left follows.
    """
    from prensa.output.scene import as_json, scene

    if not stored.with_fields:
        return {"frames": 0, "thinned": "", "which": "", "touched": False}
    there = len(stored.with_fields)
    given = {"frames": there, "library": _library(), "script": _template("report.js"), "viewer": _template("report_space.js")}
    if room is None:
        return given | {"scene": "", "data": "", "thinned": "", "which": "", "touched": False}
    made, data = scene(stored, room - MOST_SENTENCES)
    return given | {"scene": as_json(made), "data": data, "touched": bool(made["contacts"])} | _left_out(made)


def _left_out(made: Mapping[str, Any]) -> dict[str, str]:
    """``thinned``: how many of the increments the page shows, where it does not show all; ``which`` they are."""
    (shown, there), (rows, increments) = made["shown"], made["drawn"]
    text = which = ""
    if shown < there:
        text = f"{shown} of the {there} increments with fields are shown, to keep the page below {MOST_PAGE / 1e6:.0f} MB: the "
        text += "first, the last, that of the largest force, and others spaced evenly by the travel of the tools."
        which = ", ".join(str(made["history"]["increment"][k]) for k in made["frames"])
    if rows < increments:
        text += f" Curves have {rows} of the {increments} increments; all are in history.csv."
    return {"thinned": text.strip(), "which": which}


def _input(summary: Mapping[str, Any]) -> str:
    """The case of a run as the page shows it."""
    text: str = summary["case"]
    return text if len(text) <= MOST_INPUT else f"The input has {len(text) / 1e6:.1f} MB; it is 'case' in summary.json."


def _template(name: str) -> str:
    return resources.files("prensa.output").joinpath(f"templates/{name}").read_text(encoding="utf-8")


def _library() -> str:
    """Bokeh's scripts as they ship with the Python package, compressed, as text; nothing of the package is imported."""
    found = importlib.util.find_spec("bokeh")
    assert found is not None and found.origin is not None
    folder = Path(found.origin).parent / "server/static/js"
    return as_text(b";\n".join((folder / name).read_bytes() for name in BOKEH))


def _tables(stored: Stored, summary: dict[str, Any]) -> dict[str, Any]:
    from prensa.model.schema import loads

    case = loads(summary["case"], SUMMARY, bounded=False)
    problem, history = case.problem, stored.history
    last = {k: v[-1] for k, v in history.items()} if len(history["time"]) else {}
    columns, heads = _of_tools(problem)
    scale = max((abs(float(last[f"energy.{e}"])) for e in energies_of(problem)), default=0.0) if last else 0.0
    return {
        "answer": answer.lines(history, case, summary),
        "warnings": answer.weighed(summary.get("warnings", []), summary.get("warnings_about", {})),
        "scaled": answer.scaled,
        "facts": list(_facts(case, summary)),
        "maxima": maxima(stored),
        "words": list(_words(summary, stored, case)),
        "file": f"{file_name(problem.name)}.yaml",
        "tools": [(t, [float(last[f"{t}.{c}"]) for c in columns]) for t in problem.tools if last],
        "tool_columns": heads,
        "areas": [(c.name, float(last[f"{c.name}.area"])) for c in problem.all_contacts if last],
        "measured_steps": list(dict.fromkeys(s for m in summary.get("measures", {}).values() for s in m["steps"])),
        "means": [(step, *row) for step, rows in summary.get("passage_means", {}).items() for row in _means(rows, problem)],
        "energies": [(e, float(last[f"energy.{e}"]), abs(float(last[f"energy.{e}"])) / scale if scale else 0.0)
                     for e in energies_of(problem) if last],
        "units": {"length": style.length_unit(problem), "force": style.force_unit(problem), "area": style.area_unit(problem),
                  "moment": style.moment_unit(problem), "energy": style.energy_unit(problem)},
        "axes": style.axes_names(problem),
        "solid": problem.space == "solid",
        "stress": style.pressure_unit(problem),
        "dies": dies.in_report(stored, case),
        "thickness": problem.thickness,
        "time": float(last["time"]) if last else 0.0,
        "step": str(last.get("step", "–")),
    }  # fmt: skip


def _of_tools(problem: Problem) -> tuple[list[str], list[str]]:
    """Columns of the last forces and places of tools, and their heads; about an axis what has a meaning there."""
    d, axes, force, length = directions(problem), style.axes_names(problem), style.force_unit(problem), style.length_unit(problem)
    if problem.space == "axisymmetric":
        return ["fy", "uy"], [f"force z ({force})", f"uz ({length})"]
    names = [""] if d == 2 else [f" {axis}" for axis in axes]
    heads = [f"force {axis} ({force})" for axis in axes] + [f"moment{n} ({style.moment_unit(problem)})" for n in names]
    heads += [f"u{axis} ({length})" for axis in axes] + [f"rotation{n} (rad)" for n in names]
    return [*force_columns(problem), *place_columns(problem)], heads


def _means(found: dict[str, dict[str, float]], problem: Problem) -> Iterator[tuple[str, float, float, str]]:
    """Quantity, mean, ripple and unit, without what vanishes or has no mechanical meaning about an axis.

    Nothing where the largest force ripples by more than its mean: no flow was steady there.
    """
    units = {"fx": style.force_unit(problem), "fy": style.force_unit(problem), "mz": style.moment_unit(problem)}
    forces = [v for q, v in found.items() if q[-2:] in ("fx", "fy")]
    largest = max((abs(v["mean"]) for v in forces), default=0.0)
    if any(abs(v["mean"]) == largest and v["ripple"] > largest for v in forces):
        return
    for name, v in found.items():
        key = name[-2:] if name[-2:] in units else ""
        if (key and abs(v["mean"]) <= 1e-6 * largest) or (key in ("fx", "mz") and problem.space == "axisymmetric"):
            continue
        yield name, v["mean"], v["ripple"], units.get(key, style.pressure_unit(problem))


def _words(summary: dict[str, Any], stored: Stored, case: Case) -> Iterator[str]:
    """What convergence, energies and the two pressures say about the answer, in plain words."""
    history, totals = stored.history, summary["totals"]
    if not len(stored):
        yield "No increment was completed, so there is nothing to judge."
        return
    per, most = history["iterations"], int(np.argmax(history["iterations"]))
    yield (
        f"{totals['increments']} increments took {totals['iterations']} Newton iterations: {per.mean():.1f} each, "
        f"at most {per[most]} (increment {history['increment'][most]}, step {history['step'][most]})."
    )
    cut = np.flatnonzero(history["cutbacks"])
    if len(cut):
        worst = int(np.argmax(history["cutbacks"]))
        yield (
            f"{len(cut)} increments were cut into shorter ones before they converged, most often increment "
            f"{history['increment'][worst]} (time {history['time'][worst]:.4g}). Cuts cost time, not accuracy."
        )
    else:
        yield "Every increment converged at its full length."
    if "remeshings" in history and (made := int(history["remeshings"][-1])):
        spent, wall = summary["timings"].get("remeshing", 0.0), totals["wall_seconds"]
        yield f"{made} new meshes took {100 * spent / wall if wall else 0:.0f} % of the time."
    asked, got = summary["convergence"]["tolerance"], summary["convergence"]["max_residual"]
    yield f"Forces balance to {number(got, 2)} of their size at worst ({number(asked, 2)} was asked for)."
    largest = max(float(np.abs(history[f"energy.{e}"]).max()) for e in energies_of(case.problem) if e != "imbalance")
    if largest > 0:
        share = 100 * float(np.abs(history["energy.imbalance"]).max()) / largest
        verdict = "more increments would make it close" if share > 100 * IMBALANCE else "the increments are short enough"
        yield f"The energy balance holds to {number(share, 2)} % of the largest energy: {verdict}."
    yield from _pressures_agree(stored)


def _pressures_agree(stored: Stored) -> Iterator[str]:
    """How far the pressures of nodal forces and of stresses are apart where the force is largest: an error of the mesh."""
    peak = largest_force(stored)
    for name, contact in (stored.number(peak).contacts if peak is not None else {}).items():
        closed = contact.status > 0
        if closed.sum() > 2 and (top := float(contact.pressure.max())) > 0:
            apart = 100 * float(contact.error[closed].mean()) / top
            verdict = "good" if apart < 5 else "fair; a finer mesh at the contact would show it sharper" if apart < 15 else \
                "coarse: refine the mesh at the contact before trusting local pressures"  # fmt: skip
            yield (
                f"{name}: pressures from nodal forces and from stresses differ by {apart:.1f} % of the largest on average, "
                f"at the largest force: {verdict}."
            )


def _facts(case: Case, summary: dict[str, Any]) -> Iterator[tuple[str, str]]:
    from prensa.model.schema import in_short

    p: Problem = case.problem
    surface = "moved" if p.contact_geometry == "current" else "undeformed"
    yield "Kind", f"{p.space}, {p.kinematics} deformation, contact on the {surface} surface"
    yield "Units", f"{p.units.length}, {p.units.force}, {style.pressure_unit(p)}"
    for name, body in p.bodies.items():
        size = summary["bodies"].get(name, {})
        mesh = "a mesh by its points and cells" if body.mesh.type == "points" else in_short(body.mesh)
        element = size.get("element", p.element_name(name))  # of older runs it was not written
        yield f"Body {name}", f"{size.get('elements', '?')} elements {element}, {mesh}; {in_short(body.material)}"
    for name, tool in p.tools.items():
        yield f"Tool {name}", in_short(tool)
    for contact in p.all_contacts:
        friction = contact.friction or p.friction
        yield (
            f"Contact {contact.name}",
            f"friction {in_short(friction) if friction else 'none'}; {contact.enforcement.type}",
        )
    for name, support in p.fixed.items():
        yield f"Support {name}", in_short(support)
    for step in p.steps:
        given = in_short(replace(step, name="_")).replace("{name: _", "{", 1).replace("{, ", "{", 1)
        yield f"Step {step.name}", given if given != "{}" else "nothing moves"


def _stills(directory: Path, stored: Stored) -> tuple[list[tuple[str, str]], int]:
    """Pairs (caption, data URI) of the pictures of a run, in reading order, and how many there are.

    Where they have more than `MOST_STILLS` characters, some of the shapes at ends of steps are left out, evenly by travel.
    """
    solid = stored.problem.space == "solid"
    there = sorted((p for p in (directory / PICTURES).glob("*.png") if caption(p, solid)), key=order)
    shown, room = set(), float(MOST_STILLS)
    for path in by_importance(there, stored):
        room -= 4 * path.stat().st_size / 3 + 200
        if room < 0:
            break
        shown.add(path)
    uris = (("data:image/png;base64," + base64.b64encode(p.read_bytes()).decode(), p) for p in there if p in shown)
    return [(caption(path, solid), uri) for uri, path in uris], len(there)
