"""Kinematics of finite strain for point functions, in the plane and in space: tensors less one, in the order of histories."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from prensa.kernels import algebra, tensor_functions
from prensa.kernels.record import Node
from prensa.layout import PLANE, SPATIAL, TensorLayout
from prensa.materials import hencky_j2

Components = Sequence[Node]


class Motion(NamedTuple):
    """Functions of gradients h = f − I, symmetric tensors b − I, logarithmic strains e, and stresses."""

    push_forward: Callable[[Components, Components], tuple[Node, ...]]
    """(h, b − I) → f b fᵀ − I."""
    logarithm: Callable[[Components], tuple[Node, ...]]
    """b − I → ½ ln b."""
    exponential: Callable[[Components], tuple[Node, ...]]
    """e → exp 2e − I."""
    determinant: Callable[[Components], Node]
    """b − I → det b."""
    first_piola: Callable[[Components, Components, Node], tuple[Node, ...]]
    """(h, τ, by) → by τ f⁻ᵀ; by: one over the volume that the Kirchhoff stress is of."""


def _push_forward(h: Components, b: Components) -> tuple[Node, ...]:
    return algebra.kept(algebra.push_forward(h, algebra.symmetric(b)), b)


def _determinant(b: Components) -> Node:
    return 1.0 + algebra.det_less_one(algebra.symmetric(b))


def _first_piola(h: Components, stress: Components, by: Node) -> tuple[Node, ...]:
    f = algebra.plus(h, algebra.UNIT)  # type: ignore[arg-type]
    c = algebra.cofactors(f)
    inverse = algebra.times(by / (f[0] * c[0] + f[1] * c[3] + f[2] * c[6]), c)
    return tuple(algebra.by_transposed(algebra.symmetric(stress), inverse))


PLANE_MOTION = Motion(
    hencky_j2.push_forward, hencky_j2.logarithm, hencky_j2.exponential, hencky_j2.determinant, hencky_j2.first_piola
)
SPACE_MOTION = Motion(_push_forward, tensor_functions.logarithm, tensor_functions.exponential, _determinant, _first_piola)
MOTION_OF: dict[TensorLayout, Motion] = {PLANE: PLANE_MOTION, SPATIAL: SPACE_MOTION}


def admissible(h: Components, b: Components) -> Node:
    """Whether a gradient has a positive determinant and b is positive definite."""
    H, full = algebra.tensor(h), algebra.symmetric(b)
    good = (algebra.det_less_one(H) > -1.0) & (algebra.det_less_one(full) > -1.0)
    good &= (full[0] > -1.0) & ((1.0 + full[0]) * (1.0 + full[4]) - full[1] * full[1] > 0.0)
    return good if len(h) == 9 else good & (h[4] > -1.0)
