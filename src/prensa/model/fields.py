"""Fields of descriptions: frozen, strictly checked dataclasses, and values that may change over time.

Laws of other packages describe themselves with these, so nothing of the vocabulary is imported here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, fields
from functools import wraps
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, dataclass_transform

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Discriminator, Field, Tag, ValidationError
from pydantic.dataclasses import dataclass

from prensa.errors import CaseError, Mark, Mistake
from prensa.model.units import Angle, BodyForce, Displacement, Force, Length, Moment, Number, Pressure, SpringStiffness

_FROZEN = ConfigDict(extra="forbid", arbitrary_types_allowed=False, allow_inf_nan=False)
_T = TypeVar("_T")
LARGEST = 1e100
"""Number in a table beyond which its interpolation overflows."""
Words: TypeAlias = Callable[[type, ValidationError, tuple[Any, ...], dict[str, Any]], CaseError]


def _plain_words(cls: type, error: ValidationError, arguments: tuple[Any, ...], named: dict[str, Any]) -> CaseError:
    found = error.errors(include_url=False)
    return CaseError(
        Mistake(Mark(""), f"{'.'.join(map(str, e['loc'])) or 'the arguments'} of {cls.__name__}: {e['msg']}")
        for e in found
    )


_words: list[Words] = [_plain_words]


def explain_with(words: Words) -> None:
    """Let *words* say what is wrong with arguments: good ones need the vocabulary, which is made of these classes."""
    _words.append(words)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def described(cls: type[_T]) -> type[_T]:
    """Make *cls* a frozen, strictly checked dataclass; wrong arguments are a `CaseError` in the words of a case file.

    One with a class variable ``stated`` gets it on its instances: the names of the fields that were given.
    """
    made: Any = dataclass(frozen=True, config=_FROZEN)(cls)
    check = made.__init__

    @wraps(check)
    def __init__(self: Any, *arguments: Any, **named: Any) -> None:
        try:
            check(self, *arguments, **named)
        except ValidationError as error:
            raise _words[-1](made, error, arguments, named) from None
        # Some checks depend on whether a default was chosen or left: that is known only here, where the arguments are.
        if hasattr(made, "stated"):
            names = [f.name for f in fields(made) if f.init]
            object.__setattr__(self, "stated", frozenset([*names[: len(arguments)], *named]))

    made.__init__ = __init__
    return made


def as_names(value: Any) -> Any:
    """Accept one name for a list of one."""
    return (value,) if isinstance(value, str) else tuple(value) if isinstance(value, list) else value


# -------------------------------------------------------------------------------------------------- vectors and places
def _space_of(value: Any) -> str:
    # A plain union would report the mistakes of both alternatives; a tag chooses one, and with it one message.
    return "solid" if isinstance(value, list | tuple) and len(value) == 3 else "plane"


def vector_of(number: Any) -> Any:
    """Type of two components in the plane, three in space."""
    return Annotated[
        Annotated[tuple[number, number], Tag("plane")] | Annotated[tuple[number, number, number], Tag("solid")],
        Discriminator(_space_of),
    ]


if TYPE_CHECKING:
    Position: TypeAlias = tuple[float, float] | tuple[float, float, float]
    Direction: TypeAlias = Position
else:
    Position = vector_of(Length)
    Direction = vector_of(Number)


def _as_axis(value: Any) -> Any:
    """Accept the name of an axis for the unit vector along it."""
    named = isinstance(value, str) and value in ("x", "y", "z")
    return tuple(float(value == name) for name in "xyz") if named else value


Axis: TypeAlias = Annotated[
    tuple[Number, Number, Number], BeforeValidator(_as_axis), Field(description="'x', 'y', 'z' or a list of 3 numbers")
]
"""Axis in space: x, y or z, or a vector along it."""
Turn: TypeAlias = tuple[Angle, Angle, Angle]
"""Rotation in space: a vector along the axis, as long as the angle about it; of one component, the angle about that axis."""


# --------------------------------------------------------------------------------------------- time-dependent values
def as_table(value: Any) -> Any:
    """Accept lists of pairs as tables (YAML has no tuples), and arrays with two columns."""
    # numpy is not imported for this: the vocabulary knows nothing of the numerics.
    if getattr(value, "ndim", 0) == 2 and hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple) and value and all(isinstance(p, list | tuple) for p in value):
        return tuple(tuple(p) for p in value)
    return value


def in_order(table: Any) -> Any:
    """A course over time needs increasing times: it is a function."""
    if any(b[0] <= a[0] for a, b in pairwise(table)):
        raise ValueError("the times of a table must increase strictly")
    return table


def value_kind(value: Any) -> str:
    """Tag of a value over time: a table or a number."""
    return "table" if isinstance(value, list | tuple) else "number"


def _fillet_kind(value: Any) -> str:
    return "each" if isinstance(value, list | tuple) else "one"


_Radius = Annotated[Length, Field(ge=0)]
Fillets = Annotated[
    Annotated[_Radius, Tag("one")] | Annotated[tuple[_Radius, ...], Tag("each")], Discriminator(_fillet_kind)
]
"""One radius for all corners, or one for each."""


def value_of(number: Any) -> Any:
    """Type of a quantity that may be a number (ramped over the step) or a table ((time, value), …) in global time."""
    return Annotated[
        Annotated[number, Tag("number")]
        | Annotated[tuple[tuple[Number, number], ...], Field(min_length=2), AfterValidator(in_order), Tag("table")],
        Discriminator(value_kind),
        BeforeValidator(as_table),
    ]


if TYPE_CHECKING:  # a type checker cannot follow the function
    _Value: TypeAlias = float | tuple[tuple[float, float], ...]
    DisplacementValue: TypeAlias = _Value
    AngleValue: TypeAlias = _Value
    PressureValue: TypeAlias = _Value
    ForceValue: TypeAlias = _Value
    MomentValue: TypeAlias = _Value
    Traction: TypeAlias = tuple[_Value, _Value] | tuple[_Value, _Value, _Value]
    ForceDensity: TypeAlias = Traction
else:
    DisplacementValue = value_of(Displacement)
    AngleValue = value_of(Angle)
    PressureValue = value_of(Pressure)
    ForceValue = value_of(Force)
    MomentValue = value_of(Moment)
    Traction = vector_of(PressureValue)
    ForceDensity = vector_of(value_of(BodyForce))


def motions_in(space: str | None) -> tuple[str, ...]:
    """Motions of a tool as ``move`` and springs name them: displacements, then rotations."""
    return ("x", "y", "z", "rx", "ry", "rz") if space == "solid" else ("x", "y", "rz")


def force_along(space: str | None, motion: str) -> str:
    """Name in ``push`` of the force or moment along a motion."""
    return motion if motion in ("x", "y", "z") else "m" + motion[1] * (space == "solid")


# ---------------------------------------------------------------------------------------------------------- mounting
@described
class Springs:
    """Springs on which a tool is mounted, for each of its motions: ``x``, ``y`` and rotation ``rz`` (moment per rad).

    The tool hangs on a mount; ``move`` and ``velocity`` of such a motion move the mount. In plane problems stiffnesses are
    those of the whole thickness. In space ``z``, ``rx`` and ``ry`` too.
    """

    x: Annotated[SpringStiffness, Field(gt=0)] | None = None
    y: Annotated[SpringStiffness, Field(gt=0)] | None = None
    rz: Annotated[Moment, Field(gt=0)] | None = None
    z: Annotated[SpringStiffness, Field(gt=0)] | None = None
    rx: Annotated[Moment, Field(gt=0)] | None = None
    ry: Annotated[Moment, Field(gt=0)] | None = None
