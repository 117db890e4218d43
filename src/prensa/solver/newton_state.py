"""State of Newton's iteration: the iterate, what has changed in contact, and what is remembered of the way there."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from prensa.solver.equilibrium import Signature, reversed_slip
from prensa.system.system import Evaluation
from prensa.types import Array, Flags


@dataclass(frozen=True)
class Best:
    """The iterate with the least residual ``norm`` so far: dofs u (ndof,), Newton's step from there, its contacts ``e``.

    The line search goes back to it, and not to the iterate at hand: the first step may raise the residual, and so may steps that
    are accepted for the one that follows.
    """

    norm: float
    u: Array
    step: Array
    e: Evaluation


@dataclass
class Iterate:
    """Dofs u (ndof,) and what is known there: the ``evaluation``, the only holder of its matrix; None before it is made.

    ``norm`` of the residual, and ``scale`` that it is compared with. ``secant``: whether the matrix is the one for iterates where
    flow turns (see `Equilibrium.flow_direction_unreliable`); ``assumed`` (points,): as of `Guess`.
    """

    u: Array
    evaluation: Evaluation | None = None
    secant: bool = False
    assumed: Flags | None = None
    norm: float = np.inf
    scale: float = 0.0

    @property
    def relative(self) -> float:
        """Residual over what it is compared with."""
        return self.norm / self.scale if self.scale > 0 else 0.0


@dataclass(frozen=True)
class ContactChange:
    """Contact ``now`` and at the iterate ``before`` (None at the first); ``closed`` (points,): when the increment began."""

    now: Signature
    before: Signature | None
    closed: Flags

    @cached_property
    def reversed(self) -> Flags:
        """Points (points,) that slip against their last direction."""
        return reversed_slip(self.before, self.now)

    @cached_property
    def settled(self) -> bool:
        """Whether no point has opened or closed."""
        return not self._flipped.any()

    @cached_property
    def changed(self) -> int:
        """How many points have another status than at the last iterate; at the first: have opened or closed."""
        return int(np.count_nonzero(self._flipped if self.before is None else self.now != self.before))

    @cached_property
    def _flipped(self) -> Flags:
        was = self.closed if self.before is None else self.before > 0
        # tools that are taken away leave no points
        return np.asarray((self.now > 0) != was) if len(self.now) == len(was) else was


@dataclass
class NewtonState:
    """Where an iteration stands: the ``iterate``, multipliers lam (points, 1 + t), and what is remembered of the way there.

    ``contact``: how it has changed, None before that is known; ``best``: the iterate to which the line search goes back;
    ``least``: least residual up to each iteration; ``stuck``: signatures of contact where no part of a step lowered it.
    ``by_contact``: contact steps are taken from here on. ``flows``: metal still flowed in the first guess, with contact decided.
    """

    iterate: Iterate
    lam: Array
    contact: ContactChange | None = None
    iteration: int = 0
    best: Best | None = None
    least: list[float] = field(default_factory=list)
    stuck: set[bytes] = field(default_factory=set)
    by_contact: bool = False
    flows: bool = False

    @property
    def changed(self) -> int:
        """Contact points with another status than at the last iterate."""
        return 0 if self.contact is None else self.contact.changed

    @property
    def reversed(self) -> Flags | None:
        """Contact points (points,) that slip against their last direction; None if none do."""
        return self.contact.reversed if self.contact is not None and self.contact.reversed.any() else None

    @property
    def promised(self) -> float:
        """Residual over the present one that quadratic convergence promises after a step: the square of the last such ratio.

        A linear system need not be solved to more digits than that (choice 2 of Eisenstat & Walker 1996); 0 before a step.
        """
        return (self.least[-1] / self.least[-2]) ** 2 if len(self.least) > 1 and self.least[-2] > 0 else 0.0
