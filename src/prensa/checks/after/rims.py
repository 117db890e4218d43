"""Rims of contacts in space where a tool's edge lies between nodes: the work that closing what it covers beyond them would take.

A patch that grows by an area dA, with the tool held, does the work p w dA: p the pressure that the new strip takes, w the height
by which the body lies before the tool's face there (Irwin's closure integral of a crack). On elements p is that at the nodes
beside the strip, as if the pressure moved along with the rim, and w that of the next nodes: virtual crack closure (Rybicki and
Kanninen, Eng. Fract. Mech. 9, 1977).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from prensa.contact.faces import FacePoints, face_measures
from prensa.contact.forces import ContactForces
from prensa.contact.surface import Surface
from prensa.precision import NEGLIGIBLE
from prensa.system.system import System
from prensa.types import Array, Flags


class Rim(NamedTuple):
    """Work of closing what a tool covers beyond the pressed nodes, and the middle (3,) of the face with most of it."""

    work: float
    place: Array


def rim(system: System, s: Surface, f: ContactForces, x: Array, u: Array, dips: Array, N: Array) -> Rim:
    """The rim of a contact on faces of four nodes, for nodes at x (n, 3) of degrees of freedom u (ndof,).

    ``dips`` (m, k): how much deeper than the nodes the tool lies at places spread evenly on faces, with shape values N (k, 4).
    Places count where it does, on faces of which some nodes are pressed and others are not. Where a tool is round, its face
    before the next node lies beyond it, and nothing would be closed; a fillet is farther off than the face that it ends.

    Of such a place counts, in an elastic body, all: the pressure rises towards an edge, as with a crack; but what lies between
    three pressed nodes of a face. In metal pressure is even, and acts on the nodes that are not pressed by their shape functions.
    """
    assert isinstance(s.points, FacePoints)
    covered = dips > NEGLIGIBLE * float(np.ptp(x[s.points.nodes], axis=0).max())
    pressed = (f.p > 0.0)[s.points.slots]
    faces = np.flatnonzero(pressed.any(axis=1) & ~pressed.all(axis=1) & covered.any(axis=1))
    if not len(faces):
        return Rim(0.0, np.zeros(3))
    ends, on = x[s.points.faces[faces]], pressed[faces]
    ahead = ~on @ N.T
    if system.problem.bodies[s.body].material.plastic:
        counts = ahead
    else:  # the node across from the only one that is not pressed is the farthest within
        beyond = (N - np.roll(N, 2, axis=1)).T > 0.0
        counts = (on.sum(axis=1) < 3)[:, None] | beyond[np.argmin(on, axis=1)]
    whole = _height(system, s, ends, on, u)[:, None]
    height = np.clip(whole * (1.0 - ahead) + dips[faces], 0.0, whole)
    pressure = (f.p[s.points.slots[faces]] * on).sum(axis=1) / on.sum(axis=1)
    work = pressure * face_measures(ends).sum(axis=1) * (covered[faces] * counts * height).mean(axis=1)
    return Rim(float(work.sum()), ends[np.argmax(work)].mean(axis=0))


def _height(system: System, s: Surface, ends: Array, on: Flags, u: Array) -> Array:
    """Means (m,) by which nodes of faces (m, 4, 3) that are not ``on`` (m, 4) the tool lie before its face.

    That goes on from the nodes that are as a paraboloid, by its normal and curvature there.
    """
    master = system.tool_masters[s.against]
    y = master.local(ends.reshape(-1, 3), u)
    close = master.shape.closest(y)
    at = y.reshape(ends.shape)
    way = at[:, None] - at[:, :, None]  # (m, i, j, 3): from node i to node j
    n, c = close.n.reshape(ends.shape), close.c.reshape(*on.shape, 3, 3)
    rises = np.einsum("mijd,mid->mij", way, n) + 0.5 * np.einsum("mijd,mide,mije->mij", way, c, way)
    pairs = on[:, :, None] & ~on[:, None, :]
    return np.asarray((np.maximum(-rises, 0.0) * pairs).sum(axis=(1, 2)) / pairs.sum(axis=(1, 2)))
