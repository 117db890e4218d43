"""Measures: numbers of an increment by name, such as ``punch.force.y`` or ``billet.right.x at y=0``.

`parse` makes a `Measure` of a text, or refuses it with a remedy; the measures of a case have a name of their own under its key
``measures``. The guide (docs/guide/measures.md) lists them all.
"""

from __future__ import annotations

from prensa.measures.grammar import OVER_RUN, along_sides, names, parse, parse_all
from prensa.measures.measure import Gradient, Measure, MeasureError
from prensa.measures.targets import refuse_targets, targets

__all__ = [
    "OVER_RUN", "Gradient", "Measure", "MeasureError", "along_sides", "names", "parse", "parse_all", "refuse_targets", "targets",
]  # fmt: skip
