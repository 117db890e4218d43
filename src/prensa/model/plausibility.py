"""Plausibility of a description: units of stiffness, friction in percent, idle tools, no 'space'."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from prensa.model.problem import Problem
from prensa.model.seconds import stated
from prensa.model.units import factor
from prensa.model.unsaid import space_left_out
from prensa.precision import NEGLIGIBLE

STIFFEST, STRONGEST = 2000.0, 20.0  # GPa: above the modulus of diamond, and above the strength of any metal
WEAKEST = 1e-5  # of E: below the flow stress of any metal; lead has 3e-4, superplastic alloys 5e-5
YIELDING = (1e-4, 0.03)  # of E: between these metals flow
METALS = ((65.0, 75.0), (105.0, 125.0), (185.0, 215.0))  # GPa: aluminium and glass, copper and titanium, steel


def _stiffness(name: str, material: Any, first: float, proof: float, units: Any) -> Iterator[str]:
    """Moduli that are those of metals in another unit than the case's, and flow stresses far below the modulus."""
    E = material.modulus
    gpa = factor("1 GPa", units.length, units.force, (1, -2))
    # Too stiff by a unit is reported before too soft: a modulus that is 1e3 too large also makes the flow stress look too small.
    if STIFFEST * gpa < E or first > STRONGEST * gpa:
        what, value, most = ("E", E, STIFFEST) if STIFFEST * gpa < E else ("flow stress", first, STRONGEST)
        meant = f"; did you mean '{value:g} {unit}'?" if (unit := _meant(value, what, most)) else "; check its unit"
        both = f" (and flow stress {first:g})" if what == "E" and first > STRONGEST * gpa else ""
        stress = f"{units.force}/{units.length}²"
        amount = f"{what} = {value:g}{both} in {stress}, {value / gpa:.3g} GPa"
        yield f"bodies.{name}.material: {amount}, is not realistic{meant}"
        return
    if first > 0 and proof < WEAKEST * E:
        meant = next((f"; did you mean '{first:g} {u}'?" for u in ("GPa", "MPa") if _of_a_metal(first, u, E, units)), "")
        amount = f"flow stress {first:g} is {first / E:.1g} of E = {E:g}, less than that of any metal"
        yield f"bodies.{name}.material: {amount}{meant or '; check the units of both'}"
    elif units.force == "N" and units.length in ("mm", "cm", "m") and first <= E / 20 and material.poisson < 0.45:
        for unit, share in (("GPa", 1.0), ("MPa", 1e3)):
            own = abs(factor(f"1 {unit}", units.length, units.force, (1, -2)) - 1.0) < NEGLIGIBLE
            if not own and any(low <= E / share <= high for low, high in METALS):
                stress = f"{units.force}/{units.length}²"
                yield f"bodies.{name}.material: E = {E:g} in {stress}; did you mean '{E:g} {unit}'?"


def _meant(value: float, what: str, most: float) -> str:
    """Unit in which a stress that is too large in the case's is likely: that of a metal, or one in which it is none too large."""
    sizes = {"GPa": 1.0, "MPa": 1e-3, "Pa": 1e-9}
    of_metals = (unit for unit, gpa in sizes.items() if what == "E" and any(low <= value * gpa <= high for low, high in METALS))
    return next(of_metals, "Pa" if value * sizes["Pa"] < most else "")


def _of_a_metal(stress: float, unit: str, E: float, units: Any) -> bool:
    """Whether a flow stress, taken in another unit than the case's, is that of a metal with the modulus E."""
    meant = factor(f"{stress:g} {unit}", units.length, units.force, (1, -2))
    return YIELDING[0] * E <= meant <= YIELDING[1] * E


def friction_of_none(problem: Problem) -> str:
    """That the friction of a problem is that of no contact, since all have their own; '' if it is not so."""
    contacts = [(kind, c) for kind in ("contacts", "body_contacts") for c in getattr(problem, kind)]
    if problem.friction is None or not contacts or any(c.friction is None for _, c in contacts):
        return ""
    return f"every contact has a friction of its own, so that this one acts nowhere: change '{contacts[0][0]}.0.friction'"


def warnings_of(problem: Problem) -> list[str]:
    """Sentences about what is allowed but likely a slip: units of stiffness, friction in percent, idle tools, no 'space'."""
    said = []
    stress = f"{problem.units.force}/{problem.units.length}²"
    in_mpa = (problem.units.force, problem.units.length) == ("N", "mm")
    for name, body in problem.bodies.items():
        E, flow = body.material.modulus, getattr(body.material, "flow", None)
        doubts = list(flow.doubts()) if flow is not None else []
        # Of a curve with a constant in per cent nothing follows for the units of its stresses.
        first = flow.first() if flow is not None and not doubts else 0.0
        proof = first if flow is None or doubts else flow.proof()  # laws without yield stress begin at next to nothing
        if flow is not None and (nu := body.material.poisson) < 0:
            thicker = "no metal gets thicker where it is pulled"
            said.append(f"bodies.{name}.material: nu = {nu:g} is negative; {thicker}; did you mean {-nu:g}?")
        if first > E / 20:
            meant = f"; did you mean {E:g}e3 or '{E:g} GPa'?" if in_mpa and E < 1000 else "; check the units of both"
            said.append(f"bodies.{name}.material: E = {E:g} in {stress}, flow stress {first:g}{meant}")
        else:
            said += _stiffness(name, body.material, first, proof, problem.units)
        said += [f"bodies.{name}.material.flow.{key}: {words}" for key, words in doubts]
        if flow is not None and (step := next((s for s in problem.steps if stated(s) is None), None)) and flow.rated():
            said.append(
                f"bodies.{name}.material.flow: it depends on the rate of strain, and step {step.name!r} does not say how long it "
                "lasts: it is taken to last 1 s; give 'duration'"
            )
    laws = [("friction", problem.friction)]
    for key in ("contacts", "body_contacts"):
        laws += [(f"{key}.{i}.friction", c.friction) for i, c in enumerate(getattr(problem, key))]
    for where, law in laws:
        mu = getattr(law, "mu", None)
        # Above 2 no friction of metals lies; 5 or 10 were meant in percent.
        if isinstance(mu, float) and mu > 2:
            percent = f"; did you mean {mu / 100:g}?" if mu <= 100 else ""
            said.append(f"{where}: mu = {mu:g} is a friction coefficient above 2{percent}")
    if words := friction_of_none(problem):
        said.append(f"friction: {words}")
    used = {c.against for c in problem.contacts} | {n.against for n in problem.no_contact}
    said += [
        f"tools.{t}: no contact involves this tool; it will touch nothing" for t in problem.tools if t not in used
    ]
    said += [f"tools.{name}.{key}: {words}" for name, tool in problem.tools.items() for key, words in tool.doubts()]
    return said + space_left_out(problem)
