"""Partial slip under torsion: a sphere pressed on a block and twisted about its normal, against Lubkin's closed form.

Most of the moment is carried at the edge of the contact, where the slip begins: bricks are a twentieth of its radius there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa.reference import hertz_sphere, lubkin_torsion
from prensa.types import Array
from prensa.verify.rates import order_row
from prensa.verify.space import imbalance
from prensa.verify.space_elastic import BALL_RADIUS, NU, SHEAR_MODULUS, E, H, lines, upright
from prensa.verify.table import Row, case, row

TWISTED_FORCE, TWISTED_MU = 20.0, 0.3
STICK_RADII = (0.95, 0.8, 0.5, 0.2)
"""Radii of the stick over that of the contact."""


def disc_of_bricks(a: float, n: int) -> pr.Revolution:
    """A round block of radius and height H in n sectors, bricks of a/20 from 0.7 a to a little beyond a, and below."""
    r = np.concatenate([np.linspace(0.0, 0.7 * a, 6)[:-1], 0.7 * a + lines(0.05 * a, 0.35 * a, H - 0.7 * a, 1.4)])
    y = upright(0.05 * a, 0.0, 1.3)
    points = [(u, v) for v in y.tolist() for u in r.tolist()]
    number = np.arange(len(points)).reshape(len(y), len(r))
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    sides = {"bottom": number[0].tolist(), "top": number[-1].tolist()}
    section = pr.Points(points, np.stack(corners, axis=-1).reshape(-1, 4).tolist(), sides)
    return pr.Revolution(section, n, angle=2.0 * np.pi, core="wedges")


def twisted(n: int, E_scale: float, mu_scale: float) -> tuple[Array, float]:
    """Moments (4,) at the twists at which the stick has its radii; forces out of balance."""
    a = hertz_sphere(TWISTED_FORCE, BALL_RADIUS, E, NU).a
    law = {"block.top-ball": pr.Coulomb(TWISTED_MU * mu_scale)}
    twists = [lubkin_torsion(P=TWISTED_FORCE, a=a, mu=TWISTED_MU, G=SHEAR_MODULUS, c=c * a).twist for c in STICK_RADII]
    press = pr.Step("press", push={"ball": pr.Push(y=-TWISTED_FORCE)}, increments=1)
    steps = [pr.Step(f"{k}", move={"ball": pr.Motion(ry=by)}, friction=law, increments=1) for k, by in enumerate(twists)]
    increments = list(pr.solve(pr.Problem(
        "twist", space="solid", kinematics="small", contact_geometry="reference", allow_large_strain=True,
        bodies={"block": pr.Body(disc_of_bricks(a, n), pr.Elastic(E * E_scale, NU), "h8")},
        tools={"ball": pr.Sphere(BALL_RADIUS, at=(0.0, H + BALL_RADIUS, 0.0))},
        # a penalty's own give would be 1 % of the twist at which all but the edge sticks
        contacts=(pr.Contact("block.top", "ball", enforcement=pr.Augmented()),),
        fixed={"block.bottom": "xyz"}, steps=(press, *steps),
    )))  # fmt: skip
    return np.array([-i.force("ball").my for i in increments[1:]]), max(map(imbalance, increments))


@case("Lubkin, sphere twisted on a block", suite="space", slow=True, expected_warnings=("times longer than wide",))
def lubkin(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Moments by the twist, pressed without friction first, in 32 sectors; the order from 8, 16 and 32.

    Chords of a circle are of order 2. Where nearly all slips the moment hardly depends on the sectors and goes up and down with
    them. Torsion of the block as a whole adds nothing: displacements fall with the square of the distance.
    """
    sectors = (8, 16, 32)
    moments, off = zip(*(twisted(n, E_scale, mu_scale) for n in sectors))
    a = hertz_sphere(TWISTED_FORCE, BALL_RADIUS, E, NU).a
    for c, of_sectors in zip(STICK_RADII, zip(*moments)):
        exact = lubkin_torsion(P=TWISTED_FORCE, a=a, mu=TWISTED_MU, G=SHEAR_MODULUS, c=c * a)
        name = f"M (N mm) at {1e3 * exact.twist:.2f} mrad, c/a = {c:g}"
        yield row(name, exact.moment, of_sectors[-1], 0.01)
        yield order_row(name, sectors, of_sectors, 2.0)
    yield row("ball and supports out of balance", 0.0, max(off), 1e-8, "absolute")
