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
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ValidationInfo
from pydantic_core import PydanticKnownError


@dataclass(frozen=True)
class Dimension:
    """What a number is: its ``name`` with article, exponents of ``force`` and ``length``, an ``example`` to show."""

    name: str
    force: int
    length: int
    example: str


LENGTH = Dimension("a length", 0, 1, "8 cm")
PRESSURE = Dimension("a stress", 1, -2, "10 GPa")
STIFFNESS = Dimension("a pressure per length", 1, -3, "1e3 MPa/mm")
BODY_FORCE = Dimension("a force per volume", 1, -3, "77 kN/m^3")
FORCE = Dimension("a force", 1, 0, "2 kN")
SPRING = Dimension("a force per length", 1, -1, "2 kN/mm")
MOMENT = Dimension("a moment", 1, 1, "3 kN*mm")
STRAIN = Dimension("a strain", 0, 0, "0.2 %")
SPEED = Dimension("a speed", 0, 1, "100 mm/s")
ANGLE = Dimension("an angle", 0, 0, "10 deg")
TIME = Dimension("a time in seconds", 0, 0, "20 ms")

_LBF, _INCH = Fraction("4.4482216152605"), Fraction("0.0254")
_SI: dict[str, tuple[Fraction, int, int]] = {
    "m": (Fraction(1), 0, 1),
    "in": (_INCH, 0, 1),
    "inch": (_INCH, 0, 1),
    "inches": (_INCH, 0, 1),
    "ft": (12 * _INCH, 0, 1),
    "N": (Fraction(1), 1, 0),
    "lbf": (_LBF, 1, 0),
    "kip": (1000 * _LBF, 1, 0),
    "kgf": (Fraction("9.80665"), 1, 0),
    "Pa": (Fraction(1), 1, -2),
    "bar": (Fraction(10**5), 1, -2),
    "psi": (_LBF / _INCH**2, 1, -2),
    "ksi": (1000 * _LBF / _INCH**2, 1, -2),
    "rad": (Fraction(1), 0, 0),
    "deg": (Fraction(math.pi) / 180, 0, 0),
    "°": (Fraction(math.pi) / 180, 0, 0),
    "%": (Fraction(1, 100), 0, 0),
}
_SECONDS = {"s": Fraction(1), "ms": Fraction(1, 1000), "us": Fraction(1, 10**6), "min": Fraction(60), "h": Fraction(3600)}
_SECONDS |= {"µs": _SECONDS["us"], "μs": _SECONDS["us"]}
_PREFIX = {"n": -9, "µ": -6, "μ": -6, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
_SI |= {
    p + u: (_SI[u][0] * Fraction(10) ** e, *_SI[u][1:]) for p, e in _PREFIX.items() for u in ("m", "N", "Pa", "rad")
}

# Few digits on purpose: an exact power of 10 with a nine-digit exponent would fill the memory.
_NUMBER = re.compile(r"\s*([-+]?(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*$", re.ASCII)
_FACTOR = re.compile(r"\s*([*/·]?)\s*([^\W\d_]{1,30}|°|%)(?:(?:\*\*|\^)?(-?\d)|([²³]))?(?![\w.])")


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=256)
def _unit(name: str) -> tuple[Fraction, int, int]:
    """SI value and the exponents of force and length of one unit name."""
    if name in _SI:
        return _SI[name]
    ureg = _registry()
    try:
        base = ureg.Quantity(1.0, ureg.parse_units(name)).to_base_units()
    except Exception:  # pint raises errors of many classes for names that it does not know
        near = difflib.get_close_matches(name.lower(), {u.lower(): u for u in _SI}, n=1)
        meant = next((f"; did you mean {u!r}?" for u in _SI if near and u.lower() == near[0]), "")
        raise ValueError(f"unknown unit {name!r}{meant}") from None
    powers = dict(base.dimensionality)
    mass = powers.pop("[mass]", 0)
    length, time = powers.pop("[length]", 0), powers.pop("[time]", 0)
    if powers or time != -2 * mass or mass != int(mass) or length != int(length):
        raise ValueError(f"{name!r} is no unit of length, force, stress or angle")
    return Fraction(base.magnitude), int(mass), int(length - mass)


def _product(text: str) -> tuple[Fraction, int, int]:
    """SI value and exponents of a product of units such as ``N/mm^2``."""
    value, force, length, at = Fraction(1), 0, 0, 0
    if len(text) > 100:
        raise ValueError("no unit is as long as this")
    while at < len(text):
        match = _FACTOR.match(text, at)
        if match is None or (at == 0 and match[1]):
            raise ValueError(f"cannot read the unit {text!r}")
        v, f, ell = _unit(match[2])
        power = int(match[3] or {"²": 2, "³": 3}.get(match[4], 1)) * (-1 if match[1] == "/" else 1)
        value, force, length, at = value * v**power, force + f * power, length + ell * power, match.end()
    return value, force, length


