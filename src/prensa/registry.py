"""The doors for laws: every kind of law has one registry from its ``type`` to its class.

A law is one file in the package of its kind: the class that describes it, its checks and its numbers. It is found there by
the case file, Python (``prensa.Coulomb``), the reference page, the command line and the tests that every law inherits;
nothing else lists it. A user's law stands in the user's script, or in a case file as ``my_module:MyLaw``.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

_T = TypeVar("_T")


@dataclass
class Door:
    """One kind of law: ``package`` whose modules hold its members; ``base`` (module:class) of users' laws.

    ``default``: type that is meant where a mapping gives none; None where it must be given. ``named``: members have no
    fields, a case file gives their type alone, and Python too.
    """

    kind: str
    package: str
    base: str
    default: str | None = None
    named: bool = False
    _members: dict[str, type] = field(default_factory=dict)
    _loaded: bool = False

    def members(self) -> dict[str, type]:
        """Classes by type, of the package and of whoever registered more; modules are imported when first asked for."""
        if not self._loaded:
            self._loaded = True
            package = importlib.import_module(self.package)
            for module in pkgutil.iter_modules(package.__path__):
                importlib.import_module(f"{self.package}.{module.name}")
        return dict(self._members)

    def own(self) -> dict[str, type]:
        """Members that come with prensa, in alphabetical order of their modules."""
        own = [(name, cls) for name, cls in self.members().items() if cls.__module__.startswith(f"{self.package}.")]
        return dict(sorted(own, key=lambda item: item[1].__module__))

    def add(self, cls: type[_T]) -> type[_T]:
        """Register a class under its ``type``.

        Raises
        ------
        ValueError
            If another class has that type.

        """
        name = str(getattr(cls, "type", "") or user_type(cls))
        known = self._members.get(name)
        if known is not None and (known.__module__, known.__qualname__) != (cls.__module__, cls.__qualname__):
            raise ValueError(f"two {self.kind} classes have the type {name!r}: {known.__module__} and {cls.__module__}")
        self._members[name] = cls
        return cls

    def base_class(self) -> type:
        """The class that users' laws of this kind derive from."""
        module, _, name = self.base.partition(":")
        return getattr(importlib.import_module(module), name)

    def find(self, name: str, folder: str | Path | None = None) -> type:
        """The class of a type; ``module:Name`` is imported, a file ``module.py`` in *folder* before installed modules.

        Raises
        ------
        ValueError
            If there is none, in words that say what is wrong.

        """
        if name in self.members():
            return self._members[name]
        path, colon, attribute = name.rpartition(":")
        if not colon or not path or not attribute:
            raise ValueError(f"unknown {self.kind} {name!r}; known: {', '.join(map(repr, self.members()))}")
        cls = getattr(_module(path, folder), attribute, None)
        if not isinstance(cls, type):
            raise ValueError(f"{path!r} has no class {attribute!r}")
        if not issubclass(cls, self.base_class()):
            raise ValueError(f"{name!r} is not a valid {self.kind}: it must derive from prensa.{self.base_class().__name__}")
        return cls


def user_type(cls: type) -> str:
    """``module:Name``, the type by which a case file names a class that has none of its own."""
    module = sys.modules.get(cls.__module__)
    file = getattr(module, "__file__", None)
    by_path = getattr(module, "__prensa_path__", None)
    return f"{by_path or (Path(file).stem if cls.__module__ == '__main__' and file else cls.__module__)}:{cls.__name__}"


def _module(path: str, folder: str | Path | None) -> ModuleType:
    """A user's module: the file *path*.py beside the case (or at the absolute path that a dump wrote), or one installed."""
    file = Path(path) if path.endswith(".py") else Path(folder or ".") / (path.replace(".", "/") + ".py")
    try:
        there = file.is_file()
    except (OSError, ValueError):  # a name that no file can have
        there = False
    if there:
        place = str(file.resolve())
        name = f"_prensa_user_{abs(hash(place)):x}"
        if name in sys.modules:
            return sys.modules[name]
        spec = importlib.util.spec_from_file_location(name, place)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        module.__prensa_path__ = place  # type: ignore[attr-defined]
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            del sys.modules[name]
            raise ValueError(f"{place}: {type(error).__name__}: {error}") from error
        return module
    try:
        return importlib.import_module(path)
    except Exception as error:
        beside = (
            f" (there is no {file.name!r} next to the case either)" if isinstance(error, ModuleNotFoundError) else ""
        )
        raise ValueError(f"cannot import {path!r}: {error}{beside}") from error


DOORS = {
    door.kind: door
    for door in (
        Door("friction", "prensa.friction.laws", "prensa.friction.law:FrictionLaw", "coulomb"),
        Door("element", "prensa.elements.kinds", "prensa.elements.element:Element", named=True),
        Door("integration rule", "prensa.contact.rules", "prensa.contact.rule:IntegrationRule", named=True),
        Door("enforcement", "prensa.contact.enforcement", "prensa.contact.method:Enforcement"),
        Door("tool", "prensa.tools.shapes", "prensa.tools.tool:ToolShape"),
        Door("flow", "prensa.materials.flow", "prensa.materials.flow_curve:FlowCurve"),
        Door("damage", "prensa.materials.damage", "prensa.materials.damage_law:DamageLaw"),
        Door("wear", "prensa.friction.wear", "prensa.friction.wear_law:WearLaw", "archard"),
        Door("material", "prensa.materials.solids", "prensa.materials.material:Material"),
    )
}


def member(kind: str) -> Callable[[type[_T]], type[_T]]:
    """Class decorator: register it at the door of its kind."""
    return DOORS[kind].add


def examples(kind: str) -> dict[str, Any]:
    """Objects that the members of a kind give as examples, by type and number, for the tests that they inherit."""
    return {
        f"{name} {number}": cls(**fields)
        for name, cls in DOORS[kind].own().items()
        for number, fields in enumerate(getattr(cls, "examples", ()))
    }


def public(*kinds: str) -> Iterator[tuple[str, type]]:
    """Names under which ``prensa`` offers the classes of its laws (of all kinds), and what their modules offer beside them."""
    for kind in kinds or (kind for kind, door in DOORS.items() if not door.named):
        for cls in DOORS[kind].own().values():
            module = sys.modules[cls.__module__]
            yield from ((name, getattr(module, name)) for name in getattr(module, "__all__", [cls.__name__]))
