"""Changes of a discretised problem by a parameter, where the closed derivatives know of it."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from prensa.elements.derivatives import BATCH
from prensa.elements.kinds.isoparametric import Isoparametric
from prensa.elements.kinds.q4_fbar import Q4WithBar
from prensa.materials.point_form import HasPointLaw, PointLaw
from prensa.system.assembly import Block
from prensa.system.system import System
from prensa.types import Array

KNOWN_ENFORCEMENTS = ("penalty", "exact")


class LawChange(NamedTuple):
    """Of a `PointLaw`: its numbers p (n,), and of a table ``knots`` (k,) and ``coefficients`` (k − 1, 4)."""

    p: Array
    knots: Array
    coefficients: Array


class Change(NamedTuple):
    """Derivatives of a system by a parameter.

    ``X`` (n, 2) of the initial places, or None; ``at`` (tools, 2) of the tools' reference points; ``modulus`` (blocks,), E*;
    ``law`` and ``volume`` (e, q) by block; ``scale`` by contact: (3, k) of k_n, k_T and M/h.
    """

    X: Array | None
    at: Array
    modulus: Array
    law: tuple[LawChange, ...]
    volume: tuple[Array, ...]
    scale: tuple[Array, ...]

    @property
    def moves(self) -> bool:
        """Whether bodies or tools begin elsewhere."""
        return self.X is not None or bool(self.at.any())


class Group(NamedTuple):
    """``size`` directions, `BATCH` or fewer, from the ``first`` on, which go through the kernels of elements together.

    By block ``p`` (n, s), changes of the numbers of its law, and ``tables``, those of its knots (k, s) and coefficients
    (k − 1, 4, s).
    """

    first: int
    size: int
    p: tuple[Array, ...]
    tables: tuple[tuple[Array, Array], ...]


class Changes(NamedTuple):
    """Those of d parameters at once, which are the last axis of each array: ``each`` of them, those that move bodies last.

    ``X`` (n, 2, d) of the initial places, (0, 2, d) where all stay; ``volume`` (e, q, m) of the last m alone, which move bodies,
    by block; ``place`` (tools, 2, d); ``scale`` (3, k, d) by contact; ``groups`` of them, in order.
    """

    each: tuple[Change, ...]
    X: Array
    volume: tuple[Array, ...]
    place: Array
    scale: tuple[Array, ...]
    groups: tuple[Group, ...]

    @classmethod
    def of(cls, each: Sequence[Change]) -> Changes:
        """From those of the parameters."""
        last = [ch for ch in each if ch.X is not None]
        moving = np.stack([ch.X for ch in last if ch.X is not None], axis=-1) if last else np.zeros((0, 2, 0))
        X = np.zeros((len(moving), 2, len(each)))
        X[:, :, len(each) - len(last) :] = moving
        none = [np.zeros((*v.shape, 0)) for v in each[0].volume]
        volume = tuple(np.stack(parts, axis=-1) for parts in zip(*(ch.volume for ch in last))) if last else tuple(none)
        scale = tuple(np.stack(parts, axis=-1) for parts in zip(*(ch.scale for ch in each)))
        # Groups of like size: each computes once what its directions share.
        count = -(-len(each) // BATCH)
        ends = [k * len(each) // count for k in range(count + 1)]
        groups = tuple(_group(each[a:b], a) for a, b in pairwise(ends))
        return cls(tuple(each), X, volume, np.stack([ch.at for ch in each], axis=-1), scale, groups)


def _group(some: Sequence[Change], first: int) -> Group:
    """Directions that follow one another from the ``first`` on."""
    p, tables = [], []
    for laws in zip(*(ch.law for ch in some)):
        p.append(np.stack([law.p for law in laws], axis=-1))
        tables.append((np.stack([law.knots for law in laws], axis=-1), np.stack([law.coefficients for law in laws], axis=-1)))
    return Group(first, len(some), tuple(p), tuple(tables))


def known(system: System) -> bool:
    """Whether the closed derivatives know the elements, materials, contacts and geometry of a system."""
    p = system.problem
    return (
        not p.body_contacts and p.space in ("axisymmetric", "plane strain")
        and p.kinematics == "finite"
        and p.contact_geometry == "current"
        and system.ties is None and system.bodies is None and not system.more and not system.gone
        and all(_known_block(b) for b in system.blocks)
        and all(not s.sharp and s.description.enforcement.type in KNOWN_ENFORCEMENTS for s in system.surfaces)
    )  # fmt: skip


def _known_block(b: Block) -> bool:
    compiled = _point_law(b) is not None
    plain = isinstance(b.element, Isoparametric) and type(b.element).respond is Isoparametric.respond
    return compiled and (plain or isinstance(b.element, Q4WithBar)) and b.element.layout.dimension == 2


def places_matter(system: System) -> bool:
    """Whether some history starts with what its law makes of the initial places: that may depend on the law's numbers."""
    return any(callable(f.initial) for b in system.blocks for f in b.law.fields.values())


def change_of(a: System, b: System, step: float) -> Change | None:
    """From the systems a ``step`` of the parameter above and below; None where it changes what is not known of.

    That is the shape of a tool, the thickness, the kind of a law.
    """
    if not (known(a) and known(b) and all(_alike(p, q) for p, q in zip(a.blocks, b.blocks))):
        return None
    # By content: shapes hold arrays, which have no equality of their own.
    if a.tools is not b.tools and any(
        pickle.dumps((s.shape, s.direction)) != pickle.dumps((t.shape, t.direction)) for s, t in zip(a.tools, b.tools)
    ):
        return None

    def slope(x: Array | float, y: Array | float) -> Array:
        return np.asarray((np.asarray(x) - y) / (2.0 * step))

    X = slope(a.X, b.X)
    laws = []
    for p, q in zip(a.blocks, b.blocks):
        new, old = _point_law(p), _point_law(q)
        assert new is not None
        assert old is not None
        laws.append(LawChange(slope(new.p, old.p), slope(new.knots, old.knots), slope(new.coefficients, old.coefficients)))
    scales = []
    for s, t in zip(a.surfaces, b.surfaces):
        above, below = (v.scale(np.zeros(len(v.points))) for v in (s, t))
        scales.append(np.stack([slope(getattr(above, k), getattr(below, k)) for k in ("k_n", "k_t", "unit")]))
    return Change(
        X if X.any() else None,
        np.array([slope(s.at, t.at) for s, t in zip(a.tools, b.tools)]).reshape(-1, 2),
        np.array([slope(p.law.modulus(), q.law.modulus()) for p, q in zip(a.blocks, b.blocks)]),
        tuple(laws),
        tuple(slope(p.volume, q.volume) for p, q in zip(a.blocks, b.blocks)),
        tuple(scales),
    )


def _alike(a: Block, b: Block) -> bool:
    """Whether two blocks have the same form of law and the same thickness."""
    p, q = _point_law(a), _point_law(b)
    assert p is not None
    assert q is not None
    return a.mode == b.mode and p.form == q.form and p.knots.shape == q.knots.shape


def _point_law(b: Block) -> PointLaw | None:
    """The numbers of a block's law; seconds and the like, which are the same on both sides, do not matter."""
    return b.law.point_law(0.0) if isinstance(b.law, HasPointLaw) else None