def _named(dimension: Dimension) -> Any:
    def check(text: str) -> str:
        if not text.strip() or _product(text)[1:] != (dimension.force, dimension.length):
            raise ValueError(f"{text!r} is not the unit of {dimension.name}; {_COMMON[dimension]}")
        return text

    return AfterValidator(check)


_COMMON = {LENGTH: "write mm, m or inch", FORCE: "write N, kN or lbf"}


@lru_cache(maxsize=256)
def factor(text: str, length: str, force: str, dimension: tuple[int, int]) -> float:
    """Value of the quantity *text* in the system (*length*, *force*); *dimension* = exponents of force and length.

    Raises
    ------
    ValueError
        If the text is no quantity or has another dimension.

    """
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError(f"{text!r} is not a quantity")
    number, unit = match.groups()
    if not unit:
        return float(number)
    value, *powers = _product(unit)
    if tuple(powers) != dimension:
        raise ValueError(f"{text!r} has the wrong unit")
    system = _product(force)[0] ** dimension[0] * _product(length)[0] ** dimension[1]
    try:
        return float(Fraction(number) * value / system)
    except OverflowError:
        raise ValueError(f"{text!r} is too large a number") from None


def _convert(dimension: Dimension, per_depth: bool = False) -> Any:
    """Validator of a number of that dimension; ``per_depth``: in plane problems also one per length of thickness.

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
            return factor(value, units["length"], units["force"], (dimension.force, dimension.length))
        except ValueError as error:
            reason = str(error)
            depth = units.get("thickness")
            if per_depth and depth is not None and "wrong unit" in reason:
                with suppress(ValueError):
                    per = (dimension.force, dimension.length - 1)
                    return depth * factor(value, units["length"], units["force"], per)
            if "did you mean" in reason:
                raise ValueError(f"{value!r}: {reason}") from None
            raise ValueError(f"{value!r} is not {dimension.name} ({reason}); {remedy}") from None

    return BeforeValidator(convert)


def powers(unit: str) -> tuple[int, int]:
    """Exponents of force and length of a unit such as ``N/mm²``; of no unit zeros.

    Raises
    ------
    ValueError
        If it is no unit.

    """
    _, force, length = _product(unit.removeprefix("1"))
    return force, length


def _per_second(value: Any) -> Any:
    """The length of one second of a text such as ``100 mm/s``."""
    if not isinstance(value, str):
        return value
    length, per, second = value.rpartition("/")
    if not per or second.strip() != "s":
        raise ValueError(f"{value!r} is not a speed; write it per second, as a plain number or like {SPEED.example!r}")
    return length


def _in_seconds(value: Any) -> Any:
    """The number of seconds of a text such as ``20 ms``."""
    if not isinstance(value, str):
        return value
    match = _NUMBER.match(value)
    if match is None or match[2] not in {**_SECONDS, "": 1}:
        units = ", ".join(u for u in _SECONDS if u.isascii())
        raise ValueError(f"{value!r} is not a time; write it in seconds, as a plain number or like {TIME.example!r} ({units})")
    return float(Fraction(match[1]) * _SECONDS.get(match[2], 1))


def _refuse_bool(value: Any) -> Any:
    """Python counts True as 1; a number that is ``true`` in a file is a slip."""
    if isinstance(value, bool):
        raise PydanticKnownError("float_type")
    return value


LengthUnit = Annotated[str, _named(LENGTH)]
ForceUnit = Annotated[str, _named(FORCE)]
Number = Annotated[float, BeforeValidator(_refuse_bool)]
Whole = Annotated[int, BeforeValidator(_refuse_bool)]
Length = Annotated[float, LENGTH, _convert(LENGTH)]
Displacement = Annotated[float, LENGTH, _convert(LENGTH)]
Pressure = Annotated[float, PRESSURE, _convert(PRESSURE)]
Stiffness = Annotated[float, STIFFNESS, _convert(STIFFNESS)]
BodyForce = Annotated[float, BODY_FORCE, _convert(BODY_FORCE)]
Force = Annotated[float, FORCE, _convert(FORCE, per_depth=True)]
Moment = Annotated[float, MOMENT, _convert(MOMENT, per_depth=True)]
SpringStiffness = Annotated[float, SPRING, _convert(SPRING)]
Speed = Annotated[float, SPEED, _convert(SPEED), BeforeValidator(_per_second)]
Strain = Annotated[float, STRAIN, _convert(STRAIN)]
Angle = Annotated[float, ANGLE, _convert(ANGLE)]
Seconds = Annotated[float, TIME, BeforeValidator(_in_seconds), BeforeValidator(_refuse_bool)]
