"""Metals by name: flow curves with their source and the range in which they were measured, one a file.

`prensa.materials.library` has the files that come with prensa; a user's own file has the same keys::

    E: 206 GPa
    nu: 0.3
    flow: {type: swift, K: 565.3 MPa, e0: 0.00712, n: 0.259}
    strain: [0, 0.6]
    source: tensile tests of sheet 4711, 3 March
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args, get_origin

from pydantic import Field, ValidationError, ValidationInfo
from pydantic_core import ArgsKwargs, InitErrorDetails, PydanticCustomError

from prensa.errors import CaseError, Mistake, PrensaError
from prensa.materials.flow_curve import FlowCurve
from prensa.model.doors import union
from prensa.model.fields import described
from prensa.model.metals import Metal, RateRange, StrainRange, TemperatureRange
from prensa.model.units import PRESSURE, Dimension, Number, Pressure, factor

if TYPE_CHECKING:  # members are known when the program runs
    Flow: TypeAlias = FlowCurve
else:
    Flow = union("flow")

LIBRARY = Path(__file__).parent / "library"
ENDINGS = (".yaml", ".yml")
PoissonRatio = Annotated[Number, Field(gt=-1.0, lt=0.5)]


@described
class MetalFile:
    """A metal in a file: elastic constants, flow curve, range and source, stresses in MPa where they state no unit.

    ``what``: the metal in words, with its condition; ``also``: its other names; ``elastic``: source of E and nu; ``see``: address
    of the source, or of a public copy of its numbers; ``note``: what else there is to know, such as what was derived;
    ``licence``: on what terms its numbers are here; ``holds``: as in `Metal`.
    """

    E: Annotated[Pressure, Field(gt=0)]
    nu: PoissonRatio
    flow: Flow
    strain: StrainRange
    source: str
    what: str = ""
    also: tuple[str, ...] = ()
    rate: RateRange | None = None
    temperature: TemperatureRange | None = None
    holds: TemperatureRange | None = None
    elastic: str = ""
    see: str = ""
    note: str = ""
    licence: str = ""


class UnknownMetalError(ValueError):
    """A metal that neither the library has nor a file describes; says the nearest names."""


def names() -> list[str]:
    """Names of the metals that come with prensa, in alphabetical order."""
    return sorted((p.stem for p in LIBRARY.glob("*.yaml")), key=str.casefold)


def read_metal(name: str, folder: str | Path | None = None) -> tuple[Metal, MetalFile]:
    """A metal of the library, or of a file in *folder*, with where its numbers come from; stresses in MPa.

    Raises
    ------
    UnknownMetalError
        If there is none of that name.
    CaseError
        If the file describes none: with file, line and column.

    """
    if name.endswith(ENDINGS):
        path = Path(folder or "") / name
        if not path.is_file():
            raise UnknownMetalError(f"there is no file {name!r}; paths are relative to the case file")
        return _read(path, path.stat().st_mtime_ns)
    known = names()
    if name in known:
        return _read(LIBRARY / f"{name}.yaml", 0)
    # Grades are written in any case, and have other names in other standards.
    of = {other: k for k, metal in library().items() for other in (k, *metal.also)}
    found = next((other for other in of if other.casefold() == name.casefold()), None)
    if found is None:
        # A grade with a condition behind it is nearer than one of a like number.
        same = [other for other in of if other.casefold().startswith(name.casefold())]
        near = ", ".join(map(repr, dict.fromkeys([*same, *get_close_matches(name, of, n=3, cutoff=0)])))
        raise UnknownMetalError(
            f"unknown metal {name!r}; the closest names are {near}; 'prensa materials' lists all, and the file of a metal of "
            "your own is named like 'steel.yaml'"
        )
    return _read(LIBRARY / f"{of[found]}.yaml", 0)


def asked(wanted: Iterable[str]) -> dict[str, tuple[Metal, MetalFile]]:
    """Metals by name, of files of one's own too; all of the library where none is named. Stresses in MPa.

    Raises
    ------
    PrensaError
        Where there is none of a name, or its file describes none.

    """
    try:
        found = [read_metal(name) for name in wanted or names()]
    except UnknownMetalError as error:
        raise PrensaError(str(error)) from None
    return {metal.name: (metal, file) for metal, file in found}


def library() -> dict[str, MetalFile]:
    """The metals that come with prensa, by name; stresses in MPa."""
    return {name: _read(LIBRARY / f"{name}.yaml", 0)[1] for name in names()}


@lru_cache(maxsize=256)
def _read(path: Path, _time: int) -> tuple[Metal, MetalFile]:
    """A metal from its file, which is read again when it has changed."""
    from pydantic import TypeAdapter

    from prensa.model.messages import mistakes
    from prensa.model.places import Place
    from prensa.model.text import content_of, read

    tree, known = read(content_of(path), str(path))
    if not isinstance(tree.value, dict):
        raise CaseError([*known, Mistake(tree.mark, "a metal is a mapping with E, nu, flow, strain and source")])
    if known:
        raise CaseError(known)
    context = {"units": {"length": "mm", "force": "N"}, "folder": path.parent}
    try:
        made: MetalFile = TypeAdapter(MetalFile).validate_python(tree.plain(), context=context)
    except ValidationError as error:
        place = Place((), MetalFile, tree, None, "the metal")
        # of a file's errors the first key is that of a case's problem, and is left out
        found = [e | {"loc": ("problem", *e["loc"])} for e in error.errors(include_url=False)]
        raise CaseError(mistakes(found, (), place, [])) from None
    return Metal(path.stem, made.source, made.strain, made.rate, made.temperature, made.holds), made


# ------------------------------------------------------------------------------------------------------- into a material
def of_a_metal(cls: type, data: Any, info: ValidationInfo) -> Any:
    """Validator of a material with a field ``of``: its fields, those that the metal gives too.

    Raises
    ------
    ValidationError
        In the words of `given_by`.

    """
    given = data
    if isinstance(data, ArgsKwargs):  # of a script: fields in their order, and by name
        given = dict(zip((f.name for f in fields(cls)), data.args)) | (data.kwargs or {})
    if not isinstance(given, dict) or not isinstance(given.get("of"), str):
        return data
    try:
        return given_by(given, info.context)
    except (ValueError, CaseError) as error:
        words = PydanticCustomError("metal", "{words}", {"words": str(error)})
        wrong = InitErrorDetails(type=words, loc=("of",), input=given["of"])
        raise ValidationError.from_exception_data(cls.__name__, [wrong]) from None


def given_by(data: Mapping[str, Any], context: Any) -> dict[str, Any]:
    """Fields of a material ``of`` a metal: E, nu and flow in the units of the case, and what the case states in their place.

    Raises
    ------
    UnknownMetalError, CaseError
        See `read_metal`.
    ValueError
        If nothing of the metal is used, or the case has other units, and a flow curve of the user's own that states none.

    """
    metal, file = read_metal(data["of"], (context or {}).get("folder"))
    units = (context or {}).get("units") or {"length": "mm", "force": "N"}
    by = factor("1 MPa", units["length"], units["force"], PRESSURE.exponents)
    out = dict(data)
    changed = [key for key in ("E", "nu") if out.get(key) is not None]
    flow: Any = in_units(file.flow, by)
    stated = out.get("flow")
    if isinstance(stated, dict) and "type" not in stated:
        changed += [f"flow.{key}" for key in stated]
        flow = {f.name: getattr(flow, f.name) for f in fields(flow)} | {"type": flow.type} | stated
    elif stated is not None:
        changed, flow = [*changed, "flow"], stated
    if changed == ["E", "nu", "flow"]:
        raise ValueError(f"E, nu and flow are stated, so nothing of the metal {data['of']!r} is used; leave them out, or 'of'")
    defaults = {"E": file.E * by, "nu": file.nu, "flow": flow}
    return out | {k: v for k, v in defaults.items() if k == "flow" or out.get(k) is None} | {
        "of": replace(metal, MPa=by).altered(changed)
    }


def in_units(flow: FlowCurve, by: float) -> FlowCurve:
    """A flow curve with its stresses multiplied: those of its fields that are stresses by their types.

    Raises
    ------
    ValueError
        Of a curve whose fields state no dimensions, where they are to be multiplied.

    """
    if by == 1.0:
        return flow
    from prensa.model.places import hints

    curve: Any = flow
    cls: Any = type(flow)
    known = hints(cls)
    scaled = {f.name: _scaled(known[f.name], getattr(curve, f.name), by) for f in fields(curve) if f.name != "type"}
    if all(value == getattr(curve, name) for name, value in scaled.items()):
        raise ValueError(f"the flow curve {curve.type!r} states no units of its fields; write the case in mm and N")
    made: FlowCurve = cls(**scaled)
    return made


def _scaled(annotation: Any, value: Any, by: float) -> Any:
    from prensa.model.places import bare

    kind, meta = bare(annotation)
    if isinstance(value, tuple) and get_origin(kind) is tuple:
        inner = get_args(kind)
        each = [inner[0]] * len(value) if inner[-1] is Ellipsis else inner
        return tuple(_scaled(a, v, by) for a, v in zip(each, value))
    return value * by if any(isinstance(m, Dimension) and m == PRESSURE for m in meta) else value
