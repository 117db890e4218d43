"""The law of a contact point, once: pressure and traction of its gap and its way, and what follows from them.

Stated for one point, in the plane or in space; values, and derivatives by all that it depends on, are generated. What the
stencils of `prensa.contact.stencil` make of it is linear: forces are w p n + a t e on their nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from prensa.friction.law import At, FrictionLaw
from prensa.friction.point import Form, arrays, arrays_of, read, values_of
from prensa.friction.return_map import BRANCH, DECIDE, OPEN, Bounds, Sides, magnitude, returned, trial
from prensa.kernels.differentiate import forward, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import Node, absolute, differs, given, many, where
from prensa.precision import EPS
from prensa.types import Array, Bytes, Flags

NEARBY = 8  # flag of a branch: a point resists that is open by less than `TOUCH`
TOUCH = 1e-10  # gap over element depth below which a point touches where an increment starts


def pressure(lam: Node, k_n: Node, g: Node, closed: Node) -> Node:
    """Pressure of a point with a gap g."""
    # A pressure that rises smoothly before the touch was tried: it smears pressures, takes up to eight times the iterations,
    # and the ripple of landing nodes stays.
    return where(closed, lam - k_n * g, 0.0)


# --- sides of the kink ------------------------------------------------------------------------------------------------


@generated
def _normal() -> Program:
    g, lam, k_n, h, round_off, want = (given(name, 0) for name in ("g", "lam", "k_n", "h", "round_off", "want"))
    closed = given("closed", 0)
    found = lam - k_n * g  # −inf where a ray misses the tool
    # One unit in the last place of a coordinate, times the penalty, is a force: a point that was closed must not open and close
    # by it.
    rests = found >= -(k_n * round_off + EPS * absolute(lam))
    # Recorded numbers have no bits to mask: the flags NEARBY = 8 and HOLD = 4 are subtracted, the larger one first.
    near = want >= 1.0 * NEARBY
    branch = where(near, want - 1.0 * NEARBY, want)
    branch = where(branch > 1.0 * BRANCH, branch - (BRANCH + 1.0), branch)
    opened, decides = ~differs(branch, OPEN), ~differs(branch, DECIDE)
    held = ~opened & ~decides & (absolute(found) < np.inf)  # a point that the tool has left behind has no gap
    # A point that just touches resists like a closed one, or a body at rest on a tool would be free.
    by_itself = (closed & rests) | (~closed & (found >= 0.0)) | (near & (found >= -(TOUCH * k_n * h)))
    touching = held | (~opened & by_itself)
    # The slope (touching) may be that of a closed point where the pressure is zero: residual and matrix take their kinks apart.
    p = where(held | (~opened & (found > 0.0)), found, 0.0)
    rows: list[Kind] = [Rows(1)] * 6
    arrays: dict[str, Kind] = dict(zip(("g", "lam", "k_n", "h", "round_off", "want"), rows))
    arrays |= {"closed": Marks(), "p": Rows(1), "touching": Marks(), "rests": Marks()}
    return Program(arrays, [*puts("p", [p]), *puts("touching", [touching]), *puts("rests", [rests])])


def normal(
    g: Array, lam: Array, k_n: Array, h: Array, round_off: Array, closed: Flags, want: Bytes
) -> tuple[Array, Flags, Flags]:  # fmt: skip
    """Pressures p (k,) at gaps g (k,), which points touch, and which are closed or open by round-off only.

    ``closed``: committed flags; all else (k,) as of `prensa.contact.forces.forces`.
    """
    p, touching, rests = np.empty(len(g)), np.empty(len(g), dtype=bool), np.empty(len(g), dtype=bool)
    _normal()(len(g), g, lam, k_n, h, round_off, want.astype(np.float64), closed, p, touching, rests)
    return p, touching, rests


# --- derivatives ------------------------------------------------------------------------------------------------------


class Places(NamedTuple):
    """Where what a point depends on stands, and where its answers do, with t tangents and a law of n numbers.

    It depends on the gap, the way along the tool, multipliers, stiffnesses, the areas of pressure and of traction, the committed
    slip, traction and area, the shear yield stress, the speed, the numbers of the law. Its answers are the pressure, the
    traction, the slip, the forces w p and a t, the bound at the committed slip, the work of friction and the energy in springs.
    """

    t: int
    n: int

    @property
    def inputs(self) -> Mapping[str, slice]:
        """By name."""
        return _inputs(self.t, self.n)

    @property
    def outputs(self) -> Mapping[str, slice]:
        """By name."""
        return _outputs(self.t)


@cache
def _inputs(t: int, n: int) -> Mapping[str, slice]:
    widths = {
        "g": 1, "way": t, "lam_n": 1, "lam": t, "k_n": 1, "k_t": 1, "weight": 1, "area": 1, "slip": 1, "traction": t,
        "area_was": 1, "k": 1, "speed": 1, "numbers": n,
    }  # fmt: skip
    return _in_a_row(widths)


@cache
def _outputs(t: int) -> Mapping[str, slice]:
    return _in_a_row({"p": 1, "t": t, "slip": 1, "P": 1, "T": t, "bound": 1, "friction": 1, "stored": 1})


def _in_a_row(widths: dict[str, int]) -> dict[str, slice]:
    ends = np.cumsum(list(widths.values())).tolist()
    return {name: slice(end - width, end) for (name, width), end in zip(widths.items(), ends)}


def answers(
    z: Mapping[str, Sequence[Node]], closed: Node, slip: Node, law: Bounds | None, by_area: bool
) -> dict[str, Sequence[Node]]:  # fmt: skip
    """Answers of a point, by name, to what it depends on; ``closed``, ``slip``: the sides that it is on.

    ``by_area``: whether tractions belong to another area than pressures do, and the law to the pressure per such area.
    """
    (g,), (lam,), (k_n,), (k_t,), (w,), (a,) = (z[name] for name in ("g", "lam_n", "k_n", "k_t", "weight", "area"))
    (kappa,), (area_was,), was = z["slip"], z["area_was"], z["traction"]
    p = pressure(lam, k_n, g, closed)
    t, after, tau = [0.0 * x for x in z["lam"]], kappa, 0.0 * p
    if law is not None:
        found = trial(z["lam"], z["way"], k_t, closed)
        q = p * w / a if by_area else p
        t, after, _ = returned(found, q, kappa, k_t, law, Sides(slip, slip & (magnitude(found) > 0.0), slip))
        tau = law.bound(q, kappa)
    P, T = w * p, [a * x for x in t]
    # Trapezoid over the increment: backward Euler would add a dissipation of first order to the energy balance.
    friction = 0.5 * (area_was * magnitude(was) + magnitude(T)) * (after - kappa)
    stored = 0.5 * (P * p / k_n + sum((x * y for x, y in zip(T[1:], t[1:])), start=T[0] * t[0]) / k_t)
    return {"p": [p], "t": t, "slip": [after], "P": [P], "T": T, "bound": [tau], "friction": [friction], "stored": [stored]}


@generated
def _slopes(form: Form | None, hardens: bool, t: int, by_area: bool) -> Program:
    places = Places(t, 0 if form is None else form.numbers)
    z = {name: many(name, place.stop - place.start) for name, place in places.inputs.items()}
    own: dict[str, Kind] = {"k": Rows(1), "speed": Rows(1)} if form is None else arrays_of(form)
    law = None if form is None else read(form, hardens)
    found = answers(z, given("closed", 0), given("slips", 0), law, by_area)
    of, values = [x for name in places.inputs for x in z[name]], [x for name in places.outputs for x in found[name]]
    J = forward(values, units(of), len(of))
    rows: dict[str, Kind] = {name: Rows(len(z[name])) for name in places.inputs if name not in own and z[name]}
    marks: dict[str, Kind] = {"closed": Marks(), "slips": Marks()}
    return Program({**rows, **marks, **own, "J": Rows(len(values) * len(of))}, puts("J", [x for row in J for x in row]))


class Slopes(NamedTuple):
    """Derivatives J (k, outputs, inputs) of the answers of k points by what they depend on; see `Places`."""

    places: Places
    J: Array

    def along(self, directions: dict[str, Array]) -> dict[str, Array]:
        """What answers (k, width, d) directions (k, width, d) make, by name; those that are not named are zero."""
        d = next(iter(directions.values())).shape[-1]
        z = np.zeros((len(self.J), self.J.shape[2], d))
        for name, place in self.places.inputs.items():
            if name in directions:
                z[:, place] = directions[name]
        found = self.J @ z
        return {name: found[:, place] for name, place in self.places.outputs.items()}

    def back(self, weights: dict[str, Array]) -> dict[str, Array]:
        """Weights (m, k, width) of answers → of what they depend on, by name; answers that are not named weigh nothing."""
        m = len(next(iter(weights.values())))
        w = np.zeros((len(self.J), m, self.J.shape[1]))
        for name, place in self.places.outputs.items():
            if name in weights:
                w[:, :, place] = np.moveaxis(weights[name], 0, 1)
        found = np.moveaxis(w @ self.J, 0, 1)
        return {name: found[:, :, place] for name, place in self.places.inputs.items()}


class Point(NamedTuple):
    """What k points depend on: see `Places`; vectors (k, t), all else (k,). ``closed``, ``slips``: on which sides they are."""

    g: Array
    way: Array
    lam_n: Array
    lam: Array
    k_n: Array
    k_t: Array
    weight: Array
    area: Array
    slip: Array
    traction: Array
    area_was: Array
    closed: Flags
    slips: Flags


def slopes(x: Point, law: FrictionLaw | None, at: At, by_area: bool) -> Slopes:
    """Derivatives of points at the sides that they are on, under a law that is stated for one point, or none.

    ``by_area``: whether tractions belong to other areas than pressures do, and the law to the pressure per such area.
    """
    k, t = x.way.shape
    values = None if law is None else values_of(law)
    form, numbers = (None, 0) if values is None else (values.form, len(values.numbers))
    places = Places(t, numbers)
    J = np.empty((k, places.outputs["stored"].stop, places.inputs["numbers"].stop))
    rest: tuple[Array, ...] = (np.zeros(k), np.zeros(k)) if values is None else arrays(values, at, k)
    _slopes(form, law is not None and law.hardens, t, by_area)(k, *x, *rest, J)
    return Slopes(places, J)
