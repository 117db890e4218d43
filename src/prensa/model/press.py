"""The press that drives a tool: its capacity, how much of that a tool needs, and errors in writing it."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, ValidationInfo, model_validator

from prensa.model.fields import as_names, as_table, described, value_kind
from prensa.model.names import Finding, suggest
from prensa.model.seconds import duration_of
from prensa.model.tables import DRIVEN, read_columns
from prensa.model.units import FORCE, LENGTH, Displacement, Energy, Force, Moment
from prensa.precision import NEGLIGIBLE

OPPOSITE_SIDES = {"x": ("left", "right"), "y": ("bottom", "top"), "z": ("back", "front")}
IMAGES_BESIDE = {a: tuple(s for other, pair in OPPOSITE_SIDES.items() if other != a for s in pair) for a in OPPOSITE_SIDES}
"""Sides along which an axis lies: a mirror image there doubles the force along it; across it doubles the stroke."""


CRANK_ACROSS = "the crank moves the model's tool, not its mirror image: model the whole height, or give 'capacity' by stroke"
"""What is wrong with a plane of symmetry across the way of a crank."""


def mirrored_side(value: str) -> str:
    """An end of the bodies, or the side of a body by its name."""
    ends = tuple(end for pair in OPPOSITE_SIDES.values() for end in pair)
    if value not in ends and not all(value.partition(".")[::2]):
        listed = ", ".join(map(repr, ends))
        raise ValueError(f"{value!r} is no side; write {listed}, or the flat side of a body, such as 'ring.cap'")
    return value


def unknown_bodies(p: Any, mirror: tuple[str, ...], path: tuple[str | int, ...]) -> Iterator[Finding]:
    """Sides of bodies that there are not, among those that ``mirror`` at a path names."""
    for k, side in enumerate(mirror):
        body, dot, _ = side.partition(".")
        if dot and body not in p.bodies:
            where = ".".join(map(str, path))
            yield Finding((*path, k), f"{where!r} names {side!r}: unknown body {body!r}{suggest(body, p.bodies)}")


def _of_file(value: Any, info: ValidationInfo) -> Any:
    """The rows of a CSV file, where one is named in the place of a force."""
    if not isinstance(value, str) or value.strip()[:1] in ("", *"+-.0123456789"):
        return as_table(value)
    return tuple(read_columns(value, info.context, "capacity curve", (("stroke", LENGTH), ("force", FORCE))))


if TYPE_CHECKING:  # a type checker cannot follow the alternatives
    Capacity: TypeAlias = float | tuple[tuple[float, float], ...]
else:
    Capacity = Annotated[
        Annotated[Force, Field(gt=0), Tag("number")]
        | Annotated[tuple[tuple[Displacement, Annotated[Force, Field(gt=0)]], ...], Field(min_length=2), Tag("table")],
        Discriminator(value_kind),
        BeforeValidator(_of_file),
    ]


@described
class Press:
    """The press behind a tool: every increment has its ``press_utilisation``, 1 where the press is at its limit.

    ``capacity``: the largest force, a number, a table of strokes and forces (strokes from the initial place of the tool, linear
    between) or the name of a CSV file of them. ``torque``: of the crank shaft of a mechanical press, whose tool the steps drive
    by ``crank``; it allows the force torque / (way of the slide per angle of the crank). ``energy``: of one blow of a hammer or
    a screw press: the work of the tool in a step. Capacities and energies are those of the machine, for the whole part:
    ``mirror`` names the planes of symmetry of the part that is modelled, as ``mirror`` of the output does. A step ends
    where the press reaches its limit with ``until: {press: TOOL}``; otherwise the run continues, and its answer says so.
    """

    capacity: Capacity | None = None
    torque: Annotated[Moment, Field(gt=0)] | None = None
    energy: Annotated[Energy, Field(gt=0)] | None = None
    mirror: Annotated[tuple[Annotated[str, AfterValidator(mirrored_side)], ...], BeforeValidator(as_names)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Press:
        if self.capacity is self.torque is self.energy is None:
            raise ValueError("a press needs a limit: 'capacity' (such as 400 kN), 'torque' or 'energy'")
        if isinstance(self.capacity, tuple):
            strokes = [s for s, _ in self.capacity]
            if any(b <= a for a, b in pairwise(strokes)):
                raise ValueError("the strokes of 'capacity' must increase strictly")
            if strokes[0] > 0.0:
                raise ValueError(f"'capacity' begins at a stroke of {strokes[0]:g}; give it from 0 on, the tool's first place")
        for pair in OPPOSITE_SIDES.values():
            if sum(side in pair for side in self.mirror or ()) > 1:
                raise ValueError(f"'mirror' names one side of {pair[0]!r} and {pair[1]!r} at most, once")
        return self

    def force(self, stroke: float) -> float:
        """Capacity at a stroke; beyond its table that of its end, infinite without one."""
        if not isinstance(self.capacity, tuple):
            return math.inf if self.capacity is None else self.capacity
        k = bisect_right([s for s, _ in self.capacity], stroke)
        if k in (0, len(self.capacity)):
            return self.capacity[max(k - 1, 0)][1]
        (a, f), (b, g) = self.capacity[k - 1 : k + 1]
        return f + (g - f) * (stroke - a) / (b - a)


def _spelled_out(value: Any) -> Any:
    """A number, a text or a table alone is the capacity."""
    alone = isinstance(value, str | int | float | list | tuple) and not isinstance(value, bool)
    return {"capacity": value} if alone else value


PressValue = Annotated[Press, BeforeValidator(_spelled_out)]


# ---------------------------------------------------------------------------------------------------------- what is used
@dataclass(frozen=True)
class Use:
    """How the press of a tool is used in a problem.

    ``axis``: along which the steps drive the tool: x, y, z or some of them; ``forces``, ``strokes``, ``energies``: those of the
    whole part, over those of the model.
    """

    press: Press
    tool: str
    steps: tuple[Any, ...]
    axis: str
    forces: int
    strokes: int
    energies: int

    def along(self, *vector: float) -> float:
        """Size of a vector (d,) along the axis."""
        return math.hypot(*(v if axis in self.axis else 0.0 for axis, v in zip("xyz", vector)))

    def force(self, *force: float) -> float:
        """Force on the press when the model's tool has one of d components."""
        return self.forces * self.along(*force)

    def stroke(self, *way: float) -> float:
        """Way of the press from the first place of the tool, whose displacement has d components."""
        return self.strokes * self.along(*way)

    def capacity(self, stroke: float, time: float, number: int) -> float:
        """Capacity at a stroke and a time of step *number* (from 0); infinite where nothing limits it.

        Of a crank by virtual work, torque × turn = force × way (its friction left out), where a step turns it.
        """
        most, crank = self.press.force(stroke), self.steps[number].crank.get(self.tool)
        if self.press.torque is None or crank is None:
            return most
        share = min(max(time - number, 0.0), 1.0)
        lever = abs(crank.lever(crank.first + share * (crank.end - crank.first)))
        return min(most, self.press.torque / lever) if lever > 0.0 else most

    def energy(self, number: int) -> float:
        """Energy of the blow of step *number* (from 0): what the step waits for, else that of the press; infinite without."""
        until = self.steps[number].until
        asked = None if until is None else until.energy.get(self.tool)
        given = self.press.energy if asked is None else asked
        return math.inf if given is None else given

    def utilisation(
        self, force: tuple[float, ...], place: tuple[float, ...], work: float, time: float, number: int
    ) -> float:  # fmt: skip
        """The largest share of its limits that is used, at a time of step *number* (from 0).

        ``force`` and ``place`` of the model's tool along the axes, its ``work`` in the step.
        """
        of_force = self.force(*force) / self.capacity(self.stroke(*place), time, number)
        # a tool that springs back gives work to the press, which uses nothing of it
        return max(of_force, self.energies * work / self.energy(number), 0.0)


