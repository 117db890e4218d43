"""What a parameter changes of a discretised problem itself, where the closed derivatives know of it."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prensa.elements.derivatives import BATCH
from prensa.elements.kinds.isoparametric import Isoparametric
from prensa.elements.kinds.q4_fbar import Q4Bar
from prensa.materials.flow_curve import FlowParameters
from prensa.materials.j2 import CURVE_AT
from prensa.materials.laws import J2, Hencky
from prensa.system.assembly import Block
from prensa.system.system import System
from prensa.types import Array

KNOWN_ENFORCEMENTS = ("penalty", "exact")


class FlowChange(NamedTuple):
    """Of a compiled flow curve: its scalars p (5,), and of a table ``knots`` (k,) and ``coefficients`` (k − 1, 4)."""

    p: Array
    knots: Array
    coefficients: Array


class Change(NamedTuple):
    """Derivatives of a system by a parameter.

    ``X`` (n, 2) of the initial places, or None; ``at`` (tools, 2) of the tools' reference points; ``bulk``, ``G`` (blocks,) of
    moduli; ``flow`` and ``volume`` (e, q) by block, None where they stay; ``scale`` by contact: (3, k) of k_n, k_T and E*/h.
    """

    X: Array | None
    at: Array
    bulk: Array
    G: Array
    flow: tuple[FlowChange | None, ...]
    volume: tuple[Array, ...]
    scale: tuple[Array, ...]

    @property
    def moves(self) -> bool:
        """Whether bodies or tools begin elsewhere."""
        return self.X is not None or bool(self.at.any())


class Group(NamedTuple):
    """``size`` directions, `BATCH` or fewer, from the ``first`` on, which go through the kernels of elements together.

    By block ``p`` (9, s), changes of the numbers of a metal (see `prensa.materials.j2.numbers`), and ``tables``, those of the
    knots (k, s) and coefficients (k − 1, 4, s) of its flow curve.
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
    def of(cls, each: Sequence[Change], curves: Sequence[FlowParameters]) -> Changes:
        """From those of the parameters; curves: flow curves by block, `NO_CURVE` where there is none."""
        last = [ch for ch in each if ch.X is not None]
        moving = np.stack([ch.X for ch in last if ch.X is not None], axis=-1) if last else np.zeros((0, 2, 0))
        X = np.zeros((len(moving), 2, len(each)))
        X[:, :, len(each) - len(last) :] = moving
        none = [np.zeros((*v.shape, 0)) for v in each[0].volume]
        volume = tuple(np.stack(parts, axis=-1) for parts in zip(*(ch.volume for ch in last))) if last else tuple(none)
        scale = tuple(np.stack(parts, axis=-1) for parts in zip(*(ch.scale for ch in each)))
        groups = tuple(_group(each[first : first + BATCH], first, curves) for first in range(0, len(each), BATCH))
        return cls(tuple(each), X, volume, np.stack([ch.at for ch in each], axis=-1), scale, groups)

    def places(self, own: slice, nodes: int) -> Array:
        """What some directions change of the initial places, (n, 2, s)."""
        return np.ascontiguousarray(self.X[..., own]) if len(self.X) else np.zeros((nodes, 2, own.stop - own.start))


def _group(some: Sequence[Change], first: int, curves: Sequence[FlowParameters]) -> Group:
    """Directions that follow one another from the ``first`` on."""
    p, tables = [], []
    for k, curve in enumerate(curves):
        still = FlowChange(*(np.zeros_like(a) for a in curve[1:]))
        flow = [ch.flow[k] or still for ch in some]
        rest = np.zeros(CURVE_AT - 2)
        p.append(np.stack([[ch.bulk[k], ch.G[k], *rest, *f.p] for ch, f in zip(some, flow)], axis=-1))
        tables.append((np.stack([f.knots for f in flow], axis=-1), np.stack([f.coefficients for f in flow], axis=-1)))
    return Group(first, len(some), tuple(p), tuple(tables))


def known(system: System) -> bool:
    """Whether the closed derivatives know the elements, materials, contacts and geometry of a system."""
    p = system.problem
    return (
        p.space in ("axisymmetric", "plane strain")
        and p.kinematics == "finite"
        and p.contact_geometry == "current"
        and system.ties is None and system.bodies is None and not system.more and not system.gone
        and all(_known_block(b) for b in system.blocks)
        and all(not s.sharp and s.description.enforcement.type in KNOWN_ENFORCEMENTS for s in system.surfaces)
    )  # fmt: skip


def _known_block(b: Block) -> bool:
    compiled = isinstance(b.law, Hencky) or (isinstance(b.law, J2) and b.law.flow is not None)
    plain = isinstance(b.element, Isoparametric) and type(b.element).respond is Isoparametric.respond
    return compiled and (plain or isinstance(b.element, Q4Bar)) and b.element.layout.dimension == 2


def change_of(a: System, b: System, step: float) -> Change | None:
    """From the systems a ``step`` of the parameter above and below; None where it changes what is not known of.

    That is the shape of a tool, the thickness, the kind of a law.
    """
    if not (known(a) and known(b) and all(_alike(p, q) for p, q in zip(a.blocks, b.blocks))):
        return None
    if a.tools is not b.tools and any(
        pickle.dumps((s.shape, s.direction)) != pickle.dumps((t.shape, t.direction)) for s, t in zip(a.tools, b.tools)
    ):
        return None

    def slope(x: Array | float, y: Array | float) -> Array:
        return np.asarray((np.asarray(x) - y) / (2.0 * step))

    X = slope(a.X, b.X)
    flow: list[FlowChange | None] = []
    for p, q in zip(a.blocks, b.blocks):
        old, new = getattr(q.law, "flow", None), getattr(p.law, "flow", None)
        if old is None or new is None:
            flow.append(None)
            continue
        parts = slope(new.p, old.p), slope(new.knots, old.knots), slope(new.coefficients, old.coefficients)
        flow.append(FlowChange(*parts) if any(v.any() for v in parts) else None)
    laws = [(p.law, q.law) for p, q in zip(a.blocks, b.blocks)]
    scales = []
    for s, t in zip(a.surfaces, b.surfaces):
        above, below = (v.scale(np.zeros(len(v.points))) for v in (s, t))
        scales.append(np.stack([slope(getattr(above, k), getattr(below, k)) for k in ("k_n", "k_t", "unit")]))
    return Change(
        X if X.any() else None,
        np.array([slope(s.at, t.at) for s, t in zip(a.tools, b.tools)]).reshape(-1, 2),
        np.array([slope(_bulk(p), _bulk(q)) for p, q in laws]),
        np.array([slope(_shear(p), _shear(q)) for p, q in laws]),
        tuple(flow),
        tuple(slope(p.volume, q.volume) for p, q in zip(a.blocks, b.blocks)),
        tuple(scales),
    )


def _alike(a: Block, b: Block) -> bool:
    """Whether two blocks have the same kind of law and the same thickness."""
    if type(a.law) is not type(b.law) or a.mode != b.mode:
        return False
    if not isinstance(a.law, J2) or not isinstance(b.law, J2):
        return True
    assert a.law.flow is not None
    assert b.law.flow is not None
    return (
        a.law.yield_on_cauchy == b.law.yield_on_cauchy
        and a.law.flow.kind == b.law.flow.kind
        and a.law.flow.knots.shape == b.law.flow.knots.shape
    )


def _bulk(law: object) -> float:
    assert isinstance(law, J2 | Hencky)
    return law.E / (3.0 * (1.0 - 2.0 * law.nu))


def _shear(law: object) -> float:
    assert isinstance(law, J2 | Hencky)
    return law.mu
