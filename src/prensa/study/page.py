"""``index.html``: one page that compares all cases of a study and needs nothing but itself."""

from __future__ import annotations

import base64
import io
import json
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from prensa import __version__
from prensa.output.files import write_text
from prensa.output.report import REPORT, SUMMARY, number
from prensa.study import pictures
from prensa.study.quantities import Quantity
from prensa.study.results import CASES_TABLE, PAGE, PARQUET, QUANTILES, Row, Study
from prensa.study.values import Values

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_ROWS = 2000  # of the table on the page; all of them are in table.csv


Drawn = list[tuple[str, "Figure"]]


def write_page(study: Study, draw: Callable[[Study, Quantity], Drawn] | None = None) -> Path:
    """Write the page of a study, with the pictures that *draw* gives of a measure, or those of a sweep; returns its path."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("prensa.study"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    page = environment.get_template("study.html").render(
        name=study.problem.name,
        version=__version__,
        status=study.status,
        factors=list(_factors(study)),
        measures=[_measure(study, q, draw or _drawn) for q in study.quantities],
        columns=study.columns[:-1],
        rows=[_cells(study, row, cells) for row, cells in zip(study.rows[:MOST_ROWS], study.cells())],
        hidden=max(len(study.rows) - MOST_ROWS, 0),
        failed=[(n, row) for n, row in enumerate(study.rows, 1) if row.status in ("failed", "lost")],
        warnings=_warnings(study),
        files=[f for f in (CASES_TABLE, PARQUET) if (study.directory / f).is_file()],
        quantile_names=[f"{100 * q:g} %" for q in QUANTILES],
    )
    return write_text(study.directory / PAGE, page)


def _factors(study: Study) -> Iterator[tuple[str, str, str]]:
    for f in study.plan.factors:
        if isinstance(f, Values):
            summary = ", ".join(f.texts[:12]) + (f", … ({len(f.texts)} values)" if len(f.texts) > 12 else "")
            yield f.path, summary, "fixed" if len(f.texts) == 1 else f"{len(f.texts)} values"
        else:
            yield (
                f.path,
                f.text,
                f"{study.plan.number_of_samples} samples ({study.plan.sampling}, seed {study.plan.seed})",
            )


def _drawn(study: Study, quantity: Quantity) -> Drawn:
    """Captions and pictures of a measure of a sweep."""
    found: Drawn = []
    drawn = pictures.curves(study, quantity)
    if drawn is not None:
        more = f" ({drawn[1]} of {study.status['completed']} cases)" if drawn[1] < study.status["completed"] else ""
        found.append((f"All cases in one axis{more}", drawn[0]))
    shown = pictures.response(study, quantity)
    if shown is not None:
        found.append((f"Response: {quantity.text} {shown[1]}", shown[0]))
    if (bars := pictures.tornado(study, quantity)) is not None:
        ends = "from one end of its values to the other"
        scattered = (
            ", of what scatters from its 5 % to its 95 % quantile (linear regression)" if study.plan.scattered else ""
        )
        found.append((f"What matters most: mean of {quantity.text} as each quantity goes {ends}{scattered}", bars))
    if (steps := pictures.spread(study, quantity)) is not None:
        found.append((f"Scatter of {quantity.text}; points: 5, 25, 50, 75 and 95 %", steps))
    return found


def _measure(study: Study, quantity: Quantity, draw: Callable[[Study, Quantity], Drawn]) -> dict[str, Any]:
    """What the page shows of one measure."""
    found = [(caption, _picture(figure)) for caption, figure in draw(study, quantity)]
    groups = []
    if study.plan.scattered:
        for given, count, mean, sd, at in study.quantiles(quantity.text):
            varied = {p: t for p, t in given.items() if len(_values(study, p)) > 1}
            groups.append(
                (", ".join(f"{p} = {t}" for p, t in varied.items()) or "all", count, *map(_shown, (mean, sd, *at)))
            )
    return {"text": quantity.text, "unit": quantity.unit, "pictures": found, "groups": groups}


def _values(study: Study, path: str) -> tuple[str, ...]:
    return next((f.texts for f in study.plan.varied if f.path == path), ())


def _picture(figure: Figure) -> str:
    buffer = io.BytesIO()
    from prensa.output import style

    with style.styled():
        # Without the name of the program: the same study gives the same bytes.
        figure.savefig(buffer, format="png", dpi=130, bbox_inches="tight", metadata={"Software": None})
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def _cells(study: Study, row: Row, cells: list[Any]) -> dict[str, Any]:
    """A line of the table: its cells, and where the case is."""
    link = f"{row.folder}/{REPORT}" if (study.directory / row.folder / REPORT).is_file() else f"{row.folder}/"
    shown = [_shown(v) if isinstance(v, float) else v for v in cells[:-1]]
    keys = [repr(v) if isinstance(v, int | float) else str(v) for v in cells[:-1]]
    numeric = [isinstance(v, int | float) for v in cells[:-1]]
    return {"cells": list(zip(shown, keys, numeric)), "link": link, "status": row.status}


def _shown(value: float) -> str:
    return "–" if value != value else number(value)


def _warnings(study: Study) -> list[tuple[str, int]]:
    """Warnings of the runs, each with the number of cases that have it, the most frequent first."""
    counts: Counter[str] = Counter()
    for folder in {row.folder for row in study.rows if row.status in ("completed", "failed")}:
        try:
            summary = json.loads((study.directory / folder / SUMMARY).read_text(encoding="utf-8"))
            counts.update(set(summary["warnings"]))
        except (OSError, ValueError, KeyError):
            continue
    return sorted(counts.items(), key=lambda item: (-item[1], item[0]))[:20]
