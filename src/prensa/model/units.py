"""Dimensions of the vocabulary's numbers, and unit strings.

A field typed ``Length`` accepts a number in the case's own system, or, in a file, a string such as ``8 cm``. The system
travels as the validation context, so that a description built in Python (no context) takes plain numbers only.

The units of forming are in a table here, in exact fractions: ``70 GPa`` is 70e3 N/mm² to the last bit. Other names are
looked up in pint, which takes a second to start and is therefore asked last.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ValidationInfo
from pydantic_core import PydanticKnownError


@dataclass(frozen=True)
class Dimension:
    """What a number is: its ``name`` with article, exponents of ``force``, ``length`` and ``time``, an ``example`` to show."""

    name: str
    force: int
    length: int
    example: str
    time: int = 0

    @property
    def exponents(self) -> tuple[int, int, int]:
        """Exponents of force, length and time."""
        return self.force, self.length, self.time


LENGTH = Dimension("a length", 0, 1, "8 cm")
PRESSURE = Dimension("a stress", 1, -2, "10 GPa")
STIFFNESS = Dimension("a pressure per length", 1, -3, "1e3 MPa/mm")
BODY_FORCE = Dimension("a force per volume", 1, -3, "77 kN/m^3")
FORCE = Dimension("a force", 1, 0, "2 kN")
SPRING = Dimension("a force per length", 1, -1, "2 kN/mm")
MOMENT = Dimension("a moment", 1, 1, "3 kN*mm")
ENERGY = Dimension("an energy", 1, 1, "5 kJ")
STRAIN = Dimension("a strain", 0, 0, "0.2 %")
SPEED = Dimension("a speed", 0, 1, "100 mm/s", -1)
PER_SPEED = Dimension("one per speed", 0, -1, "2 s/m", 1)
PER_LENGTH = Dimension("one per length", 0, -1, "0.2 /mm")
RATE = Dimension("a rate", 0, 0, "1 /s", -1)
ANGLE = Dimension("an angle", 0, 0, "10 deg")
RATIO = Dimension("a number", 0, 0, "12 %")
TIME = Dimension("a time in seconds", 0, 0, "20 ms", 1)

# By definition exact: the pound-force of standard gravity and the inch of 25.4 mm.
_LBF, _INCH = Fraction("4.4482216152605"), Fraction("0.0254")
_SI: dict[str, tuple[Fraction, int, int, int]] = {
    "m": (Fraction(1), 0, 1, 0),
    "in": (_INCH, 0, 1, 0),
    "inch": (_INCH, 0, 1, 0),
    "inches": (_INCH, 0, 1, 0),
    "ft": (12 * _INCH, 0, 1, 0),
    "N": (Fraction(1), 1, 0, 0),
    "lbf": (_LBF, 1, 0, 0),
    "kip": (1000 * _LBF, 1, 0, 0),
    "kgf": (Fraction("9.80665"), 1, 0, 0),
    "Pa": (Fraction(1), 1, -2, 0),
    "J": (Fraction(1), 1, 1, 0),
    "bar": (Fraction(10**5), 1, -2, 0),
    "psi": (_LBF / _INCH**2, 1, -2, 0),
    "ksi": (1000 * _LBF / _INCH**2, 1, -2, 0),
    "s": (Fraction(1), 0, 0, 1),
    "min": (Fraction(60), 0, 0, 1),
    "h": (Fraction(3600), 0, 0, 1),
    "rad": (Fraction(1), 0, 0, 0),
    "deg": (Fraction(math.pi) / 180, 0, 0, 0),
    "°": (Fraction(math.pi) / 180, 0, 0, 0),
    "%": (Fraction(1, 100), 0, 0, 0),
}
_TURNS = ("rad", "deg", "°")
_PREFIX = {"n": -9, "µ": -6, "μ": -6, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
_SI |= {
    p + u: (_SI[u][0] * Fraction(10) ** e, *_SI[u][1:])
    for p, e in _PREFIX.items()
    for u in ("m", "N", "Pa", "J", "rad", "s")
    if (p, u) not in (("c", "s"), ("d", "s"), ("k", "s"), ("M", "s"), ("G", "s"))
}

# Few digits on purpose: an exact power of 10 with a nine-digit exponent would fill the memory.
_NUMBER = re.compile(r"\s*([-+]?(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*$", re.ASCII)
_THOUSANDS = re.compile(r"['’_]?\d{3}(?!\d)", re.ASCII)  # after a first group
_DASHES = ("−", "–", "—")  # of text programs
_FACTOR = re.compile(r"\s*([*/·]?)\s*([^\W\d_]{1,30}|°|%)(?:(?:\*\*|\^)?(-?\d)|([²³]))?(?![\w.])")


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


def _meant(name: str) -> str:
    """'; did you mean …?' for a unit that is spelt like an unknown one, best in the case of its letters too."""
    near = difflib.get_close_matches(name.lower(), {u.lower() for u in _SI}, n=1)
    # nobody measures a stress in millipascal: 'Mpa' and 'mpa' are a million of them
    like = [u for u in _SI if near and u.lower() == near[0] and u != "mPa"]
    best = min(like, key=lambda u: sum(a != b for a, b in zip(u, name)), default=None)
    return "" if best is None else f"; did you mean {best!r}?"


@lru_cache(maxsize=256)
def _unit(name: str) -> tuple[Fraction, int, int, int]:
    """SI value and the exponents of force, length and time of one unit name."""
    if name in _SI:
        return _SI[name]
    ureg = _registry()
    try:
        base = ureg.Quantity(1.0, ureg.parse_units(name)).to_base_units()
    except Exception:  # pint raises errors of many classes for names that it does not know
        raise ValueError(f"unknown unit {name!r}{_meant(name)}") from None
    powers = dict(base.dimensionality)
    mass, length, time = (powers.pop(f"[{of}]", 0) for of in ("mass", "length", "time"))
    if powers or any(exponent != int(exponent) for exponent in (mass, length, time)):
        raise ValueError(f"{name!r} is not a unit of length, force, stress, time or angle")
    return Fraction(base.magnitude), int(mass), int(length - mass), int(time + 2 * mass)


def _product(text: str) -> tuple[Fraction, int, int, int]:
    """SI value and exponents of a product of units such as ``N/mm^2`` or ``1/s``."""
    value, force, length, time, at = Fraction(1), 0, 0, 0, 0
    if len(text) > 100:
        raise ValueError("this is too long for a unit")
    if re.match(r"1\s*/", text):
        text = text[1:].lstrip()
    while at < len(text):
        match = _FACTOR.match(text, at)
        if match is None or (at == 0 and match[1] not in ("", "/")):
            raise ValueError(f"cannot read the unit {text!r}")
        v, f, ell, t = _unit(match[2])
        power = int(match[3] or {"²": 2, "³": 3}.get(match[4], 1)) * (-1 if match[1] == "/" else 1)
        value, force, length, time = value * v**power, force + f * power, length + ell * power, time + t * power
        at = match.end()
    return value, force, length, time


def _named(dimension: Dimension) -> Any:
    def check(text: str) -> str:
        if not text.strip() or _product(text)[1:] != dimension.exponents:
            raise ValueError(f"{text!r} is not the unit of {dimension.name}; {_COMMON[dimension]}")
        return text

    return AfterValidator(check)


_COMMON = {LENGTH: "write mm, m or inch", FORCE: "write N, kN or lbf"}


@lru_cache(maxsize=256)
def factor(text: str, length: str, force: str, dimension: tuple[int, ...]) -> float:
    """Value of the quantity *text* in the system (*length*, *force*, s); *dimension*: exponents of force, length (and time).

    Raises
    ------
    ValueError
        If the text is no quantity or has another dimension.

    """
    match = _NUMBER.match(text)
    if match is None:
        dash = text.strip()[:1]
        said = f"begins with a dash (U+{ord(dash):04X}): write '-{text.strip()[1:]}'" if dash in _DASHES else "is not a quantity"
        raise ValueError(f"{text!r} {said}")
    number, unit = match.groups()
    if _THOUSANDS.match(unit):
        written = re.sub(r"(?<=\d)['’_ ](?=\d{3})", "", text.strip())
        raise ValueError(f"{text!r} has something between its thousands: write {written!r}")
    if not unit:
        return float(number)
    value, *powers = _product(unit)
    if tuple(powers) != (*dimension, 0, 0, 0)[:3]:
        raise ValueError(f"{text!r} has the wrong unit")
    # Time has no part in it: seconds are those of every system.
    system = _product(force)[0] ** dimension[0] * _product(length)[0] ** dimension[1]
    try:
        return float(Fraction(number) * value / system)
    except OverflowError:
        raise ValueError(f"{text!r} is too large a number") from None


def _refuse_turns(value: str) -> None:
    """A ratio of lengths is no angle, though both are numbers."""
    match = _NUMBER.match(value)
    if match is not None and any(name[2] in _TURNS for name in _FACTOR.finditer(match[2])):
        raise ValueError(f"{value!r} has the wrong unit")


def _convert(dimension: Dimension, per_depth: bool = False) -> Any:
    return BeforeValidator(_converter(dimension, per_depth))


def _converter(dimension: Dimension, per_depth: bool = False) -> Callable[[Any, ValidationInfo], Any]:
    """What reads a number of that dimension; ``per_depth``: in plane problems also one per length of thickness.

    Plain numbers and quantities of the dimension itself are those of the whole thickness.
    """

    def convert(value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, bool):
            raise PydanticKnownError("float_type")
        if not isinstance(value, str):
            return value
        if not info.context or "units" not in info.context:
            raise ValueError(f"{value!r}: unit strings belong in case files; in Python give a number")
        units = info.context["units"]
        remedy = f"write {dimension.name} as a plain number or like '{dimension.example}'"
        try:
            # Degrees and ratios have the same (no) dimension: '10 deg' as a strain would pass as 0.17.
            if dimension in (STRAIN, RATIO):
                _refuse_turns(value)
            return factor(value, units["length"], units["force"], dimension.exponents)
        except ValueError as error:
            reason = str(error)
            depth = units.get("thickness")
            # A moment per thickness has the dimension of a force: a force written by mistake would be taken for it.
            if dimension is MOMENT and "wrong unit" in reason and _is_force(value, units):
                raise ValueError(
                    f"{value!r} is a force, and {dimension.name} is meant; {remedy}, per length of the thickness like "
                    "'3 kN*mm/mm'"
                ) from None
            if per_depth and depth is not None and "wrong unit" in reason:
                with suppress(ValueError):
                    # Forces of plane problems belong to the whole thickness: given per length of it, they are multiplied.
                    per = (dimension.force, dimension.length - 1)
                    return depth * factor(value, units["length"], units["force"], per)
            if dimension is FORCE and (weight := _weight(value)):
                raise ValueError(f"{value!r} is a mass, and {dimension.name} is meant: its weight is '{weight}'") from None
            if "did you mean" in reason:
                raise ValueError(f"{value!r}: {reason}") from None
            if dimension is LENGTH and "wrong unit" in reason and _is_speed(value, units):
                remedy = "speeds of tools are given by 'velocity'"
                raise ValueError(f"{value!r} is a speed, and {dimension.name} is meant; {remedy}") from None
            raise ValueError(f"{value!r} is not {dimension.name} ({reason}); {remedy}") from None

    return convert


def _weight(text: str) -> str:
    """Weight of a mass under standard gravity, such as '2450 kN' of 250 t; '' of what is no mass."""
    match = _NUMBER.match(text)
    with suppress(ValueError):
        if match is not None and match[2] and _product(match[2])[1:] == (1, -1, 2):
            newton = float(Fraction(match[1]) * _product(match[2])[0] * _SI["kgf"][0])
            return f"{newton / 1000:.4g} kN" if newton >= 1000 else f"{newton:.4g} N"
    return ""


def _is_force(text: str, units: Any) -> bool:
    """Whether a text is a force by its name, not a moment per length, which has the same dimension."""
    with suppress(ValueError):
        factor(text, units["length"], units["force"], FORCE.exponents)
        return not set("*/·") & set(_NUMBER.match(text)[2])  # type: ignore[index]
    return False


def _is_speed(text: str, units: Any) -> bool:
    """Whether a text is a speed."""
    with suppress(ValueError):
        factor(text, units["length"], units["force"], SPEED.exponents)
        return True
    return False


def powers(unit: str) -> tuple[int, int]:
    """Exponents of force and length (not of time) of a unit such as ``N/mm²``; of no unit zeros.

    Raises
    ------
    ValueError
        If it is not a unit.

    """
    _, force, length, _ = _product(unit)
    return force, length


def in_one_second(text: str) -> str:
    """What a velocity such as ``100 mm/s`` or ``3 m/min`` makes of one second, as a text.

    Raises
    ------
    ValueError
        If it is not per time.

    """
    match = _NUMBER.match(text)
    if match is not None and not match[2]:
        return text
    try:
        if match is None or _product(match[2])[3] != -1:
            raise ValueError("the wrong unit")
    except ValueError as error:
        like = "90 deg/s" if match is not None and match[2].strip() in ("deg", "rad", "°") else SPEED.example
        remedy = f"write it per second, as a plain number or like {like!r}"
        raise ValueError(f"{text!r} is not a velocity ({error}); {remedy}") from None
    # Motions are lengths and angles: a velocity times one second is one, with every check of its unit.
    return f"{text}*s"


def _in_seconds(value: Any) -> Any:
    """The number of seconds of a text such as ``20 ms``, in Python too: they are the same in every system."""
    if not isinstance(value, str):
        return value
    try:
        return factor(value, "mm", "N", TIME.exponents)
    except ValueError:
        message = f"{value!r} is not a time; write it in seconds, as a plain number or like {TIME.example!r} (s, ms, us, min, h)"
        raise ValueError(message) from None


def _refuse_bool(value: Any) -> Any:
    """Python counts True as 1; a number that is ``true`` in a file is a slip."""
    if isinstance(value, bool):
        raise PydanticKnownError("float_type")
    return value


def _share(value: Any, info: ValidationInfo) -> Any:
    """A text that ends with ``%`` as a number; others are read as ever."""
    if isinstance(value, str) and value.rstrip().endswith("%"):
        return _ratio(value, info)
    return value


_ratio = _converter(RATIO)

LengthUnit = Annotated[str, _named(LENGTH)]
ForceUnit = Annotated[str, _named(FORCE)]
Number = Annotated[float, BeforeValidator(_share), BeforeValidator(_refuse_bool)]
Whole = Annotated[int, BeforeValidator(_refuse_bool)]
Length = Annotated[float, LENGTH, _convert(LENGTH)]
Displacement = Annotated[float, LENGTH, _convert(LENGTH)]
Pressure = Annotated[float, PRESSURE, _convert(PRESSURE)]
Stiffness = Annotated[float, STIFFNESS, _convert(STIFFNESS)]
BodyForce = Annotated[float, BODY_FORCE, _convert(BODY_FORCE)]
Force = Annotated[float, FORCE, _convert(FORCE, per_depth=True)]
Moment = Annotated[float, MOMENT, _convert(MOMENT, per_depth=True)]
Energy = Annotated[float, ENERGY, _convert(ENERGY)]
SpringStiffness = Annotated[float, SPRING, _convert(SPRING)]
Speed = Annotated[float, SPEED, _convert(SPEED)]
PerSpeed = Annotated[float, PER_SPEED, _convert(PER_SPEED)]
PerLength = Annotated[float, PER_LENGTH, _convert(PER_LENGTH)]
Rate = Annotated[float, RATE, _convert(RATE)]
Strain = Annotated[float, STRAIN, _convert(STRAIN)]
Angle = Annotated[float, ANGLE, _convert(ANGLE)]
Seconds = Annotated[float, TIME, BeforeValidator(_in_seconds), BeforeValidator(_refuse_bool)]
