"""Rigid-body motions of a body in space in words: along which axes it may move, about which lines it may turn."""

from __future__ import annotations

import numpy as np

from prensa.precision import DRAWN
from prensa.types import Array


def in_words(motions: Array, centre: Array, size: float) -> str:
    """Independent motions (k, 6), three translations and three turns about the ``centre`` (3,) times the ``size``.

    They are sorted into those that only displace, and the turns that are left beside these.
    """
    _, values, ways = np.linalg.svd(motions[:, 3:].T)
    turning = int((values > DRAWN).sum())
    slides = _span(ways[turning:] @ motions[:, :3])
    turns = ways[:turning] @ motions
    turns[:, :3] -= turns[:, :3] @ slides.T @ slides  # what of them a translation undoes
    words = [f"move along {_axes(slides)}"] if len(slides) else []
    if len(turns) == 1 and not _screws(turns[0]):
        words.append(f"turn about {_line(turns[0], centre, size)}")
    elif len(turns):
        words.append(f"turn about {_axes(_span(turns[:, 3:]))}")
    return " and to ".join(words)


def _span(vectors: Array) -> Array:
    """Orthonormal vectors (m, 3) that span the same as vectors (k, 3)."""
    _, values, ways = np.linalg.svd(np.concatenate([vectors, np.zeros((3, 3))]), full_matrices=False)
    return np.asarray(ways[values > DRAWN])


def _axes(span: Array) -> str:
    """A space that orthonormal vectors (m, 3) span: by axes of the coordinates where these span it, else by vectors."""
    inside = np.flatnonzero(np.linalg.norm(span, axis=0) > 1.0 - DRAWN)
    if len(inside) == len(span):
        names = ["xyz"[k] for k in inside]
        return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    return " and ".join(_vector(v) for v in span)


def _vector(v: Array) -> str:
    """A direction without a sense: its largest component is positive."""
    v = v * np.sign(v[np.argmax(np.abs(v))])
    return f"({', '.join(f'{0.0 if abs(c) < DRAWN else c:.3g}' for c in v)})"


def _screws(turn: Array) -> bool:
    """Whether a turn comes with a displacement along its axis."""
    return bool(abs(turn[:3] @ turn[3:]) > DRAWN * float(turn[3:] @ turn[3:]))


def _line(turn: Array, centre: Array, size: float) -> str:
    """The axis of a turn (6,), by its direction and a place on it."""
    along = turn[3:]
    place = centre + size * np.cross(along, turn[:3]) / float(along @ along)
    at = ", ".join(f"{0.0 if abs(c) < DRAWN * size else c:.4g}" for c in place)
    return f"{_axes(_span(along[None]))} through ({at})"
