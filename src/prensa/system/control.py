"""Displacement control (in place of arc length): the loads of a step in proportion, by a factor that is a degree of freedom.

The tool that leads is prescribed; its balance, with its push in it, is the equation of the factor. Where all loads have one
factor θ, f = f₀ + (θ − θ₀)(f₁ − f₀) with the loads that are carried at the start of the step and those that are asked for at its
end, that makes the tangent [K, −(f₁ − f₀)] in the columns of the other dofs and of θ (displacement control of Batoz and Dhatt
1979): it is regular where a load passes its maximum.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from prensa.layout import DofMap
from prensa.system.interaction import Context, Interaction, Part, Request, Response
from prensa.types import Index

FACTOR = "load factor"


def factor_field(controlled: bool) -> list[tuple[str, str, int, tuple[str, ...]]]:
    """The field of the factor, for a `DofMap` of a problem with a step that is ``controlled``; none without."""
    return [(FACTOR, "problem", 1, ("factor",))] if controlled else []


def couplings(dofs: DofMap, loaded: Iterable[Index]) -> list[Index]:
    """Pairs (k, 2) of ``loaded`` dofs with the factor, for the pattern of the matrix; none without a factor."""
    if FACTOR not in dofs.fields:
        return []
    factor = dofs.fields[FACTOR].first
    return [_beside(d, factor) for d in (*loaded, np.arange(dofs.tool.first, dofs.tool.slice.stop), np.array([factor]))]


def _beside(dofs: Index, factor: int) -> Index:
    flat = np.unique(dofs)
    return np.stack([flat, np.full(len(flat), factor)], axis=1)


@dataclass(frozen=True)
class Proportional:
    """A load that a step changes from its start to its end by a factor instead of by time."""

    load: Interaction

    def couplings(self) -> list[Index]:
        """Those of the load itself; the factor's are in the pattern from the beginning (see `couplings`)."""
        return list(self.load.couplings())

    def respond(self, c: Context, ask: Request) -> Response:
        """See `Interaction`."""
        control = c.plan.control
        assert control is not None
        grown = float(ask.u[control.factor]) - control.start
        parts = [
            part
            for time, share, sign in ((c.plan.t0, 1.0 - grown, -1.0), (c.plan.t1, grown, 1.0))
            for one in self.load.respond(replace(c, time=time), ask).parts
            for part in _shared(one, share, sign, control.factor, ask.stiffness)
        ]
        return Response(parts, external=True)


def _shared(part: Part, share: float, sign: float, factor: int, stiffness: bool) -> Iterator[Part]:
    """A share of a part, and what its forces, taken with a sign, are to the factor's column of the matrix."""
    r: Any = part.r
    yield part._replace(r=share * r, K=None if part.K is None else share * part.K)
    if stiffness:
        dofs = part.dofs.ravel()
        K = np.zeros((len(dofs), 2, 2))
        K[:, 0, 1] = -sign * r.ravel()
        yield Part(f"{part.key} by the factor", np.stack([dofs, np.full_like(dofs, factor)], axis=1), None, K)
