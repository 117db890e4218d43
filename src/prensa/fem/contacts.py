"""What is asked of all contacts of a system at once: which are a body's, their multipliers, the energy in their penalties."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from prensa.contact.enforcement import ContactForces
from prensa.fem.state import State
from prensa.fem.system import Circumstances, Surface, System

Array = NDArray[np.float64]


def contacts_of(system: System, body: str) -> list[int]:
    """Numbers of the contacts of a body and of those that ties join to it."""
    group = system.tied_bodies(body)
    return [i for i, s in enumerate(system.surfaces) if s.body in group]


def were_closed(state: State, s: Surface) -> bool:
    """Whether some point of a contact was closed at the last commit."""
    return bool((state.contact[s.rows, 3] > 0).any())


def first_multipliers(system: System, state: State) -> Array:
    """Multipliers (points, 2) at the start of an increment: committed tractions; λ_n = 0 for plain penalty."""
    lam = state.lam.copy()
    for s in system.surfaces:
        if s.description.enforcement.type == "penalty":
            lam[s.rows, 0] = 0.0
    return lam


def contact_energy(system: System, c: Circumstances, contacts: Iterable[ContactForces]) -> float:
    """Energy that the penalties of the contacts store; multipliers store none."""
    stored = 0.0
    for s, f, scale in zip(system.surfaces, contacts, c.scales):
        if s.description.enforcement.type == "penalty":
            stored += float(0.5 * (f.weight * f.p**2 / scale.k_n + f.area * f.t**2 / scale.k_t).sum())
    return stored
