"""End conditions of a step before its travel is done: forces, places and contacts to be reached, and errors in writing them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from prensa.model.feed import ends_early
from prensa.model.fields import as_names, described
from prensa.model.names import Finding, suggest
from prensa.model.tables import DRIVEN, tables_of
from prensa.model.units import Angle, Displacement, Energy, Force, Moment, Number
from prensa.precision import NEGLIGIBLE

LIMIT = "limit"
"""What stands for the limits of the damage laws of a body."""

Path: TypeAlias = tuple[str | int, ...]


@described
class ToolForce:
    """Force ``x``, ``y`` or moment ``m`` of the bodies on a tool, as in ``history.csv``; in space ``z``, ``mx``, ``my``, ``mz``.

    A punch that presses down feels a positive ``y``. In plane problems of the whole ``thickness``, in axisymmetry of the
    whole circumference.
    """

    x: Force | None = None
    y: Force | None = None
    m: Moment | None = None
    z: Force | None = None
    mx: Moment | None = None
    my: Moment | None = None
    mz: Moment | None = None


@described
class ToolTravel:
    """Displacement ``x``, ``y`` of a tool from its initial place, and rotation ``rz``, counter-clockwise, as in ``history.csv``.

    In space ``z``, ``rx`` and ``ry`` too.
    """

    x: Displacement | None = None
    y: Displacement | None = None
    rz: Angle | None = None
    z: Displacement | None = None
    rx: Angle | None = None
    ry: Angle | None = None


TOOL_COMPONENTS = {
    "force": {2: ("x", "y", "m"), 3: ("x", "y", "z", "mx", "my", "mz")},
    "travel": {2: ("x", "y", "rz"), 3: ("x", "y", "z", "rx", "ry", "rz")},
}
"""Of a tool's force and displacement by the dimension of space, in the order of its degrees of freedom."""


def _spelled_out(value: Any) -> Any:
    """The words of contact: YAML has none of its own for them."""
    return value.strip().lower() if isinstance(value, str) else value


Touch = Annotated[Literal["touches", "leaves"], BeforeValidator(_spelled_out)]


def _amount_kind(value: Any) -> str:
    return "text" if isinstance(value, str) else "number"


Amount = Annotated[Annotated[Number, Tag("number")] | Annotated[str, Tag("text")], Discriminator(_amount_kind)]


@described
class Until:
    """A step ends exactly where the first of these is reached, and the next one continues from that state.

    ``force``, ``travel``: what a tool's force or displacement reaches, from whichever side it comes; ``contact``: a tool or a
    contact (``<surface>-<tool>``) that ``touches`` for the first time in the step, or ``leaves``; ``energy``: the work that a
    tool does in the step, as in the blow of a hammer; ``press``: tools whose press reaches its limit; ``measure``: any number of
    an increment by its name, a column of ``history.csv`` or a measure such as ``billet.height``, with a number in the units of
    the case or a text such as ``12 mm``; ``damage``: by body the largest damage that it reaches, a number where it has one
    damage law, or ``limit`` for the limit of each of its laws. A step in which none of them is met runs to its end, which is
    reported (except for a press); with ``required`` that is an error.
    """

    force: Mapping[str, ToolForce] = field(default_factory=dict)
    travel: Mapping[str, ToolTravel] = field(default_factory=dict)
    contact: Mapping[str, Touch] = field(default_factory=dict)
    energy: Mapping[str, Annotated[Energy, Field(gt=0)]] = field(default_factory=dict)
    press: Annotated[tuple[str, ...], BeforeValidator(as_names)] = ()
    measure: Mapping[str, Amount] = field(default_factory=dict)
    damage: Mapping[str, Amount] = field(default_factory=dict)
    required: bool = False

    @model_validator(mode="after")
    def _check(self) -> Until:
        if not self.measure and not self.damage and not any(True for _ in self.criteria()):
            example = "{force: {punch: {y: 2000}}}"
            kinds = "a force, a travel, a contact, an energy, a press, a damage or a measure"
            raise ValueError(f"nothing to wait for; give {kinds}, like {example}")
        return self

    def criteria(self) -> Iterator[tuple[str, str, str, Any]]:
        """Kind, name, component ('' of a contact) and target of each but measures, in the order of the description."""
        for kind in TOOL_COMPONENTS:
            for name, target in getattr(self, kind).items():
                yield from ((kind, name, key, v) for key, v in vars(target).items() if v is not None)
        yield from (("contact", name, "", word) for name, word in self.contact.items())
        yield from (("energy", name, "", energy) for name, energy in self.energy.items())
        yield from (("press", name, "", 1.0) for name in self.press)


def reached(kind: str, name: str, key: str) -> str:
    """What is reported of a force, a travel, a work or a press of a tool that is reached, up to the number."""
    what = {"energy": "work", "press": "press utilisation"}.get(kind, f"{kind} {key}")
    return f"the {what} of tool {name!r} has reached"


