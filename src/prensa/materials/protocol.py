"""Interface between elements and materials: context and outcome of an update, the protocol of a law. No kernels."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from prensa.layout import TensorLayout
from prensa.types import Array, Flags


class At(NamedTuple):
    """Context of an update: seconds ``dt`` of the increment and ``time`` at its end, whether the ``tangent`` is wanted.

    ``secant``: how far A is to go from the tangent (0) to the secant moduli of plastic flow (1); a law may give the tangent.
    ``flows`` (n,): which points flow plastically, whatever their trial stress; None: that decides. ``begun``: whether histories
    come from `Flowing.begin`; else they are committed ones. ``temperature`` (n,) of the points at the end of the increment; None:
    the one for which a law has its numbers.
    """

    dt: float
    time: float
    tangent: bool = True
    secant: float = 0.0
    flows: Flags | None = None
    begun: bool = True
    temperature: Array | None = None

    def of(self, rows: NDArray[Any]) -> At:
        """The same for some of the points: places (k,) or flags (n,) of rows."""
        if self.flows is None and self.temperature is None:
            return self
        flows, temperature = (None if v is None else v[rows] for v in (self.flows, self.temperature))
        return self._replace(flows=flows, temperature=temperature)


class Out(NamedTuple):
    """Receives P (n, c) per committed volume, A (n, c, c) = ∂P/∂f if asked for, new history (n, h), failed (n,) flags."""

    P: Array
    A: Array
    new: Array
    failed: Flags


Travel = Literal["smooth", "growing", "nearest", "strain", "flow", "axes"]
"""How a field gets to the points of a new mesh: ``smooth``: recovered, within what is nearby; ``growing``: and not below the
value that points start with; ``nearest``: of the nearest point, which flags need; ``strain``: b_e − I, by its logarithm;
``flow``: a tensor like that, by what its logarithm differs from that of the elastic one; ``axes``: a direction, of length one."""

Initial = float | tuple[float, ...] | Callable[[Array], Array]
"""What a field starts with: a number, one for each of its k columns, or those (n, k) of initial places (n, d)."""


class Field(NamedTuple):
    """A named part of the history: its ``columns``, what points start with, how it gets to a new mesh."""

    columns: slice
    initial: Initial = 0.0
    travel: Travel = "smooth"

    def start(self, X: Array) -> Array:
        """What points of initial places X (n, d) start with, (n, k) or what fills it."""
        return np.asarray(self.initial(X) if callable(self.initial) else self.initial, dtype=np.float64)


class PrincipalElasticity(Protocol):
    """Elasticity stated in NumPy, as functions of the principal strains eps (k, 3): an energy, stresses, or both."""

    symmetric: ClassVar[bool]

    def energy(self, eps: Array) -> Array:
        """Stored energy per initial volume (k,)."""

    def answer(self, eps: Array, tangent: bool) -> tuple[Array, Array | None]:
        """Principal stresses (k, 3) and, if asked for, their derivatives (k, 3, 3)."""


class Material(Protocol):
    """A pure law. Laws of isotropic elasticity use history 0 … k−1 for b_e − I (finite) or the elastic strain (small)."""

    @property
    def layout(self) -> TensorLayout:
        """Components of its tensors."""

    @property
    def size(self) -> int:
        """Length h of the history."""

    @property
    def fields(self) -> Mapping[str, Field]:
        """Parts of the history by name; of elastic laws ``elastic``, of plastic ones ``plastic_strain``, ``plastic_work`` too."""

    @property
    def plastic(self) -> bool:
        """Whether it has the equivalent plastic strain and the plastic work per initial volume among its fields."""

    @property
    def linear(self) -> bool:
        """Whether the stress is linear in the displacement gradient."""

    @property
    def fbar_has_energy(self) -> bool:
        """Whether F-bar quadrilaterals of this law have an energy in plane strain (see `prensa.system.matrix_symmetry`)."""

    @property
    def symmetric(self) -> bool:
        """Whether A (n, c, c) is symmetric at every state."""

    @property
    def E(self) -> float:
        """Young's modulus."""

    @property
    def nu(self) -> float:
        """Poisson's ratio."""

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, h) committed history → out."""

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress xx, yy, zz, xy (in space xz, yz too) from a committed history, (n, h) → (n, k)."""

    def modulus(self) -> float:
        """Elastic modulus E* = E/(1 − ν²) (plane stress: E), a scale of the body's stiffness."""

    def confined_modulus(self) -> float:
        """Stress over strain of a layer that cannot spread, M = E(1 − ν)/((1 + ν)(1 − 2ν)) (plane stress: E/(1 − ν²))."""

    def thickness(self, history: Array) -> Array | None:
        """Thickness over the initial one in plane stress, (..., h) → (...); None where it does not change."""


@runtime_checkable
class Flowing(Protocol):
    """A law whose history knows the plastic strain of the last increment, so that it can be of second order in time."""

    def begin(self, history: Array, share: float) -> Array:
        """What an increment begins with: a committed history (n, h) after a ``share`` of the last plastic strain more."""


@runtime_checkable
class Yielding(Protocol):
    """A law that says what its equivalent stress is; von Mises' of others."""

    def equivalent_stress(self, history: Array) -> Array:
        """σ̄ (n,) of the yield function, a Cauchy stress, of a committed history (n, h)."""
