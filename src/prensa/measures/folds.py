"""Folds of bodies onto themselves as measures: the angle of a corner, how far the nearest fold is open, the number of folds."""

from __future__ import annotations

from prensa.measures.measure import Count, Value

OF_FOLDS = ("folding_angle", "fold_opening", "folds")


def measured(body: str, quantity: str) -> tuple[str, Value, Count | None]:
    """Unit and value of one of `OF_FOLDS` of a body, and what locates it (see `prensa.measures.Measure`)."""
    if quantity == "folding_angle":
        return "deg", lambda i: float(i.folding[body].angle), None
    if quantity == "fold_opening":
        return "", lambda i: float(i.folding[body].opening), None
    return "", lambda i: float(len(i.folding[body].folds)), lambda i, n: i.folding[body].counted(n)
