"""Problems that many tests solve: each builder gives one, and a test passes what matters to it.

Blocks are rectangles whose lower left corner is the origin, in plane strain unless ``space`` is given. Every builder hands
what it does not know (``space``, ``kinematics``, ``friction``, ``loads``, ``fixed``, …) to `prensa.Problem`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import prensa as pr

ELASTIC = pr.Elastic(1000.0, 0.3)
ALUMINIUM = pr.J2(E=70e3, nu=0.33, flow=pr.Swift(K=200.0, e0=0.01, n=0.2))


def stroke(
    y: float | tuple[tuple[float, float], ...], increments: int | None = None, tool: str = "t", name: str = "press", **more: Any
) -> pr.Step:
    """A step in which a tool moves along y, to a place y from where it began, or through a table of times and places."""
    return pr.Step(name, move={tool: pr.Motion(y=y)}, increments=increments, **more)


def single_block(
    *steps: pr.Step,
    material: pr.Material = ELASTIC,
    size: tuple[float, float] = (4.0, 2.0),
    n: tuple[int, int] = (8, 4),
    origin: tuple[float, float] = (0.0, 0.0),
    mesh: Any = None,
    element: str | None = None,
    body: str = "b",
    **more: Any,
) -> pr.Problem:
    """One rectangular body, or one of another mesh, on a smooth base and free to spread to the right; without a tool."""
    mesh = mesh or pr.Rectangle(size, n, origin)
    bodies, fixed = {body: pr.Body(mesh, material, element)}, {f"{body}.bottom": "y", f"{body}.left": "x"}
    return pr.Problem(steps=steps, **{"name": "block", "bodies": bodies, "fixed": fixed} | more)


def pressed_block(
    *steps: pr.Step,
    tools: Mapping[str, pr.ToolShape] | None = None,
    plane: str = "t",
    sides: tuple[str, ...] = ("top",),
    enforcement: pr.Enforcement | None = None,
    integration: str = "nodal",
    body: str = "b",
    **more: Any,
) -> pr.Problem:
    """A block on a bonded base under ``tools``, by default a plane on its top, which is called ``plane``.

    The ``sides`` of the block are in contact with each tool, by the same ``enforcement`` (a penalty) and ``integration``.
    """
    tools = {plane: pr.Plane(touching=f"{body}.top")} if tools is None else tools
    surface, by = tuple(f"{body}.{side}" for side in sides), enforcement or pr.Penalty()
    contacts = [pr.Contact(surface, tool, enforcement=by, integration=integration) for tool in tools]
    given = {"contacts": contacts, "fixed": {f"{body}.bottom": "xy"}} | more
    return single_block(*steps, tools=tools, body=body, **given)


def upset_block(*steps: pr.Step, body: str = "b", **more: Any) -> pr.Problem:
    """The right half of a block on a smooth base, pressed as a `pressed_block` and free to spread."""
    return pressed_block(*steps, body=body, **{"fixed": {f"{body}.bottom": "y", f"{body}.left": "x"}} | more)


def upset_billet(*steps: pr.Step, **more: Any) -> pr.Problem:
    """A cylinder on a smooth base that is pressed as an `upset_block` and free to spread."""
    return upset_block(*steps, space="axisymmetric", **more)


def squeezed_block(
    *steps: pr.Step,
    tools: Mapping[str, pr.ToolShape] | None = None,
    enforcement: pr.Enforcement | None = None,
    body: str = "b",
    **more: Any,
) -> pr.Problem:
    """A block that nothing but two tools holds, by default planes that touch it: its top against the first, its bottom
    against the second.
    """
    default = {"t": pr.Plane(touching=f"{body}.top"), "table": pr.Plane(touching=f"{body}.bottom", normal=(0, 1))}
    tools, by = default if tools is None else tools, enforcement or pr.Penalty()
    sides = (f"{body}.top", f"{body}.bottom")
    contacts = [pr.Contact(side, tool, enforcement=by) for side, tool in zip(sides, tools, strict=True)]
    return single_block(*steps, tools=tools, body=body, **{"contacts": contacts, "fixed": {}} | more)


def tied_blocks(
    *steps: pr.Step,
    sizes: tuple[tuple[float, float], tuple[float, float]],
    n: tuple[tuple[int, int], tuple[int, int]],
    materials: tuple[pr.Material, pr.Material] = (ELASTIC, ELASTIC),
    names: tuple[str, str] = ("lower", "upper"),
    element: str | None = None,
    **more: Any,
) -> pr.Problem:
    """Two blocks of meshes that may not match, the first on a bonded base and the second tied on top of it."""
    below, above = names
    corners = ((0.0, 0.0), (0.0, sizes[0][1]))
    meshes = [pr.Rectangle(*mesh) for mesh in zip(sizes, n, corners)]
    bodies = {name: pr.Body(mesh, m, element) for name, mesh, m in zip(names, meshes, materials)}
    ties = (pr.Tie(f"{above}.bottom", f"{below}.top"),)
    return pr.Problem(bodies=bodies, steps=steps, **{"name": "tied", "ties": ties, "fixed": {f"{below}.bottom": "xy"}} | more)


def indented_billet(*steps: pr.Step, spring: pr.Springs | None = None, **more: Any) -> pr.Problem:
    """A punch with a fillet over an aluminium cylinder of 6 × 6 mm on a smooth plane, of T6 elements that get new meshes."""
    given = {
        "tools": {"punch": pr.Stamp(width=6.0, fillet=1.0, touching="billet.top", spring=spring)}, "space": "axisymmetric",
        "friction": pr.Coulomb(mu=0.1), "remesh": pr.Remesh(pr.Sizes(far=1.2, near_tools=0.8, per_radius=4)),
        "size": (6.0, 6.0), "n": (6, 6),
    }  # fmt: skip
    return single_block(*steps, material=ALUMINIUM, element="t6", body="billet", **given | more)


def flattened_tube(
    *steps: pr.Step, material: pr.Material, element: str, n: tuple[int, int], plane: bool = False, **more: Any
) -> pr.Problem:
    """A quarter of a tube that a plane flattens until its inside meets the line of symmetry, on which ``plane`` puts a tool."""
    tools, contacts = {"punch": pr.Plane(at=(0.0, 5.0))}, [pr.Contact("t.outer", "punch")]
    if plane:
        tools["mirror"] = pr.Plane(normal=(0.0, 1.0), at=(0.0, 0.0))
        contacts.append(pr.Contact("t", "mirror", friction=pr.Coulomb(0.0)))
    return single_block(
        *steps, tools=tools, contacts=contacts, mesh=pr.Annulus(inner=4.0, outer=5.0, n=n, angles=(0.0, math.pi / 2)),
        material=material, element=element, body="t", fixed={"t.start": "y", "t.end": "x"}, friction=pr.Coulomb(0.1), **more,
    )  # fmt: skip


def tube_quarter(
    stroke: float, *, material: pr.Material, element: str, increments: int, turned: float = 0.0, depth: float = 1.0,
    layers: int = 1, held: tuple[str, ...] = ("base", "cap"), plane: bool = False, increments_end: int | None = None, **more: Any,
) -> pr.Problem:  # fmt: skip
    """The quarter of `flattened_tube` as a body in space, turned about z; the ends ``held`` along z.

    With ``increments_end`` it stops after so many of the ``increments`` of the stroke.
    """
    share = 1.0 if increments_end is None else increments_end / increments
    x, y = -math.sin(turned) * stroke * share, math.cos(turned) * stroke * share
    section = pr.Annulus(inner=4.0, outer=5.0, n=(8, 1), angles=(turned, turned + math.pi / 2))
    down = (math.sin(turned), -math.cos(turned), 0.0)
    tools = {"punch": pr.Plane(normal=down, at=(-5.0 * down[0], -5.0 * down[1], 0.0))}
    contacts = [pr.Contact("t.outer", "punch")]
    if plane:
        tools["mirror"] = pr.Plane(normal=(-down[0], -down[1], 0.0), at=(0.0, 0.0, 0.0))
        free = [f"t.{end}" for end in ("base", "cap") if end not in held]
        contacts.append(pr.Contact(("t.inner", "t.outer", *free), "mirror", friction=pr.Coulomb(0.0)))
    sides = {"t.start": "normal", "t.end": "normal"} if turned else {"t.start": "y", "t.end": "x"}
    motion = pr.Motion(x=x, y=y) if turned else pr.Motion(y=y)
    return pr.Problem(
        "tube", space="solid", tools=tools,
        bodies={"t": pr.Body(pr.Extrusion(section, axis="z", length=depth, n=layers), material, element)},
        contacts=contacts, fixed=sides | {f"t.{end}": "z" for end in held}, friction=pr.Coulomb(0.1),
        steps=(pr.Step("flatten", by={"punch": motion}, increments=increments_end or increments),), **more,
    )  # fmt: skip


def one_side_beyond(space: str) -> pr.Problem:
    """A beam on a foot, whose free end is pressed below the line of symmetry that the foot stands on, in small strain."""
    material = pr.Elastic(1000.0, 0.3)
    points = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.05), (6.0, 0.05), (6.0, 1.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.05)]
    cells = [(0, 1, 2, 7), (7, 2, 5, 6), (2, 3, 4, 5)]
    boundaries = {"foot": (0, 1), "back": (0, 7, 6), "end": (3, 4)}
    section = pr.Points(tuple(points), tuple(cells), boundaries)
    solid = space == "solid"
    mesh = pr.Extrusion(section, axis="z", length=1.0, n=1) if solid else section
    fixed: dict[str, Any] = {"b.foot": "y", "b.back": "x"} | ({"b.base": "z", "b.cap": "z"} if solid else {})
    return pr.Problem(
        "beam", space=space, bodies={"b": pr.Body(mesh, material)}, fixed=fixed, kinematics="small",
        steps=(pr.Step("press", fixed={"b.end": {"y": -0.3}}, increments=4),),
    )  # fmt: skip


def pointed_disc(*steps: pr.Step, material: pr.Material, plane: bool = False, **more: Any) -> pr.Problem:
    """A disc with a bore whose lip is pointed and close to the axis, on which ``plane`` puts a tool."""
    return single_block(
        *steps, mesh=pr.Patch(((0.05, 0.0), (2.0, 0.0), (2.0, 0.5), (0.05, 0.1)), (4, 1)), material=material, body="d",
        tools={"mandrel": pr.Plane(normal=(1.0, 0.0), at=(0.0, 0.0))} if plane else {}, space="axisymmetric",
        fixed={"d.bottom": "y"}, **more,
    )  # fmt: skip
