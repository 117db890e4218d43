"""Overlaps of contacts and ties that are meant: how far they have grown, and what they do to gaps.

An overlap grows linearly in time over a step. Of a contact it is a nodal length that is added to the gap (`Surface.shift`); of a
tie it is a degree of freedom, prescribed from 0 to 1, that moves the slave side against the master side (`Ties.jump`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from prensa.contact.surface import Surface
from prensa.layout import DofMap
from prensa.model import problem as model
from prensa.model.interference import interference_of, step_of
from prensa.system.schedule import Prescribed, amplitude
from prensa.types import Array, Index

TIE_SHARES = "interference"
"""Name of the field of the shares of overlaps that ties have grown to."""


def shares_field(problem: model.Problem) -> list[tuple[str, str, int, tuple[str, ...]]]:
    """The field of the shares, for a `DofMap`; none without interference in ties."""
    count = len(interfering_ties(problem))
    return [(TIE_SHARES, "tie", count, ("share",))] if count else []


def interfering_ties(problem: model.Problem) -> list[model.Tie]:
    """The ties with an overlap that is meant, in the order of the shares."""
    return [tie for tie in problem.ties if tie.interference is not None]


def couplings(dofs: DofMap) -> list[Index]:
    """Each share by itself (k, 1), for the pattern of the matrix."""
    return [dofs.fields[TIE_SHARES].dofs(np.arange(dofs.fields[TIE_SHARES].count))] if TIE_SHARES in dofs.fields else []


def share_groups(problem: model.Problem, dofs: DofMap, number: int, step_start: Array) -> list[Prescribed]:
    """What step *number* prescribes of the shares: those that grow in it go from 0 to 1, all others stay."""
    out = []
    for i, tie in enumerate(interfering_ties(problem)):
        dof, given = dofs.fields[TIE_SHARES].dofs(i), interference_of(tie)
        assert given is not None
        grows = step_of(problem, given) == number
        course = amplitude(1.0, 0.0, float(number), number + 1.0) if grows else None
        out.append(Prescribed(dof, step_start[dof].copy(), course))
    return out


def with_all_shares(dofs: DofMap, u: Array) -> Array:
    """Degrees of freedom (ndof,) u with the overlaps of all ties grown: where the sides touch as they were drawn, unstrained."""
    if TIE_SHARES not in dofs.fields:
        return u
    out = u.copy()
    out[dofs.fields[TIE_SHARES].slice] = 1.0
    return out


def grown(problem: model.Problem, contact: model.Contact, time: float) -> float:
    """Share (0 … 1) of the overlap of a contact that there is at a time."""
    given = interference_of(contact)
    return 0.0 if given is None else min(max(time - step_of(problem, given), 0.0), 1.0)


def at_time(
    problem: model.Problem, surfaces: list[Surface], time: float, nodes: int, gaps: Callable[[Surface], Array]
) -> list[Surface]:  # fmt: skip
    """Contacts with the shifts of their gaps at a time.

    ``nodes`` of the system; ``gaps`` (k,) of the nodes of a contact as it is drawn.
    """
    return [replace(s, shift=_shift(problem, s, time, nodes, gaps)) for s in surfaces]


def _shift(
    problem: model.Problem, s: Surface, time: float, nodes: int, gaps: Callable[[Surface], Array]
) -> Array | None:  # fmt: skip
    """What is added to the gaps at the nodes (n,) of the system; None if that is nothing.

    A length is a tool that is thicker by it; a drawn overlap is taken away at first and comes back.
    """
    if isinstance(s.description, model.BodyContact) or (given := interference_of(s.description)) is None:
        return None
    share = grown(problem, s.description, time)
    # A tool that is thicker has a smaller gap at every node, so that the shift has one value.
    if given.by != "geometry":
        return np.full(nodes, -share * float(given.by)) if share > 0.0 else None
    if share == 1.0:
        return None
    gap, out = gaps(s), np.zeros(nodes)
    out[s.points.nodes] = (1.0 - share) * np.maximum(-np.where(np.isfinite(gap), gap, 0.0), 0.0)
    return out
