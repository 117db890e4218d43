"""Remeshing: a mesher that is missing, sizes that no mesh can have, supports that new meshes do not keep."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from prensa.errors import Finding, Severity
from prensa.mesh.triangulate import NO_MESHER, has_mesher
from prensa.model import problem as model
from prensa.model.meshes import MOST_ELEMENTS
from prensa.model.remeshing import remeshing_of
from prensa.system.element_sizes import elements_asked, section_area, size_field
from prensa.system.moments import stages
from prensa.system.system import System

ADVISED_SIZE = 0.02
"""Size of elements over the width of their body that is advised where one was likely given in another unit."""
POINT_INSIDE = "the point lies inside the body, where remeshing keeps no node; support a side or a corner"


def new_meshes(system: System) -> Iterator[Finding]:
    """The mesher that is asked for and not installed, sizes that ask for more elements than there can be, and a first mesh with
    points inside that no new mesh keeps.
    """
    asked = remeshing_of(system.problem)
    if asked is None:
        return
    if not has_mesher():
        yield Finding("remesh", NO_MESHER, Severity.REFUSE)
    for body, mesh in system.meshes.items():
        count, key = elements_asked(system, body)
        count = min(count, np.finfo(np.float64).max)  # of sizes as small as numbers are
        if system.problem.bodies[body].material.plastic and count > MOST_ELEMENTS:
            width, most = section_area(system, body) ** 0.5, f"{MOST_ELEMENTS:,}".replace(",", " ")
            yield Finding(
                f"remesh.size.{key}" if getattr(asked.size, key) is not None else "remesh.size",
                f"it asks for {count:.1e} elements of body {body!r}, whose section is about {width:.3g} wide; a body "
                f"has {most} at most: write {ADVISED_SIZE * width:.2g}, say, or leave it out",
                Severity.REFUSE,
            )
        outline = mesh.boundary
        for name, node in mesh.corners.items():
            if node in outline:
                continue
            for prefix, source in _with_supports(system.problem):
                if f"{body}.{name}" in source.fixed:
                    yield Finding(f"{prefix}fixed.{body}.{name}", POINT_INSIDE, Severity.REFUSE)


def _with_supports(problem: model.Problem) -> list[tuple[str, model.Problem | model.Step]]:
    """The problem and its steps, with the path to what they hold."""
    return [("", problem), *((f"steps.{k}.", step) for k, step in enumerate(problem.steps))]


def new_sizes(system: System) -> Iterator[Finding]:
    """Sizes of new meshes beside the body, its tools and what is moved."""
    asked = remeshing_of(system.problem)
    if asked is None:
        return
    for body in (b.body for b in system.blocks if b.law.plastic):
        sizes = size_field(system, system.initial(), body, asked.size, section_area(system, body))
        width = sizes.area**0.5
        if asked.size.far is not None and asked.size.far > width:
            yield Finding(
                "remesh.size.far",
                f"elements of {asked.size.far:g} in body {body!r}, whose section is about {width:.3g} wide: 'far' is the size of "
                f"an element; write {width / 12:.2g}, or leave it out",
            )
            continue
        for name in dict.fromkeys(s.against for s in system.tool_contacts if s.body == body):
            given = getattr(system.problem.tools[name], "fillet", None)
            radii = [r for r in (given if isinstance(given, tuple) else (given,)) if r]
            arc = 0.5 * np.pi * min(radii, default=np.inf)
            if arc < sizes.least:
                yield Finding(
                    f"tools.{name}.fillet",
                    f"a quarter of a circle of radius {min(radii):g} is {arc:.2g} long, and new meshes have no elements "
                    f"smaller than {sizes.least:.2g}: the fillet is not resolved; give it {sizes.least:.2g} or more, "
                    f"or 'remesh.size.least: {arc / asked.size.per_radius:.1g}'",
                )
    travel = asked.when.travel
    if isinstance(travel, float):
        way = _longest_way(system)
        if way > travel * asked.at_most > 0.0:
            yield Finding(
                "remesh.when.travel",
                f"a new mesh after each {travel:g} of a travel of {way:.4g} makes {way / travel:.3g} meshes, and 'at_most' "
                f"allows {asked.at_most}; is the unit right? Without it bodies are remeshed where it pays",
            )


def _longest_way(system: System) -> float:
    """The longest of the ways that the steps prescribe to the tools, from the beginning of each step straight to its end."""
    gone = np.zeros(len(system.tools))
    for stage in stages(system):
        for t in range(len(gone)):
            gone[t] += np.hypot(*(system.place_of(t, stage.end) - system.place_of(t, stage.start))[:2])
    return float(gone.max(initial=0.0))
