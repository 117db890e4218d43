"""Questions about several contacts at once: which are a body's, whether one was closed."""

from __future__ import annotations

from prensa.contact.surface import Surface
from prensa.system.state import State
from prensa.system.system import System


def contacts_of(system: System, body: str) -> list[int]:
    """Numbers of the contacts that act on a body or on those that ties join to it, as its own or as those of their master."""
    group = system.tied_bodies(body)
    return [i for i, s in enumerate(system.surfaces) if s.acts_on(group)]


def were_closed(state: State, s: Surface) -> bool:
    """Whether some point of a contact was closed at the last commit."""
    return bool(state.contact.closed[s.rows].any())