def driven_along(p: Any, tool: str) -> str:
    """Axes along which steps drive a tool: x, y, in space z, some of them, or nothing; in axisymmetry y, if any."""
    return "".join(axis for axis in "xyz" if any(drives(step, tool, axis) for step in p.steps if step is not None))


def drives(step: Any, tool: str, axis: str, kinds: tuple[str, ...] = DRIVEN) -> bool:
    """Whether a step drives a tool along an axis, in one of some ways."""
    return any(getattr(getattr(step, kind, {}).get(tool), axis, None) is not None for kind in kinds)


def works(p: Any) -> list[str]:
    """Tools whose work in a step is asked for: those whose press has an energy, and those that steps wait for."""
    asked = {name for step in p.steps if step.until is not None for name in step.until.energy}
    return [name for name, tool in p.tools.items() if name in asked or (tool.press is not None and tool.press.energy is not None)]


# --------------------------------------------------------------------------------------------------------- what is wrong
def findings(p: Any) -> Iterator[Finding]:
    """What is wrong with the presses of a problem, and with what its steps ask of them."""
    whole = None not in p.steps
    for name, tool in p.tools.items():
        if tool is None or tool.press is None:
            continue
        path = ("tools", name, "press")
        if p.space in ("plane strain", "plane stress") and p.thickness == 1.0:
            message = "a press forms the whole part, and forces here are per length: give 'thickness', how long the part is"
            message += "" if "space" in p.stated else ", or 'space: axisymmetric' of a round part"
            yield Finding(path, message)
        if whole:
            yield from _driven(p, path, name, tool.press)
    for i, step in enumerate(p.steps):
        if step is not None and step.until is not None:
            yield from _awaited(p, ("steps", i, "until"), step)


