"""Heat beside a mechanical problem: conductors, initial temperature, sides that are held at one; from Python alone so far."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, ClassVar

from pydantic import Field

from prensa.model.default_elements import element_name
from prensa.model.fields import described
from prensa.model.names import Finding, suggest
from prensa.model.not_in_space import words_of
from prensa.model.units import Number
from prensa.registry import DOORS


@described
class Conductor:
    """Material that conducts heat: ``conductivity`` k (force per time and kelvin), ``capacity`` ρc (stress per kelvin).

    The capacity is that of the initial volume.
    """

    conductivity: Annotated[Number, Field(gt=0)]
    capacity: Annotated[Number, Field(gt=0)]

    offered: ClassVar[bool] = False

    @property
    def effusivity(self) -> float:
        """√(k ρc)."""
        return math.sqrt(self.conductivity * self.capacity)


@described
class Heat:
    """Conduction in all bodies, heated by friction: ``initial`` temperature, ``conductors`` by body and tool.

    Friction heat goes into the body by its share of the effusivities √(kρc) of body and tool (Carslaw & Jaeger 1959, 2.15), all
    of it where the tool is no conductor; the tool takes its share away. ``held``: boundaries at a temperature; others are
    insulated. Stresses do not depend on the temperature.
    """

    conductors: Mapping[str, Conductor]
    initial: Number
    held: Mapping[str, Number] = field(default_factory=dict)

    offered: ClassVar[bool] = False

    def share(self, body: str, tool: str) -> float:
        """Share of the friction heat between a body and a tool that goes into the body."""
        # Two half-spaces that touch share a source at their contact as their effusivities; a tool without conductor takes
        # nothing.
        own, other = self.conductors[body].effusivity, self.conductors.get(tool)
        return own / (own + (0.0 if other is None else other.effusivity))


def findings(p: Any) -> Iterator[Finding]:
    """What of a problem with heat cannot be, or is not there yet."""
    if p.heat is None:
        return
    for name in p.bodies:
        if name not in p.heat.conductors:
            yield Finding(("heat", "conductors"), f"body {name!r} has no conductor; give its conductivity and capacity")
        element: Any = DOORS["element"].find(element_name(p, name))
        if element.quadratic:
            yield Finding(("heat",), f"conduction is so far available only in linear elements, and {name!r} has {element.type!r}")
    for name in p.heat.conductors:
        if name not in p.bodies and name not in p.tools:
            known = [*p.bodies, *p.tools]
            yield Finding(("heat", "conductors", name), f"unknown body or tool {name!r}{suggest(name, known)}", at_key=True)
    if p.space not in ("plane strain", "axisymmetric"):
        words = words_of("heat") if p.space == "solid" else f"conduction is not available in {p.space} yet"
        yield Finding(("heat",), words)
    for key in ("ties", "body_contacts", "start"):
        if getattr(p, key):
            yield Finding(("heat",), f"heat does not pass through {key!r} yet; leave one of the two out")
    if p.remesh != "off":
        yield Finding(("heat",), "temperatures are not carried over to new meshes yet; use 'remesh: off'")
