"""A sheet bent round a punch into a die, lying flat on it at first, and released: benchmark B of NUMISHEET 2002."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.result.increment import Increment
from prensa.system.discretise import discretise
from prensa.verify.balance import imbalance
from prensa.verify.table import Row, case, row

SHEET_E, SHEET_NU, SHEET_MU = 70500.0, 0.342, 0.1342
ALLOY = pr.Swift(K=550.4, e0=(194.0 / 550.4) ** (1 / 0.223), n=0.223)
PUNCH, SHOULDER, DIE, SHEET_THICKNESS, HALF_SHEET, SHEET_STROKE = 23.5, 4.0, 25.0, 1.0, 60.0, 28.5
FORMED, RELEASED = 21.84, 54.45
"""Angles (°) of NAFEMS R0094, benchmark 3, with friction. Another code has 43.2 for the second."""
CALCULIX = 20.32
"""The first of them by CalculiX 2.20 on 120 x 4 elements C3D8I: `benchmarks/calculix_bending.py`."""


def free_bending(element: str, n: tuple[int, int], E_scale: float = 1.0, mu_scale: float = 1.0) -> pr.Problem:
    """Half of the sheet, bent to where the centres of the punch and of the shoulders are level, and released."""
    sheet = pr.Body(
        pr.Rectangle(size=(HALF_SHEET, SHEET_THICKNESS), n=n), pr.J2(SHEET_E * E_scale, SHEET_NU, ALLOY), element
    )
    die = pr.Profile(points=((80.0, 0.0), (DIE, 0.0), (DIE, -60.0)), fillet=SHOULDER, below="sheet.bottom")
    friction = pr.Coulomb(SHEET_MU * mu_scale)
    away = {"punch": pr.Motion(y=2.0), "die": pr.Motion(y=-40.0)}
    return pr.Problem(
        "free bending", space="plane strain", bodies={"sheet": sheet},
        tools={"punch": pr.Circle(radius=PUNCH, above="sheet.top"), "die": die},
        contacts=(pr.Contact("sheet.top", "punch"), pr.Contact("sheet.bottom", "die")), friction=friction,
        fixed={"sheet.left": "x"},
        steps=(
            pr.Step("bend", move={"punch": pr.Motion(y=-SHEET_STROKE)}),
            pr.Step("release", move=away, fixed={"sheet.bottom-left": "y"}),
        ),
    )  # fmt: skip


def between_legs(inc: Increment) -> float:
    """Angle (°) between the legs: twice that of the line of least squares through the last quarter of the lower side."""
    side = inc.contacts["sheet.bottom-die"]
    leg = side.x[side.X[:, 0] >= 0.75 * HALF_SHEET]
    along = np.linalg.svd(leg - leg.mean(axis=0))[2][0]
    return float(2.0 * np.degrees(np.arctan2(abs(along[0]), abs(along[1]))))


@case("free bending and springback (NUMISHEET 2002 B)", suite="forming", slow=True)
def numisheet(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """From lying flat: the angle between the legs at the end of the stroke within 2 % of a strip in bending; springback reported.

    A side of an element 1 mm long cuts 0.03 mm off the shoulder, and may open the angle by 3 %.
    """
    exact = ref.free_bending(
        punch=PUNCH, shoulder=SHOULDER, apart=DIE + SHOULDER, thickness=SHEET_THICKNESS, E=SHEET_E, nu=SHEET_NU, mu=SHEET_MU,
        flow=lambda strain: ALLOY.K * (ALLOY.e0 + strain) ** ALLOY.n,
    )  # fmt: skip
    for element in ("q4_enhanced", "q8"):
        problem = free_bending(element, (60, 2), E_scale, mu_scale)
        bent, released = (i for i in pr.solve(problem) if i.end_of_step)
        yield row(f"{element}: angle (°)", np.degrees(exact.angle), between_legs(bent), 0.02)
        yield row(f"{element}: angle (°), CalculiX", CALCULIX, between_legs(bent), 0.02)
        yield row(f"{element}: angle (°), NAFEMS R0094", FORMED, between_legs(bent), 0.0, "report")
        yield row(f"{element}: angle after release (°), NAFEMS R0094", RELEASED, between_legs(released), 0.0, "report")
        unbalanced, _ = imbalance(discretise(problem), bent)
        yield row(f"{element}: forces out of balance / largest force", 0.0, unbalanced, 1e-8, "absolute")
