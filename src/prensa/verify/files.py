"""Meshes made elsewhere: example 1 and problems with friction on gmsh files and Abaqus decks, in elements of every kind.

The meshes are in ``meshes/``: ``.geo`` scripts and what gmsh made of them without any structure, and decks in the layout of
Abaqus/CAE (parts, sets, surfaces, an assembly), in metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib import resources

import prensa as pr
from prensa.reference import layer_line, tables
from prensa.verify import example1, forming, friction
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row


def mesh(name: str) -> pr.File:
    """A mesh of this package; the decks are in metres."""
    path = resources.files("prensa.verify").joinpath("meshes", name)
    return pr.File(str(path), unit="m" if name.endswith(".inp") else None)


def block(name: str, element: str | None, E_scale: float) -> pr.Problem:
    """Example 1, linear Signorini, on the mesh of a file."""
    material = pr.Elastic(E=example1.E * E_scale, nu=example1.NU)
    steps = tuple(example1.press(d) for d in tables.EXAMPLE1_DELTA)
    problem = example1.problem((1, 1), "small", "reference", material, steps)
    return replace(problem, bodies={"block": pr.Body(mesh(name), material, element)})


@case("example 1 on meshes of files", suite="contact")
def example_1(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A thousand quadrilaterals of gmsh or of an Abaqus deck, as they are and as T6 and Q8, give the block's force and width."""
    balance = Balance()
    for name, element in (("block.msh", None), ("block.inp", None), ("block.msh", "t6"), ("block.inp", "q8")):
        what = f"{name}, {element or 'q4_fbar'}"
        increments = balance.watch(block(name, element, E_scale))
        for inc, d, P in zip(increments, tables.EXAMPLE1_DELTA, tables.EXAMPLE1_FORCE_REFERENCE_GEOMETRY, strict=True):
            yield row(f"{what}: P at δ = {d:g}", P, example1.force(inc), 0.002)
            layer = layer_line(R=example1.R, H=example1.H, E=example1.E, nu=example1.NU, delta=d)
            a, h = example1.half_width(inc)
            yield row(f"{what}: half-width at δ = {d:g}, within an element", layer.a, a, h, "absolute")
    yield from balance.rows()


@case("plate with friction on an Abaqus deck", suite="friction")
def plate(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Feijóo, Barbosa & Zouain's plate on a thousand quadrilaterals of a deck, μ = 1."""
    balance = Balance()
    problem = friction.plate(1, E_scale, mu_scale)
    inc = balance.last(replace(problem, bodies={"plate": pr.Body(mesh("plate.inp"), problem.bodies["plate"].material)}))
    yield from friction.plate_rows(inc)
    yield from balance.rows()


@case("upsetting with friction on a gmsh mesh", suite="forming")
def upsetting(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A billet of 141 quadrilaterals without structure, μ = 0.1, to 30 %: the force of an independent solver."""
    balance = Balance()
    reductions = (0.1, 0.2, 0.3)
    problem = forming.upsetting((1, 1), 0.1 * mu_scale, E_scale=E_scale, reductions=reductions)
    body = replace(problem.bodies["billet"], mesh=mesh("billet.msh"))
    fixed = {"billet.bottom": pr.Fixed(y="held")}
    history = list(balance.watch(replace(problem, bodies={"billet": body}, fixed=fixed)))
    for r, inc in zip(reductions, forming.at(reductions, history), strict=True):
        reference = tables.UPSETTING_FORCE_MU_01["cauchy"][r]
        yield row(f"F (kN) at {r:.0%}", reference, 1e-3 * inc.force("punch").y, 0.002)
    yield from balance.rows()