def _driven(p: Any, path: tuple[str | int, ...], name: str, press: Press) -> Iterator[Finding]:
    """What does not go with the motion of the tool."""
    axis = driven_along(p, name)
    if not axis:
        along = "x, y or z" if p.space == "solid" else "x or y"
        yield Finding(path, f"no step drives tool {name!r} along {along}: the press belongs to the tool that it drives")
        return
    yield from unknown_bodies(p, press.mirror or (), (*path, "mirror"))
    if press.mirror and p.space == "axisymmetric" and {"left", "right"} & set(press.mirror):
        yield Finding((*path, "mirror"), "in axisymmetry the axis mirrors, forces are of the whole circumference: leave it out")
    elif press.mirror and len(axis) > 1:
        ways = " and ".join(axis)
        message = f"tool {name!r} is driven along {ways}: mirror images are of a press along one of them; model the whole part"
        yield Finding((*path, "mirror"), message)
    elif p.space != "solid" and {"back", "front"} & set(press.mirror or ()):
        yield Finding((*path, "mirror"), "'back' and 'front' are sides of 'space: solid'")
    if press.torque is not None:
        yield from _turned(p, path, name, press, axis)
    if isinstance(press.capacity, tuple):
        yield from _long_enough(p, (*path, "capacity"), name, press, axis)
    for i, step in enumerate(p.steps):
        awaited = step.until is not None and name in step.until.energy
        if (press.energy is not None or awaited) and any(drives(step, name, a, ("push",)) for a in axis):
            yield _pushed(("steps", i, "push", name), name)


def _pushed(path: tuple[str | int, ...], name: str) -> Finding:
    message = (
        f"a given force and the energy of a blow contradict each other: move {name!r} instead ('by'), as far as it may go at most"
    )
    return Finding(path, message, at_key=True)


def _turned(p: Any, path: tuple[str | int, ...], name: str, press: Press, axis: str) -> Iterator[Finding]:
    """A torque that no crank turns into a force."""
    by_others = (*(kind for kind in DRIVEN if kind != "crank"),)
    for i, step in enumerate(p.steps):
        kind = next((k for k in by_others for a in axis if drives(step, name, a, (k,))), None)
        if kind is not None:
            message = f"the press has a 'torque', whose force follows from the angle of a crank: drive {name!r} by 'crank' here"
            yield Finding(("steps", i, kind, name), message, at_key=True)
    if _ends_across(press, axis):
        yield Finding((*path, "mirror"), CRANK_ACROSS)


