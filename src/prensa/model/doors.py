"""From a registry to a type of the vocabulary: the union of its members, open to users' own laws.

Pydantic's tagged unions are closed. The last alternative here takes what no other does: ``type: my_module:MyLaw`` of a
file, and objects of users' classes.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Union, dataclass_transform

from pydantic import BeforeValidator, Discriminator, Tag, TypeAdapter, ValidationError, ValidationInfo
from pydantic_core import PydanticKnownError

from prensa.errors import shown
from prensa.model.fields import described
from prensa.model.names import suggest
from prensa.registry import DOORS, Door, user_type

USERS = "module:Class"
"""Tag of the alternative for users' own laws."""


def union(kind: str, only: Callable[[Any], bool] = lambda cls: True) -> Any:
    """The type of a value that may be any member of the door of a kind; of prensa's ``only`` those for which that holds."""
    door = DOORS[kind]
    alternatives = [Annotated[cls, Tag(name)] for name, cls in door.own().items() if only(cls)]
    users = Annotated[Any, BeforeValidator(_user(door)), Tag(USERS)]
    return Annotated[Union[(*alternatives, users)], Discriminator(_tag(door))]


def _mistake(error: Any, fields: list[str]) -> str:
    """One mistake of a user's law, in words: it has no place in the vocabulary that other messages are made from."""
    where = ".".join(map(str, error["loc"]))
    if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"has no {where!r}{suggest(where, fields)}"
    if error["type"] in ("missing", "missing_argument"):
        return f"needs {where!r}"
    message = str(error["ctx"]["error"]) if error["type"] == "value_error" else error["msg"]
    return f"has {where} = {shown(error['input'])}: {message}" if where else message


def fault(asked: str, call: Callable[[], Any], fits: Callable[[Any], bool], expected: str) -> str:
    """What is wrong with the form of a law's answer to one trial ``call`` of what is ``asked``; empty where it ``fits``."""
    try:
        found = call()
    except Exception as error:  # whatever a user's function raises, a run would end with it
        return f"its {asked} raises {type(error).__name__} ({error}) where it is tried; {expected} is expected"
    try:
        if fits(found):
            return ""
    except (TypeError, ValueError):  # no numbers
        pass
    shape = getattr(found, "shape", None)
    given = shown(found) if shape is None else f"an array of shape {shape}"
    return f"its {asked} returns {given} where it is tried; {expected} is expected"


@dataclasses.dataclass(frozen=True)
class NameOf:
    """Marks a text as the type of a member of the door of a kind."""

    kind: str

    @property
    def names(self) -> list[str]:
        """The types that come with prensa."""
        return [name for name, cls in DOORS[self.kind].own().items() if getattr(cls, "offered", True)]


def name_of(kind: str) -> Any:
    """The type of a value that names a member without fields of its own, such as an element or an integration rule."""
    door = DOORS[kind]

    def check(value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, str) or value in door.members():
            return value
        if ":" not in value:
            known = [repr(name) for name in NameOf(kind).names]
            raise PydanticKnownError("literal_error", {"expected": " or ".join([", ".join(known[:-1]), known[-1]])})
        return user_type(door.find(value, (info.context or {}).get("folder")))

    return Annotated[str, NameOf(kind), BeforeValidator(check)]


def _tag(door: Door) -> Callable[[Any], Any]:
    def tag(value: Any) -> Any:
        own = door.own()
        given = value.get("type", door.default) if isinstance(value, dict) else getattr(value, "type", door.default)
        if isinstance(given, str) and given in own:
            # A user's class may carry the type of one of prensa's: the object itself says which it is.
            return given if isinstance(value, (dict, own[given])) else USERS
        # Objects of users' classes have no tag that pydantic's union knows; they, and 'module:Class', go to the last
        # alternative.
        theirs = isinstance(value, door.base_class()) or (isinstance(given, str) and ":" in given)
        return USERS if theirs else given

    return tag


def _user(door: Door) -> Callable[[Any, ValidationInfo], Any]:
    def read(value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, dict):
            if not isinstance(value, door.base_class()):
                usual = door.default or next(iter(door.own()))
                first = next((f.name for f in dataclasses.fields(door.own()[usual]) if f.name != "type"), "")
                number = isinstance(value, int | float) and not isinstance(value, bool)
                values = f"{first}: {value:g}" if first and number else "…"
                raise ValueError(
                    f"{shown(value)} is not a valid {door.kind}: write its type and values, {{type: {usual}, {values}}}; "
                    f"your own class in Python must derive from prensa.{door.base_class().__name__}"
                )
            return value
        given = dict(value)
        name = str(given.pop("type"))
        cls = door.find(name, (info.context or {}).get("folder"))
        if not getattr(cls, "offered", True):
            raise ValueError(f"{cls.__name__} is used from Python alone so far: give it to prensa.Body in a script")
        try:
            return TypeAdapter(cls).validate_python(given, context=info.context)
        except ValidationError as error:
            fields = [f.name for f in dataclasses.fields(cls)]
            raise ValueError(
                f"{name} {'; '.join(_mistake(e, fields) for e in error.errors(include_url=False))}"
            ) from None

    return read


def add_common_fields(cls: type, common: Mapping[str, Any], default: Any = None) -> None:
    """Give a class that is not a dataclass yet the fields, by name their types, that all of its kind have with one default.

    Behind its own fields, which then come first in its constructor and among its keys, before ``type``. What it states itself
    stays as it is.
    """
    own = dict(inspect.get_annotations(cls))
    missing = {name: kind for name, kind in common.items() if name not in own}
    if hasattr(cls, "__dataclass_fields__") or not missing:
        return
    last = {"type": own.pop("type")} if "type" in own else {}
    cls.__annotations__ = {**own, **missing, **last}
    for name in missing:
        setattr(cls, name, default)


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
class Member:
    """Base of what stands behind a door: a subclass is a checked, frozen dataclass and is registered under its ``type``.

    ``door``: the kind. A class without ``type`` is named ``module:Class`` in case files. ``abstract`` subclasses are neither.
    """

    door: ClassVar[str] = ""
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ()
    """Fields of objects with which the tests that its kind inherits try it."""
    type: str

    def __init_subclass__(cls, abstract: bool = False, **options: Any) -> None:
        super().__init_subclass__(**options)
        if abstract:
            return
        # A field would hide the method or property of the base class, and the solver would call a number.
        for name in vars(cls).get("__annotations__", {}):
            inherited = getattr(super(cls, cls), name, None)
            if name not in vars(cls) and (callable(inherited) or isinstance(inherited, property)):
                raise TypeError(
                    f"{cls.__name__}: {name!r} cannot be a field, every {cls.door} has it; rename the field"
                )
        if "type" not in vars(cls) and "type" not in getattr(cls, "__dataclass_fields__", {}):
            cls.type = user_type(cls)
        # Deriving registers: a decorator besides would be forgotten, an entry point would need an installation for a law in a
        # script.
        described(cls)
        DOORS[cls.door].add(cls)
