"""Failures as values: reasons why a residual could not be evaluated or an attempt at an increment failed.

Who asks for the reason looks at the type; `sentence` says it in words, here and nowhere else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from prensa.elements.element import Why
from prensa.errors import coordinates


class Placed(Protocol):
    """What has a place: (x, y), in space with ``z``, which is not a number in the plane."""

    @property
    def x(self) -> float:
        """Coordinate along x."""

    @property
    def y(self) -> float:
        """Coordinate along y."""

    @property
    def z(self) -> float:
        """Coordinate along z."""


def spot(at: Placed) -> str:
    """A place in words."""
    return coordinates(v for v in (at.x, at.y, at.z) if not math.isnan(v))


@dataclass(frozen=True)
class ElementFailed:
    """An element that could not be evaluated; ``x``, ``y``, ``z``: its centre in the initial configuration."""

    element: int
    body: str
    x: float
    y: float
    why: Why
    z: float = math.nan

    def __str__(self) -> str:
        return f"element {self.element} of {self.body} (initially near {spot(self)}) {self.why.value}"


@dataclass(frozen=True)
class FrictionTooSoft:
    """Friction that falls faster with slip than the tangential penalty of its contact can follow."""

    contact: str

    def __str__(self) -> str:
        return f"friction of {self.contact} softens too fast for its stiffness k_T, or its bound jumps"


NotEvaluated = ElementFailed | FrictionTooSoft


class Fold(NamedTuple):
    """Two sides ('body.boundary') of an outline that have passed through each other, about (x, y).

    ``depth``: that of their overlap on average (see `prensa.mesh.overlap`).
    """

    first: str
    second: str
    x: float
    y: float
    depth: float

    def __str__(self) -> str:
        other = "itself" if self.first == self.second else f"side {self.second!r}"
        return (
            f"side {self.first!r} crosses {other} near ({self.x:.4g}, {self.y:.4g}): the body has folded onto itself and "
            "passes through itself"
        )


class Hang(NamedTuple):
    """An edge of ``side`` between two contact nodes, from (x, y) on, that hangs on a corner of ``tool``.

    ``depth``: how much deeper its middle lies in the tool than its ends; ``stretch``: its length over that at first.
    """

    side: str
    tool: str
    x: float
    y: float
    depth: float
    stretch: float

    def __str__(self) -> str:
        return (
            f"an edge of {self.side!r} near ({self.x:.4g}, {self.y:.4g}) is {self.stretch:.2g} times as long as at first and "
            f"passes {self.depth:.2g} deep through tool {self.tool!r}: the node at its end is caught on a corner of the tool "
            "instead of sliding round it"
        )


class Past(NamedTuple):
    """A ``side`` ('body.boundary') of an element that has slid past a straight ``support`` of its body, by ``depth`` at most.

    ``share``: that over the shortest side of the element at first.
    """

    side: str
    support: str
    depth: float
    share: float


class Inside(NamedTuple):
    """A node (its number in the body, and its place) that lies by ``depth`` inside a tool; ``side``: 'body.boundary'.

    ``other``: the second node of an edge that lies inside between its nodes; -1 of a node. ``through``: what to do where
    the side is a line of symmetry or the axis and the tool has contacts with the body, so that it came through another side.
    """

    tool: str
    node: int
    body: str
    side: str
    x: float
    y: float
    depth: float
    other: int = -1
    through: str = ""
    z: float = math.nan

    def __str__(self) -> str:
        what = f"node {self.node}" if self.other < 0 else f"the edge between nodes {self.node} and {self.other}"
        return (
            f"{what} of {self.side!r} at ({spot(self)}) lies {self.depth:.3g} inside tool "
            f"{self.tool!r}, which "
            + ("has penetrated the adjacent surface" if self.through else "no contact of that side is against")
        )

    @property
    def remedy(self) -> str:
        """What to write."""
        if self.through:
            return self.through
        whole = f" (or 'surface: {self.body}', the whole outline)" if math.isnan(self.z) else ""  # in space sides are named
        return f"add '{{surface: {self.side}, against: {self.tool}}}' to 'contacts'{whole}, or to 'no_contact' if it is meant"


@dataclass(frozen=True)
class Unevaluable:
    """The residual could not be evaluated; ``cause``: what the system says of it."""

    cause: NotEvaluated | str


@dataclass(frozen=True)
class Diverged:
    """The residual is not a number."""


@dataclass(frozen=True)
class Stagnated:
    """The iteration goes round in a circle: no part of a step lowers the residual, over the forces, twice in one active set."""

    residual: float


@dataclass(frozen=True)
class NotConverged:
    """All iterations are used up at a relative residual."""

    iterations: int
    residual: float


@dataclass(frozen=True)
class Unsettled:
    """Multipliers of augmented contacts that still change after all updates."""

    updates: int


@dataclass(frozen=True)
class Blocked:
    """Exact enforcement: the tool of a contact is driven into a point (x, y), in space (x, y, z), that a support holds."""

    contact: str
    x: float
    y: float
    z: float | None = None


@dataclass(frozen=True)
class Singular:
    """The stiffness matrix is singular; ``detail`` from the linear solver."""

    detail: str


@dataclass(frozen=True)
class ToolRunaway:
    """A tool that nothing resists, along ``axis``."""

    tool: str
    axis: str


@dataclass(frozen=True)
class Runaway:
    """A displacement far beyond the size of the bodies."""


@dataclass(frozen=True)
class LostSupport:
    """A body whose last contact opened in the increment though nothing else holds it."""

    body: str


@dataclass(frozen=True)
class UnilaterallySupported:
    """A body that nothing but its contact with a single tool holds."""

    body: str
    tool: str


@dataclass(frozen=True)
class TipsOver:
    """A tool that is free to turn, whose ``force`` acts through ``at`` beside what it could rest on, ``first`` to ``last``."""

    tool: str
    at: tuple[float, float]
    force: tuple[float, float]
    first: tuple[float, float]
    last: tuple[float, float]


@dataclass(frozen=True)
class Tunnelled:
    """A contact node (its number in the body; its place at the start) on the far side of a tool after one increment."""

    tool: str
    node: int
    body: str
    x: float
    y: float
    z: float = math.nan


@dataclass(frozen=True)
class TurnedThrough:
    """A tool that turned by an ``angle`` (rad) in one increment, on the way of which it would have been in the ``body``."""

    tool: str
    body: str
    angle: float


@dataclass(frozen=True)
class BeyondSmall:
    """Small-strain kinematics where a body is strained or turned (rad) too far for it: by a share of its volume, and at most."""

    body: str
    strain: float
    rotation: float
    most_strain: float
    most_rotation: float


@dataclass(frozen=True)
class CornerInverted:
    """An element (its initial centre) a corner of which jumped beyond 180°, of a brick to a negative Jacobian."""

    element: int
    body: str
    x: float
    y: float
    z: float = math.nan


@dataclass(frozen=True)
class Collapsed:
    """An element (its initial centre) that flowed by too large a ``strain`` in one increment."""

    element: int
    body: str
    x: float
    y: float
    strain: float
    z: float = math.nan


@dataclass(frozen=True)
class MetalInside:
    """A node that is in no contact with a tool lies inside it: no smaller increment would help."""

    node: Inside


@dataclass(frozen=True)
class StartsInside:
    """A tool that starts inside a surface by ``depth``, so many ``elements``, and could not be pressed out of it."""

    tool: str
    surface: str
    depth: float
    elements: float


@dataclass(frozen=True)
class Folded:
    """A side that has passed through another side of its body: no contact is there, and no smaller increment would help.

    ``hang``: an edge of that body that hung on a tool then, which may be why.
    """

    fold: Fold
    hang: Hang | None = None


@dataclass(frozen=True)
class Distorted:
    """An element (its centre now) on which attempts fail again and again; ``shape``: its scaled Jacobian.

    ``attempts``: how many failed, ``sides`` that it lies at, ``contacts`` that it is part of; ``past``: a side of it that has
    slid past a support, and that support.
    """

    element: int
    body: str
    x: float
    y: float
    shape: float
    attempts: int
    sides: tuple[str, ...]
    contacts: tuple[str, ...]
    past: Past | None = None
    z: float = math.nan


@dataclass(frozen=True)
class PastSupport:
    """An element (x, y: its centre now) folded over for so many ``increments``: a side of it lies past a support."""

    element: int
    body: str
    x: float
    y: float
    past: Past
    increments: int


@dataclass(frozen=True)
class Unstable:
    """An equilibrium that the bodies would leave by themselves; ``negative``: modes in which they would."""

    negative: int


@dataclass(frozen=True)
class Jumped:
    """An increment that leads past unstable states to a far equilibrium."""


@dataclass(frozen=True)
class LimitPoint:
    """The path of equilibria ends: tries beyond are unstable, however short the increment; ``cause``: how the last ended.

    ``eigenvalue``: that of the tangent that is negative there; None of a jump, whose ends are both stable. ``across``: only on
    one of the active sets of contact that meet there, and condensed onto the unknowns in which they differ.
    """

    cause: Unstable | Jumped | Stagnated | NotConverged | Diverged | Singular
    eigenvalue: float | None = None
    across: bool = False


@dataclass(frozen=True)
class NotReached:
    """What was to end a step has not come, or was there before it began; ``words`` say which."""

    words: str


FreeToMove = Singular | ToolRunaway | Runaway | LostSupport | UnilaterallySupported | TipsOver
"""Some body or tool has nothing to hold it."""

Failure = (
    Unevaluable | Diverged | Stagnated | NotConverged | Unsettled | Blocked | Tunnelled | TurnedThrough | CornerInverted
    | Collapsed | BeyondSmall | MetalInside | Folded | Distorted | PastSupport | StartsInside | Unstable | Jumped | LimitPoint
    | NotReached | FreeToMove
)  # fmt: skip


def sentence(failure: Failure) -> str:
    """A failure in words."""
    match failure:
        case Unevaluable(cause):
            return str(cause)
        case Diverged():
            return "the iteration diverged"
        case Stagnated(residual):
            return f"the residual stagnates at {residual:.1e} of the forces"
        case NotConverged(iterations, residual):
            return f"no convergence in {iterations} iterations (relative residual {residual:.1e})"
        case Unsettled(updates):
            return f"the multipliers did not settle in {updates} updates; a larger beta converges faster"
        case Blocked(contact, x, y, z):
            place = ", ".join(f"{a:.4g}" for a in (x, y, z) if a is not None)
            return (
                f"the tool of {contact} is driven into the point at ({place}), which a support holds: exact "
                "enforcement has no compliance; release that point, leave it out of the contact surface, or use 'penalty'"
            )
        case Tunnelled(tool, node, body):
            return f"tool {tool!r} passed through node {node} of {body!r} at ({spot(failure)}) in one increment"
        case TurnedThrough(tool, body, angle):
            return f"tool {tool!r} turned by {in_degrees(angle)} in one increment, right through {body!r}"
        case BeyondSmall():
            return (
                f"a twentieth of body {failure.body!r} is strained by more than {failure.strain:.2g} (most "
                f"{failure.most_strain:.2g}) and rotated by more than {in_degrees(failure.rotation)} (most "
                f"{in_degrees(failure.most_rotation)}), where 'kinematics: small' no longer holds"
            )
        case CornerInverted():
            return f"{place_of(failure)} folded over"
        case Unstable(negative):
            ways = "one mode" if negative == 1 else f"{negative} modes"
            return f"the equilibrium found is unstable (in {ways}): the bodies would not stay in it"
        case Jumped():
            return "the bodies jump within the increment, past unstable states"
        case LimitPoint():
            return _limit_point(failure)
        case Collapsed():
            return f"{place_of(failure)} had a plastic strain of {failure.strain:.2g} in one increment: it collapses"
        case MetalInside(node):
            return str(node)
        case StartsInside(tool, surface, depth, elements):
            return (
                f"tool {tool!r} starts {depth:.3g} inside {surface!r}, {elements:.2g} of an element, and the body could not be "
                "pressed out of it"
            )
        case Folded(fold, hang):
            return f"{fold}; {hang}" if hang else str(fold)
        case NotReached(words):
            return words
        case Distorted():
            return _distorted(failure)
        case PastSupport():
            return _past(failure)
        case _:
            return _free(failure)


def _limit_point(failure: LimitPoint) -> str:
    seen = "an iterate beyond it has a singular stiffness" if isinstance(failure.cause, Singular) else sentence(failure.cause)
    sets = " where a contact point slips or opens, and none where it does not" if failure.across else ""
    sign = "" if failure.eigenvalue is None else f"the tangent has a negative eigenvalue, {failure.eigenvalue:.3g}{sets}; "
    return f"limit point: beyond it there is no equilibrium nearby and the bodies jump ({sign}{seen})"


def _distorted(failure: Distorted) -> str:
    at = f" at {' and '.join(map(repr, failure.sides))}" if failure.sides else ""
    past = f"; side {failure.past.side!r} has slid past the support {failure.past.support!r}" if failure.past else ""
    contact = f", in contact {' and '.join(failure.contacts)}" if failure.contacts else ", which is in no contact"
    return (
        f"element {failure.element} of {failure.body}, now near ({spot(failure)}){at}{contact * bool(at)}, is "
        f"too distorted: {failure.attempts} attempts failed there, and its scaled Jacobian is {failure.shape:.2g} (1 is a "
        f"rectangle, 0 a corner of 180°){past}"
    )


def _past(failure: PastSupport) -> str:
    past = failure.past
    return (
        f"element {failure.element} of {failure.body}, now near ({failure.x:.4g}, {failure.y:.4g}), has been folded over for "
        f"{failure.increments} increments: side {past.side!r} lies {past.depth:.3g} past the support {past.support!r}, where "
        "there is no contact; from there on the body has more room than it should, and forces are wrong"
    )


def _free(failure: FreeToMove) -> str:
    match failure:
        case Singular(detail):
            return (
                f"the stiffness matrix is singular ({detail}): some body or tool is free to move without resistance; "
                "support it, or hold it until contact does"
            )
        case ToolRunaway(tool, axis):
            way = "turn" if axis.startswith("r") else f"move along {axis}"
            return (
                f"tool {tool!r} is free to move without resistance (to {way}): less force or moment, or hold it until "
                "contact does"
            )
        case Runaway():
            return (
                "a displacement a thousand times the size of the bodies: some body or tool is free to move without "
                "resistance; support it, or hold it until contact does"
            )
        case LostSupport(body):
            return f"body {body!r} is free to move, since its last contact has opened; support it"
        case UnilaterallySupported(body, tool):
            return f"body {body!r} is free to move: only its contact with tool {tool!r} holds it"
        case TipsOver(tool, (x, y), (fx, fy), (a, b), (c, d)):
            return (
                f"tool {tool!r} tips over: it is free to turn, its force ({fx:.4g}, {fy:.4g}) acts along a line through "
                f"({x:.4g}, {y:.4g}), and what it can rest on reaches from ({a:.4g}, {b:.4g}) to ({c:.4g}, {d:.4g})"
            )


def in_degrees(angle: float) -> str:
    """An angle (rad) in words."""
    return f"{round(math.degrees(angle), 1):g}°"


def place_of(failure: CornerInverted | Collapsed) -> str:
    """The element of a failure in words."""
    return f"element {failure.element} of {failure.body} (initially near {spot(failure)})"
