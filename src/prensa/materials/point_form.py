"""Point form of a law in finite strain: its answer at one point, from which derivatives of elements are generated.

A form is what a law is apart from its numbers: equal forms have the same kernels. It records the point function that the
law's own kernel is made of, see `prensa.kernels.record`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from prensa.kernels.record import Node
from prensa.types import Array


class Given(NamedTuple):
    """Of a point in an increment: histories ``committed``, ``old`` as it begins and ``new`` as it was found; numbers ``p``.

    ``share`` of the last plastic strain with which it begins, see `prensa.materials.hencky_j2.begin`; None: as committed.
    """

    committed: Sequence[Node]
    old: Sequence[Node]
    new: Sequence[Node]
    p: Sequence[Node]
    share: Node | None


class Found(NamedTuple):
    """Kirchhoff stress 11, 22, 33, 12, history, stored energy and plastic work per initial volume.

    ``volume``: as the increment begins, over the initial one. ``strains``: plastic ones as committed, as the increment begins and
    ends, of a law that reads a table.
    """

    stress: Sequence[Node]
    history: Sequence[Node]
    energy: Node
    work: Node
    volume: Node
    strains: tuple[Node, Node, Node]


class PointForm(Protocol):
    """A law apart from its numbers; hashable."""

    @property
    def size(self) -> int:
        """Columns of the history."""

    @property
    def numbers(self) -> int:
        """How many numbers p there are."""

    @property
    def table_at(self) -> int | None:
        """Place among them of the numbers of a table, see `prensa.materials.hardening`; None where none is read."""

    def answer(self, h: Sequence[Node], at: Given) -> Found:
        """The law at a gradient h of the increment, 11, 12, 21, 22, 33."""


class PointLaw(NamedTuple):
    """A form with its numbers p and its table: knots (k,), coefficients (k − 1, 4)."""

    form: PointForm
    p: Array
    knots: Array
    coefficients: Array


@runtime_checkable
class HasPointLaw(Protocol):
    """A law whose derivatives may be generated."""

    def point_law(self, seconds: float) -> PointLaw | None:
        """Of an increment of so many seconds; None where there is none, in small strain for example."""
