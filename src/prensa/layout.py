"""Where components stand in arrays. Nobody else does arithmetic on places."""

from __future__ import annotations

from dataclasses import dataclass

Pairs = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class TensorLayout:
    """Components that tensors of a space have in arrays, by pairs of axes counted from zero.

    ``dimension``: displacements of a point. ``full``: places of h = f − I, of P and of the rows and columns of A = ∂P/∂f.
    ``symmetric``: places of symmetric tensors kept as history (b_e − I, elastic strain) and of Cauchy stresses.
    """

    name: str
    dimension: int
    full: Pairs
    symmetric: Pairs

    @property
    def components(self) -> int:
        """Components of an unsymmetric tensor."""
        return len(self.full)

    @property
    def kept(self) -> int:
        """Components of a symmetric tensor; in histories of elastic-plastic laws the column that follows them."""
        return len(self.symmetric)

    @property
    def cauchy(self) -> list[int]:
        """Places of the symmetric components among the full ones, which a symmetric P = σ is read from."""
        return [self.full.index(pair) for pair in self.symmetric]


def _pairs(text: str) -> Pairs:
    return tuple((int(ij[0]) - 1, int(ij[1]) - 1) for ij in text.split())


PLANE = TensorLayout("plane", 2, _pairs("11 12 21 22 33"), _pairs("11 22 33 12"))
"""Plane strain, plane stress and axisymmetry."""

SPATIAL = TensorLayout("3d", 3, _pairs("11 12 13 21 22 23 31 32 33"), _pairs("11 22 33 12 13 23"))
"""Three dimensions."""
