"""Interactions: everything besides the bodies' own elements that puts forces on degrees of freedom.

Contact, load, tool force and spring are interactions, as heat exchange or contact between bodies would be. Each states which
sets of degrees of freedom it joins and gives vectors and matrices of them; the residual is one loop and one scatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypedDict

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import Branches as Sides

if TYPE_CHECKING:
    from prensa.fem.context import Context
    from prensa.fem.failure import NotEvaluated

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Branches(NamedTuple):
    """On which side of their kinks all points are: the contacts', and which points (m q,) of each block flow plastically.

    ``contacts``: empty where that is for their gaps and tractions to decide.
    """

    contacts: tuple[Sides, ...]
    flows: tuple[Flags | None, ...]


class Overrides(TypedDict, total=False):
    """What an evaluation may be told to assume; see `Request`."""

    stick: Flags | None
    guess: bool
    landed: Flags | None
    foundation: Array | None
    secant: float
    like: Branches | None


class Request(NamedTuple):
    """What an evaluation asks for: degrees of freedom u (ndof,), multipliers lam (points, 1 + t), whether matrices are wanted.

    ``stick`` (points,): contact points that are forced to stick; ``guess``: points that were closed are kept closed and stuck,
    for the first guess of an increment. ``reach``: a length that positions do not exceed, for their round-off. ``landed``
    (points,): contact points that a prediction has put on their tool from inside it. ``foundation`` (points, 2): shares
    of its normal and tangential stiffness with which a contact point resists in the matrix, whatever its state; 0: as it does.
    ``secant``: how far the matrix of the bodies goes from the tangent to the secant of plastic flow (see `At`).
    ``like``: contact points are open or closed and stick or slip, and material points flow or do not, as they do there.
    """

    u: Array
    lam: Array
    stiffness: bool = True
    stick: Flags | None = None
    guess: bool = False
    reach: float = 0.0
    landed: Flags | None = None
    foundation: Array | None = None
    secant: float = 0.0
    like: Branches | None = None


class Part(NamedTuple):
    """Vectors r (k, m) and matrices K (k, m, m) on the sets dofs (k, m) of degrees of freedom; either may be missing.

    ``key``: names the sets, which are the same whenever it is, so that their places in the matrix are looked up once.
    """

    key: str
    dofs: Index
    r: Array | None = None
    K: Array | None = None


@dataclass
class Response:
    """Outcome of an interaction: its parts, and what an evaluation sums up over all.

    ``scale``: Σ |forces|; ``floor``: residual that round-off alone makes; ``violation``: of conditions that must hold to
    round-off, over the length that is small; ``trial``: what may be committed; ``failed``: why it could not be evaluated.
    ``external``: the vectors are forces from outside, which have no part in the residual's scale of inner forces.
    """

    parts: Sequence[Part] = ()
    scale: float = 0.0
    floor: float = 0.0
    violation: float = 0.0
    trial: Any = None
    failed: NotEvaluated | None = None
    external: bool = False


class Interaction(Protocol):
    """Something that puts forces on degrees of freedom. Pure: it answers the same for the same arguments."""

    def couplings(self) -> Sequence[Index]:
        """Sets of degrees of freedom (k, m) that it joins in the matrix; of a load without stiffness none."""

    def respond(self, c: Context, ask: Request) -> Response:
        """Forces, matrices and trial state for the degrees of freedom and the context of an increment."""
