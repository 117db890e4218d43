"""Measured flow curves: tables of true flow stress over plastic strain, refused where they are something else."""

from __future__ import annotations

from itertools import pairwise
from math import log
from pathlib import Path
from typing import NamedTuple

import numpy as np

from prensa.errors import PrensaError
from prensa.inverse.flow_laws import FLOW_LAWS
from prensa.materials.flow.table import MOST_LAST
from prensa.model.sheets import Sheet, read_sheet
from prensa.model.tables import read_columns
from prensa.model.units import PRESSURE, STRAIN
from prensa.types import Array

MPA = {"units": {"length": "mm", "force": "N"}}


class FlowData(NamedTuple):
    """Flow stresses (k,) at plastic strains (k,), and the ``unit`` of the stresses: MPa, or '' where the table states none."""

    strain: Array
    stress: Array
    unit: str


def read_flow(path: Path) -> FlowData:
    """The table of a CSV file, stresses in MPa where it states their unit; see `prensa.model.sheets` for how it may be written.

    Raises
    ------
    PrensaError
        With line and remedy, where it has too few readings, strains that fall or that are not plastic, or engineering stresses.

    """
    columns = (("plastic strain", STRAIN), ("flow stress", PRESSURE))
    try:
        rows = read_columns(str(path.absolute()), MPA, "flow curve", columns)
        sheet = read_sheet(path, named=False)
    except ValueError as error:
        raise PrensaError(str(error)) from None
    for name in sheet.names:
        if any(word in name.casefold() for word in ("eng", "nominal", "techn")):
            raise PrensaError(f"{path}: the column {name!r} is of an engineering curve; {_TRUE}")
    _refuse(path, rows, sheet)
    strain, stress = np.array(rows).T
    _refuse_fall(path, strain, stress, sheet)
    return FlowData(strain, stress, "MPa" if sheet.units[1].strip(" -–1") else "")


_TRUE = "give true stress s (1 + e) over plastic strain ln(1 + e) - s (1 + e)/E, from first yield to the largest force"


def _refuse(path: Path, rows: list[tuple[float, ...]], sheet: Sheet) -> None:
    """Refuse tables of few readings, in another order, in another unit, or with the elastic line."""
    fewest = 1 + min(law.constants for law in FLOW_LAWS.values())
    if len(rows) < fewest:
        raise PrensaError(f"{path}: {len(rows)} readings are too few; give {fewest} at least, better 20, from yield on")
    for (strain, stress), line in zip(rows, sheet.lines):
        if strain < 0.0:
            raise PrensaError(f"{path}:{line}: plastic strain {strain:g}; give sizes, of compression too, from zero on")
        if stress <= 0.0:
            raise PrensaError(
                f"{path}:{line}: flow stress {stress:g}; flow curves begin at the yield stress, not at zero: {_TRUE}"
            )
    for ((before, _), (strain, _)), line in zip(pairwise(rows), sheet.lines[1:]):
        if strain < before:
            raise PrensaError(
                f"{path}:{line}: plastic strain falls from {before:g} to {strain:g}; give rising strains, without unloading"
            )
    if rows[-1][0] > MOST_LAST:
        raise PrensaError(
            f"{path}: plastic strains to {rows[-1][0]:g} look like per cent; write the unit over the column, 'strain (%)'"
        )
    (e1, s1), (e2, s2) = [row for row in rows if row[0] > 0.0][:2]
    # Metals harden with exponents below about a half; on the elastic line the stress is proportional to the strain.
    if e2 > e1 and log(s2 / s1) > 3 / 4 * log(e2 / e1):
        at = f"{path}:{sheet.lines[rows.index((e1, s1))]}"
        raise PrensaError(f"{at}: the stress rises in proportion to the strain, as on the elastic line; {_TRUE}")


def _refuse_fall(path: Path, strain: Array, stress: Array, sheet: Sheet) -> None:
    """Refuse curves that fall from their largest stress on, where scatter would make that less often than three deviations."""
    from scipy.stats import linregress, norm

    top = int(np.argmax(stress))
    if len(stress) - top < 3 or strain[top] == strain[-1]:
        return
    line = linregress(strain[top:], stress[top:])
    if line.slope < 0.0 and line.pvalue < 2.0 * norm.sf(3.0):
        raise PrensaError(
            f"{path}:{sheet.lines[top]}: the stress falls from {stress[top]:.4g} here to {stress[-1]:.4g} at the end, as "
            f"engineering stress does from the largest force on; {_TRUE}"
        )
