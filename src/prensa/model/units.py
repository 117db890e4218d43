"""Dimensions of the vocabulary's numbers, and unit strings.

A field typed ``Length`` accepts a number in the case's own system, or, in a file, a string such as ``8 cm``. The system
travels as the validation context, so that a description built in Python (no context) takes plain numbers only.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationInfo


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=256)
def factor(text: str, length: str, force: str, dimension: tuple[int, int]) -> float:
    """Value of the quantity *text* in the system (*length*, *force*); *dimension* = exponents of force and length.

    Raises
    ------
    ValueError
        If the text is no quantity or has another dimension.
    """
    ureg = _registry()
    f, ell = dimension
    unit = ureg.parse_units(force) ** f * ureg.parse_units(length) ** ell if dimension != (0, 0) else ureg.radian
    try:
        quantity = ureg.parse_expression(text)
        if not hasattr(quantity, "to"):
            return float(quantity)
        return float(quantity.to(unit).magnitude)
    except Exception as error:
        raise ValueError(f"{text!r} is not a quantity in {unit:~}: {error}") from None


def _convert(dimension: tuple[int, int]) -> Any:
    def convert(value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, str):
            return value
        if not info.context or "units" not in info.context:
            raise ValueError(f"{value!r}: unit strings belong in case files; in Python give a number in the case's units")
        units = info.context["units"]
        return factor(value, units["length"], units["force"], dimension)

    return BeforeValidator(convert)


Length = Annotated[float, _convert((0, 1))]
Displacement = Annotated[float, _convert((0, 1))]
Pressure = Annotated[float, _convert((1, -2))]
Stiffness = Annotated[float, _convert((1, -3))]
Force = Annotated[float, _convert((1, 0))]
Strain = Annotated[float, _convert((0, 0))]
Angle = Annotated[float, _convert((0, 0))]