def _ends_across(press: Press, axis: str) -> list[str]:
    """Ends of the bodies that a press mirrors and that do not lie along its way; of flat sides by name nothing is known here."""
    return [side for side in press.mirror or () if "." not in side and side not in IMAGES_BESIDE.get(axis, ())]


def _long_enough(p: Any, path: tuple[str | int, ...], name: str, press: Press, axis: str) -> Iterator[Finding]:
    """A capacity curve that ends before the stroke does."""
    assert isinstance(press.capacity, tuple)
    end = press.capacity[-1][0]
    across = len(_ends_across(press, axis))
    at = dict.fromkeys(axis, 0.0)
    for i, step in enumerate(p.steps):
        if any(drives(step, name, a, ("push",)) and not drives(step, name, a, ("control",)) for a in axis):
            message = f"how far 'push' brings {name!r} is not known before: give its press one number as 'capacity', or move it"
            yield Finding(("steps", i, "push", name), message, at_key=True)
            return
        most = {a: _farthest(step, name, a, at) for a in axis}
        if (far := 2**across * math.hypot(*most.values())) > end * (1.0 + NEGLIGIBLE):
            message = (
                f"the capacity curve ends at a stroke of {end:g}, and step {step.name!r} goes to {far:g}: give it up to "
                "there, or a shorter way"
            )
            yield Finding(path, message)
            return


def _farthest(step: Any, tool: str, axis: str, at: dict[str, float]) -> float:
    """How far a tool comes from its first place along an axis in a step, which moves it from where it is ``at``."""
    before = at[axis]
    passed = [before]
    for kind in ("move", "by", "control", "velocity"):
        value = getattr(getattr(step, kind).get(tool), axis, None)
        if value is None:
            continue
        start, times = (0.0, 1.0) if kind == "move" else (before, duration_of(step) if kind == "velocity" else 1.0)
        if isinstance(value, tuple) and kind == "velocity":
            for (t, v), (u, w) in pairwise(value):
                passed.append(passed[-1] + 0.5 * (v + w) * (u - t) * times)
        elif isinstance(value, tuple):
            passed += [start + v for _, v in value]
        else:
            passed.append(start + value * times)
    crank = step.crank.get(tool)
    if crank is not None and getattr(crank, axis) is not None:
        passed += [before + crank.way(share) for share in (crank.dead_centre or 1.0, 1.0)]
    at[axis] = passed[-1]
    return max(map(abs, passed))


def _awaited(p: Any, path: tuple[str | int, ...], step: Any) -> Iterator[Finding]:
    """Presses and energies that ``until`` of a step names."""
    for k, name in enumerate(step.until.press):
        tool = p.tools.get(name)
        if name not in p.tools:
            yield Finding((*path, "press", k), f"unknown tool {name!r}{suggest(name, p.tools)}")
        elif tool is not None and tool.press is None:
            yield Finding((*path, "press", k), f"tool {name!r} has no press; give it one, such as 'press: 400 kN'")
    for name, energy in step.until.energy.items():
        here, tool = (*path, "energy", name), p.tools.get(name)
        if name not in p.tools:
            yield Finding(here, f"unknown tool {name!r}{suggest(name, p.tools)}", at_key=True)
            continue
        if tool is not None and tool.press is not None and energy > (tool.press.energy or math.inf):
            has = f"the press of {name!r} has an energy of {tool.press.energy:g}"
            yield Finding(here, f"{has}, and the blow asks for {energy:g}: ask for less, or give several blows")
        driven = any(drives(step, name, a) for a in ("x", "y", "z", "rx", "ry", "rz"))
        if not driven:
            yield Finding(here, f"the step does not move tool {name!r}, which does no work then: move it ('by')", at_key=True)
        elif (tool is None or tool.press is None) and any(drives(step, name, a, ("push",)) for a in "xyz"):
            yield _pushed((*path[:2], "push", name), name)
