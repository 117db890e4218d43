"""Questions about several contacts at once: which are a body's, whether one was closed."""

from __future__ import annotations

from prensa.contact.surface import Surface
from prensa.system.once import once
from prensa.system.state import State
from prensa.system.system import System


def contacts_of(system: System, body: str) -> list[int]:
    """Numbers of the contacts that act on a body or on those that ties join to it, as its own or as those of their master."""
    return _by_body(system)[body]


@once
def _by_body(system: System) -> dict[str, list[int]]:
    """Those of all bodies: which they are does not change from increment to increment."""
    groups = {body: system.tied_bodies(body) for body in system.problem.bodies}
    return {body: [i for i, s in enumerate(system.surfaces) if s.acts_on(group)] for body, group in groups.items()}


def were_closed(state: State, s: Surface) -> bool:
    """Whether some point of a contact was closed at the last commit."""
    return bool(state.contact.closed[s.rows].any())