# ------------------------------------------------------------------------------------------------------- what is wrong
def findings(p: Any, step: Any, path: Path) -> Iterator[Finding]:
    """What is wrong with the names in ``until`` of a step of a problem."""
    until = step.until
    if until is None:
        return
    for kind in ("force", "travel"):
        for name, target in getattr(until, kind).items():
            here = (*path, "until", kind, name)
            if name not in p.tools:
                yield Finding(here, f"unknown tool {name!r}{suggest(name, p.tools)}", at_key=True)
            elif all(value is None for value in vars(target).values()):
                yield Finding(here, f"{kind} of tool {name!r} has no component; give x, y or a turn")
            else:
                yield from _other_space(p, target, kind, here)
            if name in p.tools and p.space == "axisymmetric":
                for key in ("x", "m", "rz"):
                    if getattr(target, key, None) is not None:
                        yield Finding((*here, key), "in axisymmetry a tool moves along y only", at_key=True)
    yield from _damage(p, until, (*path, "until", "damage"))
    contacts = [c.name for c in (*p.contacts, *p.body_contacts) if c is not None]
    for name in until.contact:
        if name not in p.tools and name not in contacts and None not in p.contacts:
            message = f"unknown tool or contact {name!r}{suggest(name, [*p.tools, *contacts])}"
            yield Finding((*path, "until", "contact", name), message, at_key=True)
        elif name in p.tools and None not in p.contacts and not any(c.against == name for c in p.contacts):
            yield Finding((*path, "until", "contact", name), f"tool {name!r} has no contact that it could make or lose")


def _other_space(p: Any, target: Any, kind: str, path: Path) -> Iterator[Finding]:
    """Components of a tool that it has not in the space of a problem."""
    known = TOOL_COMPONENTS[kind][3 if p.space == "solid" else 2]
    for key, value in vars(target).items():
        if value is not None and key not in known and p.space is not None:
            where = "space" if p.space == "solid" else "the plane"
            yield Finding((*path, key), f"in {where} the {kind} of a tool has {', '.join(known)}, not {key!r}", at_key=True)


def _damage(p: Any, until: Any, path: Path) -> Iterator[Finding]:
    """What is wrong with the damages that end a step."""
    for name, value in until.damage.items():
        here = (*path, name)
        if name not in p.bodies:
            yield Finding(here, f"unknown body {name!r}{suggest(name, p.bodies)}", at_key=True)
        elif p.bodies[name] is None:
            continue
        elif not (laws := p.bodies[name].damage):
            remedy = "give it one, like 'damage: {type: cockcroft_latham, limit: 0.4}'"
            yield Finding(here, f"body {name!r} has no damage law to reach a limit; {remedy}", at_key=True)
        elif value == LIMIT and all(law.limit is None for law in laws):
            yield Finding(here, f"no damage law of body {name!r} has a limit; give it one, or write a number here")
        elif value != LIMIT and len(laws) > 1:
            other = f"'limit', or a measure, like {{{name}.max.damage.{laws[0].name}: …}}"
            yield Finding(here, f"body {name!r} has {len(laws)} damage laws, of which a number says none; write {other}")
        elif not isinstance(value, str) and not value > 0.0:
            yield Finding(here, not_positive(name, value))


def not_positive(body: str, value: Any) -> str:
    """What is wrong with a damage that a body has before anything is solved."""
    given = value if isinstance(value, str) else f"{value:g}"
    return (
        f"the damage of {body!r} that ends the step is {given}, and damage begins at 0: it must be greater than 0; give the "
        f"damage at which metal cracks, or {LIMIT!r} for the limit of its law"
    )


def tables_beyond(p: Any) -> Iterator[Finding]:
    """Tables in global time that go on where a step may have ended early: the time between is left out.

    And tables of ``move``, measured from the initial place, of tools that an early end leaves wherever they are.
    """
    open_ended = [i for i, step in enumerate(p.steps) if step is not None and ends_early(step)]
    if not open_ended:
        return
    for prefix, owner, first in [((), p, 0), *((("steps", i), s, i) for i, s in enumerate(p.steps) if s is not None)]:
        for path, table in tables_of(owner):
            over = next((i for i in open_ended if i >= first and table[-1][0] > i + 1 + NEGLIGIBLE), None)
            if over is not None:
                yield Finding(
                    (*prefix, *path),
                    f"the table continues after time {over + 1}, but step {p.steps[over].name!r} may end before it, which would "
                    f"make the table jump; end it at {over + 1} and continue in a later step",
                )
    yield from _moved_tables(p)


def _moved_tables(p: Any) -> Iterator[Finding]:
    """Tables of ``move`` and ``fixed`` of what an earlier step with ``until`` was moving when it ended."""
    anywhere: dict[tuple[str, str], str] = {}
    for i, step in enumerate(p.steps):
        if step is None:
            return
        for kind in ("move", "fixed"):
            for name, motion in getattr(step, kind).items():
                for key in ("x", "y", "z", "rz"):
                    value = getattr(motion, key, None) if motion is not None else None
                    if isinstance(value, tuple) and (name, key) in anywhere:
                        yield Finding(
                            ("steps", i, kind, name, key),
                            f"the table is measured from the initial place, and {name!r} is wherever step "
                            f"{anywhere[name, key]!r} ended; measure it from there with 'by', or give a number",
                        )
        moved = {
            (name, "rz" if key == "m" else key)
            for kind in (*DRIVEN, "fixed")
            for name, motion in getattr(step, kind).items()
            for key in ("x", "y", "z", "rz", "m")
            if motion is not None and getattr(motion, key, None) not in (None, "held")
        }
        if ends_early(step):
            anywhere |= dict.fromkeys(moved, step.name)
        else:  # a number or a table says where the tool ends
            said = {(n, k) for n, k in moved if getattr(step.move.get(n, step.fixed.get(n)), k, None) is not None}
            anywhere = {key: name for key, name in anywhere.items() if key not in said}
