"""One point dragged forth, back and forth again under a friction that grows with the path it has slid.

The paper's elastic-plastic analogy, with the length of the slip path in place of the net slip: after the reversal a law on
the net slip would forget how far the surface has been rubbed, one on the path length does not.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from common import Array, figure, judged, options, saved

import prensa as pr
from prensa.output import style
from prensa.reference import MuExponential, slip_hardening
from prensa.verify.table import Row, row

PRESSURE, K_T = 40.0, 500.0
STROKES = (0.8, -0.5, 0.4)
LAW = {"mu0": 0.1, "mu_inf": 0.25, "u0": 0.3}
EXACT = MuExponential(**LAW)
"""μ(κ) = μ∞ − (μ∞ − μ0) e^(−κ/u0)."""


def problem(parts: int) -> pr.Problem:
    """Two elements pressed on a plane that is dragged; held along it, so that only the contact yields."""
    friction = {"body.bottom-plane": pr.Coulomb(pr.MuExponential(**LAW))}
    strokes = (
        pr.Step(f"stroke {k}", move={"plane": pr.Motion(x=x)}, friction=friction, increments=parts)
        for k, x in enumerate(STROKES, 1)
    )
    return pr.Problem(
        "one sliding point",
        bodies={"body": pr.Body(pr.Rectangle(size=(2, 1), n=(2, 1)), pr.Elastic(E=1000.0, nu=0.3))},
        tools={"plane": pr.Plane(normal=(0, 1), at=(0, 0))},
        contacts=(pr.Contact("body.bottom", "plane", enforcement=pr.Penalty(k_T=K_T)),),
        fixed={"body.bottom": "x", "body.top": "x"},
        loads={"body.top": pr.Load(pressure=PRESSURE)},
        steps=(pr.Step("press", increments=1), *strokes),
        kinematics="small",
        contact_geometry="reference",
    )


def dragged(parts: int) -> tuple[Array, Array, Array]:
    """Place of the plane, shear traction on the body and length of the slip path, from the start of the drag."""
    found = [(0.0, 0.0, 0.0)]
    for inc in pr.solve(problem(parts)):
        if inc.step != "press":
            (c,) = inc.contacts.values()
            found.append((inc.tools["plane"].place.x, float(c.force[1, 0] / c.weight[1]), float(c.slip[1])))
    u, t, kappa = np.array(found).T
    return u, t, kappa


def rows() -> Iterator[Row]:
    """At the ends of the strokes the closed form to round-off, whatever the increments: backward Euler is exact here."""
    t_exact, k_exact = slip_hardening(STROKES, p=PRESSURE, k_T=K_T, law=EXACT)
    for parts in (1, 16):
        _, t, kappa = dragged(parts)
        for i in range(len(STROKES)):
            at = f"stroke {i + 1} in {parts} increment{'s' if parts > 1 else ''}"
            yield row(f"{at}: traction (MPa)", t_exact[i], t[(i + 1) * parts], 1e-9)
            yield row(f"{at}: path length (mm)", k_exact[i], kappa[(i + 1) * parts], 1e-9)


def picture(path: Path) -> None:
    """Traction against the place of the plane; coefficient of friction against its travel, on path length and on net slip."""
    u, t, kappa = dragged(16)
    ends = [0.0, *STROKES]
    fine = np.concatenate([[0.0], *(np.linspace(a, b, 400)[1:] for a, b in pairwise(ends))])
    t_fine, k_fine = slip_hardening(fine, p=PRESSURE, k_T=K_T, law=EXACT)
    net = np.abs(fine - t_fine / K_T)  # what the plane has moved less the elastic part
    travel, travel_fine = (np.cumsum(np.abs(np.diff(x, prepend=0.0))) for x in (u, fine))
    with style.styled():
        made, (left, right) = figure(7.4, 3.4, columns=2)
        left.axhline(0.0, color=style.BLACK, linewidth=0.6)
        left.plot(fine, t_fine, color=style.BLACK, linewidth=1.0, label="closed form")
        left.plot(u, t, "o", color=style.BLUE, label="prensa, 16 increments a stroke")
        left.set(xlabel="place of the plane (mm)", ylabel="shear traction (MPa)", ylim=(-12, 17.5), title="Traction")
        left.legend(loc="upper left")
        right.plot(
            travel_fine, [EXACT(k) for k in k_fine], color=style.BLACK, linewidth=1.0, label="path length, closed form"
        )
        right.plot(travel, [EXACT(k) for k in kappa], "o", color=style.BLUE, label="path length, prensa")
        right.plot(
            travel_fine, [EXACT(k) for k in net], color=style.RED, linewidth=1.2, dashes=(5, 2), label="if on net slip"
        )
        for turn in np.cumsum(np.abs(np.diff(ends)))[:-1]:
            right.axvline(turn, color="0.6", linewidth=0.8, dashes=(2, 2), zorder=0.5)
        right.set(xlabel="travel of the plane (mm; dotted: it turns)", ylabel="μ", ylim=(0.045, 0.265))
        right.set_title("Coefficient of friction")
        right.legend(loc="lower right")
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Drag, compare, draw; returns the exit code (``--quick`` changes nothing: it is quick)."""
    chosen = options(__doc__, "slip_hardening", argv)
    failed = judged("Slip hardening of one point", list(rows()))
    picture(chosen.out / "drag.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
