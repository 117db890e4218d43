"""Triangulated tools that are coarse against the depth to which they press, or end within a contact."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from prensa.checks.check import Committed, warning
from prensa.checks.thresholds import SLIGHT
from prensa.contact.faces import FacePoints
from prensa.contact.forces import ContactForces
from prensa.contact.surface import Surface
from prensa.errors import Finding, coordinates
from prensa.system.system import System
from prensa.types import Array, Flags, Index


class CoarseTools:
    """Contacts with tools of triangles at the end of a step, each reported once."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.contacts = [(i, s) for i, s in enumerate(system.tool_contacts) if system.tool_masters[s.against].dimension == 3]
        self.reported: set[tuple[str, str]] = set()

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """What there is to say of the facets that are touched."""
        for i, s in self.contacts:
            for kind, words in self._of(s, given.evaluation.contacts[i], given.state.u):
                if (s.name, kind) not in self.reported:
                    self.reported.add((s.name, kind))
                    yield warning(words)

    def _of(self, s: Surface, forces: ContactForces, u: Array) -> Iterator[tuple[str, str]]:
        closed = np.flatnonzero(forces.p > 0.0)
        if not len(closed):
            return
        yield from self._coarse(s, closed, u)
        yield from self._at_border(s, forces.p > 0.0, u)

    def _coarse(self, s: Surface, closed: Index, u: Array) -> Iterator[tuple[str, str]]:
        """Chords of the triangles that the points ``closed`` (k,) touch, over the depth of contact."""
        master, unit = self.system.tool_masters[s.against], self.system.problem.units.length
        x = s.points.at(self.system.positions(u))[closed]
        touched = master.tool.description.touched(master.shape, master.local(x, u))
        if touched is None:
            return
        moved = s.points.at(self.system.displacement(u))[closed]
        depth = float(np.einsum("ki,ki->k", moved, master.seen(x, u).n).max())
        if touched.chord > 2.0 * SLIGHT * depth > 0.0:
            yield "chord", (
                f"tool {s.against!r}: the triangles in contact leave chords of {touched.chord:.2g} {unit} "
                f"({math.degrees(touched.angle):.2g}° between them), {100.0 * touched.chord / depth:.2g} % of the depth of "
                f"contact {depth:.3g}: what is between their corners is a guess; export the STL with a finer tolerance"
            )

    def _at_border(self, s: Surface, closed: Flags, u: Array) -> Iterator[tuple[str, str]]:
        """Open borders between points of one face, of which some are ``closed`` (k,) and others have nothing before them."""
        if not isinstance(s.points, FacePoints):
            return
        master, x = self.system.tool_masters[s.against], s.points.at(self.system.positions(u))
        past = master.tool.description.past_border(master.shape, master.local(x, u))
        across = closed[s.points.slots].any(axis=1) & past[s.points.slots].any(axis=1)
        if across.any():
            at = coordinates(x[s.points.slots[np.argmax(across)]].mean(axis=0))
            yield "border", (
                f"tool {s.against!r}: an open border of its surface presses within {'+'.join(s.description.surface)!r}, as near "
                f"({at}): nothing presses past it, and forces are as rough there as the elements are; export a surface that is "
                "larger than the contact, or the whole body, and shorten the elements along edges that press"
            )
