"""Tensors in axes that turn with the material: laws that depend on directions, as point functions.

The elastic part of the gradient, F_e = R_e U_e, turns the axes by R_e; in them a law answers to ½ ln C_e = R_eᵀ (½ ln b_e) R_e as
in small strain (Weber and Anand 1990; Eterovic and Bathe 1990). Plastic flow does not turn the axes. Without flow R_e is the
rotation of the polar decomposition of F, whatever increments lead there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from prensa.errors import ArgumentError
from prensa.kernels.algebra import SPACE_AXES, UNIT, by_transposed, kept, plus, product, symmetric, times, total
from prensa.kernels.functions import sinh_excess, sinh_ratio
from prensa.kernels.record import Node, sqrt
from prensa.kernels.tensor_functions import conjugate, exponential, logarithm


class Tensor:
    """A symmetric tensor: components xx, yy, zz, xy, and in space xz, yz, which are recorded numbers or arrays."""

    __slots__ = ("components",)
    __array_ufunc__ = None  # arrays leave products to the tensor

    def __init__(self, xx: Node, yy: Node, zz: Node, xy: Node, *others: Node) -> None:
        if len(others) not in (0, 2):
            raise ArgumentError(f"Tensor: it has four components in the plane and six in space, not {4 + len(others)}")
        self.components = (xx, yy, zz, xy, *others)

    @classmethod
    def spherical(cls, x: Node) -> Tensor:
        """X times the unit tensor; where it meets others, of the plane and of space."""
        return _Spherical(x)

    @property
    def xx(self) -> Node:
        """Normal component along the first axis."""
        return self.components[0]

    @property
    def yy(self) -> Node:
        """Along the second."""
        return self.components[1]

    @property
    def zz(self) -> Node:
        """Along the third."""
        return self.components[2]

    @property
    def xy(self) -> Node:
        """Shear of the first and second axes."""
        return self.components[3]

    @property
    def xz(self) -> Node:
        """Shear of the first and third axes, zero in the plane."""
        return self.components[4] if self.shears == 3 else 0.0 * self.xy

    @property
    def yz(self) -> Node:
        """Shear of the second and third axes, zero in the plane."""
        return self.components[5] if self.shears == 3 else 0.0 * self.xy

    @property
    def shears(self) -> int:
        """How many shears it has: one in the plane, three in space."""
        return len(self.components) - 3

    def __iter__(self) -> Iterator[Node]:
        return iter(self.components)

    def __len__(self) -> int:
        return len(self.components)

    def __add__(self, other: Tensor) -> Tensor:
        return Tensor(*(a + b for a, b in _pairs(self, other)))

    def __sub__(self, other: Tensor) -> Tensor:
        return Tensor(*(a - b for a, b in _pairs(self, other)))

    def __mul__(self, by: Node | float) -> Tensor:
        return Tensor(*(a * by for a in self))

    __rmul__ = __mul__

    def __neg__(self) -> Tensor:
        return Tensor(*(-a for a in self))

    def dot(self, other: Tensor) -> Node:
        """Double contraction self : other."""
        products = [a * b for a, b in _pairs(self, other)]
        out = products[0] + products[1] + products[2]
        for x in products[3:]:
            out = out + 2.0 * x
        return out

    @property
    def trace(self) -> Node:
        """Sum of the normal components."""
        return self.xx + self.yy + self.zz

    @property
    def deviator(self) -> Tensor:
        """The part without trace."""
        third = self.trace / 3.0
        return Tensor(self.xx - third, self.yy - third, self.zz - third, *self.components[3:])


class _Spherical(Tensor):
    """A multiple of the unit tensor, of the plane and of space."""

    __slots__ = ()

    def __init__(self, x: Node) -> None:
        super().__init__(x, x, x, 0.0 * x)

    def __mul__(self, by: Node | float) -> Tensor:
        return _Spherical(self.xx * by)

    __rmul__ = __mul__

    def __neg__(self) -> Tensor:
        return _Spherical(-self.xx)


def _pairs(a: Tensor, b: Tensor) -> Iterator[tuple[Node, Node]]:
    """Components of two tensors side by side.

    Raises
    ------
    ArgumentError
        Of tensors of the plane and of space.

    """
    if len(a) == len(b):
        return zip(a, b)
    if not isinstance(a if len(a) < len(b) else b, _Spherical):
        raise ArgumentError(
            "a Tensor of four components, of the plane, meets one of six, of space: make tensors from others ('strain.deviator', "
            "'Tensor.spherical(x)'), or of all six, xx, yy, zz, xy, xz, yz; a material for the plane alone says in_space = False"
        )
    none = (0.0 * a.xx,) * 2
    return zip((*a, *none) if len(a) < len(b) else a, (*b, *none) if len(b) < len(a) else b)


def in_axes(t: Tensor, axes: Sequence[Node]) -> Tensor:
    """Components along axes: cosine and sine of their angle to x, or in space their first two directions (6)."""
    if len(axes) == 2:
        cos, sin = axes
        cc, ss, cs = cos * cos, sin * sin, cos * sin
        twice = 2.0 * cs * t.xy
        return Tensor(
            cc * t.xx + ss * t.yy + twice, ss * t.xx + cc * t.yy - twice, t.zz, cs * (t.yy - t.xx) + (cc - ss) * t.xy
        )
    Q, full = _rotation(axes), symmetric(tuple(t))
    return Tensor(*kept(by_transposed(product(Q, full), Q), tuple(t)))


def from_axes(t: Tensor, axes: Sequence[Node]) -> Tensor:
    """Components along x, y and z of a tensor whose components are along axes, see `in_axes`."""
    if len(axes) == 2:
        return in_axes(t, (axes[0], -axes[1]))
    Q = _rotation(axes)
    transposed = tuple(Q[3 * j + i] for i in SPACE_AXES for j in SPACE_AXES)
    return Tensor(*kept(by_transposed(product(transposed, symmetric(tuple(t))), transposed), tuple(t)))


def _rotation(axes: Sequence[Node]) -> tuple[Node, ...]:
    """Rows (9) of three axes, of which the first two are given."""
    a, b, c, d, e, f = axes
    return a, b, c, d, e, f, b * f - c * e, c * d - a * f, a * e - b * d


def turned_axes(h: Sequence[Node], b: Sequence[Node], strain: Tensor, axes: Sequence[Node]) -> tuple[Node, ...]:
    """Axes after an increment of gradient h from b_e − I; ``strain``: ½ ln b of its end if nothing flows."""
    # The logarithm of the whole F with an additive plastic strain (Miehe, Apel and Lambrecht 2002) needs no axes that turn, but
    # with equal coefficients it is J2's answer only where strains keep their axes.
    if len(axes) == 2:
        return _turned_in_plane(h, b, *axes)
    # f V_n = V R, with V_n = √b_n and V = √(f b_n fᵀ)
    f = tuple(x + one for x, one in zip(h, UNIT))
    before = plus(symmetric(exponential([0.5 * x for x in logarithm(b)])), UNIT)  # type: ignore[arg-type]
    after = plus(symmetric(exponential([-0.5 * x for x in strain])), UNIT)  # type: ignore[arg-type]
    R = product(after, product(f, before))
    x, y = (tuple(total(R[3 * i + j] * v[j] for j in SPACE_AXES) for i in SPACE_AXES) for v in (axes[:3], axes[3:]))
    # At right angles and of length one again in each increment, or round-off would add up over thousands of them.
    first = times(1.0 / sqrt(_scalar(x, x)), x)
    second = plus(y, times(-_scalar(first, y), first))
    return *first, *times(1.0 / sqrt(_scalar(second, second)), second)


def _scalar(a: Sequence[Node], b: Sequence[Node]) -> Node:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _turned_in_plane(h: Sequence[Node], b: Sequence[Node], cos: Node, sin: Node) -> tuple[Node, Node]:
    """Cosine and sine of axes after an increment of gradient h (11, 12, 21, 22) from b_e − I (11, 22, 33, 12)."""
    b11, b22, _, b12 = b
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
    if stress.shears == 3:
        return Tensor(*conjugate(tuple(stress), tuple(strain)))
    d, w = 0.5 * (strain.xx - strain.yy), strain.xy
    t, s = 0.5 * (stress.xx - stress.yy), stress.xy
    square = d * d + w * w
    x = 4.0 * square
    less, along = -4.0 * sinh_excess(x) / sinh_ratio(x), t * d + s * w
    normal, shear = less * (square * t - along * d), less * (square * s - along * w)
    return Tensor(stress.xx + normal, stress.yy - normal, stress.zz, stress.xy + shear)
