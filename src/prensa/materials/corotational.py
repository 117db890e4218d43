"""Tensors of the plane in axes that turn with the material: laws that depend on directions, as point functions.

The elastic part of the gradient, F_e = R_e U_e, turns the axes by R_e; in them a law answers to ½ ln C_e = R_eᵀ (½ ln b_e) R_e as
in small strain (Weber and Anand 1990; Eterovic and Bathe 1990). Plastic flow does not turn the axes. Without flow R_e is the
rotation of the polar decomposition of F, whatever increments lead there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from prensa.kernels.functions import sinh_excess, sinh_ratio
from prensa.kernels.record import Node, sqrt


class Tensor:
    """A symmetric tensor of the plane: components xx, yy, zz, xy, which are recorded numbers or arrays."""

    __slots__ = ("xx", "xy", "yy", "zz")
    __array_ufunc__ = None  # arrays leave products to the tensor

    def __init__(self, xx: Node, yy: Node, zz: Node, xy: Node) -> None:
        self.xx, self.yy, self.zz, self.xy = xx, yy, zz, xy

    @classmethod
    def spherical(cls, x: Node) -> Tensor:
        """X times the unit tensor."""
        return cls(x, x, x, 0.0 * x)

    def __iter__(self) -> Iterator[Node]:
        return iter((self.xx, self.yy, self.zz, self.xy))

    def __add__(self, other: Tensor) -> Tensor:
        return Tensor(*(a + b for a, b in zip(self, other)))

    def __sub__(self, other: Tensor) -> Tensor:
        return Tensor(*(a - b for a, b in zip(self, other)))

    def __mul__(self, by: Node | float) -> Tensor:
        return Tensor(*(a * by for a in self))

    __rmul__ = __mul__

    def __neg__(self) -> Tensor:
        return Tensor(*(-a for a in self))

    def dot(self, other: Tensor) -> Node:
        """Double contraction self : other."""
        return self.xx * other.xx + self.yy * other.yy + self.zz * other.zz + 2.0 * self.xy * other.xy

    @property
    def trace(self) -> Node:
        """Sum of the normal components."""
        return self.xx + self.yy + self.zz

    @property
    def deviator(self) -> Tensor:
        """The part without trace."""
        third = self.trace / 3.0
        return Tensor(self.xx - third, self.yy - third, self.zz - third, self.xy)

    def in_axes(self, cos: Node, sin: Node) -> Tensor:
        """Components along axes at an angle to x."""
        cc, ss, cs = cos * cos, sin * sin, cos * sin
        twice = 2.0 * cs * self.xy
        return Tensor(
            cc * self.xx + ss * self.yy + twice, ss * self.xx + cc * self.yy - twice, self.zz,
            cs * (self.yy - self.xx) + (cc - ss) * self.xy,
        )  # fmt: skip

    def from_axes(self, cos: Node, sin: Node) -> Tensor:
        """Components along x and y of a tensor whose components are along axes at an angle to them."""
        return self.in_axes(cos, -sin)


def turned_axes(h: Sequence[Node], b: Sequence[Node], cos: Node, sin: Node) -> tuple[Node, Node]:
    """Cosine and sine of axes after an increment of gradient h (11, 12, 21, 22) from b_e − I (11, 22, 33, 12)."""
    b11, b22, _, b12 = b
    # The logarithm of the whole F with an additive plastic strain (Miehe, Apel and Lambrecht 2002) needs no axes that turn, but
    # with equal coefficients it is J2's answer only where strains keep their axes.
    # V is parallel to b + det V I in the plane
    J = sqrt((1.0 + b11) * (1.0 + b22) - b12 * b12)
    v11, v22 = 1.0 + b11 + J, 1.0 + b22 + J
    # The polar rotation of M = f V has a cosine proportional to M₁₁ + M₂₂ and a sine to M₂₁ − M₁₂.
    c = (1.0 + h[0]) * v11 + h[1] * b12 + h[2] * b12 + (1.0 + h[3]) * v22
    s = h[2] * v11 + (1.0 + h[3]) * b12 - (1.0 + h[0]) * b12 - h[1] * v22
    x, y = cos * c - sin * s, sin * c + cos * s
    # Of length one again in each increment, or round-off would add up over thousands of them.
    over = 1.0 / sqrt(x * x + y * y)
    return x * over, y * over


def kirchhoff(stress: Tensor, strain: Tensor) -> Tensor:
    """The stress R_eᵀ τ R_e of the power of a stress that is conjugate to a logarithmic strain ½ ln C_e, both in the same axes.

    Along the principal axes of the strain the shear is less by δ/sinh δ, δ the difference of the principal strains (Hoger 1987);
    of isotropic laws, which have none there, both are the same.
    """
    d, w = 0.5 * (strain.xx - strain.yy), strain.xy
    t, s = 0.5 * (stress.xx - stress.yy), stress.xy
    square = d * d + w * w
    x = 4.0 * square
    less, along = -4.0 * sinh_excess(x) / sinh_ratio(x), t * d + s * w
    normal, shear = less * (square * t - along * d), less * (square * s - along * w)
    return Tensor(stress.xx + normal, stress.yy - normal, stress.zz, stress.xy + shear)
