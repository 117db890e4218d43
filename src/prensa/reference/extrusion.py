"""Backward extrusion of cans: an upper bound by parallel velocity fields, and the elementary formula of Dipper.

Sources: Avitzur (1968), Metal Forming: Processes and Analysis, ch. 5 (parallel velocity fields); Dipper (1949), Das
Fließpressen von Hülsen in Rechnung und Versuch, Archiv für das Eisenhüttenwesen 20 (mean strains).
"""

from __future__ import annotations

import numpy as np

from ._check import Array, not_negative, positive


def can_upper_bound(radius: float, punch: float, height: float, stress: float, m: float) -> float:
    """Radii and remaining ``height`` (length), flow ``stress``, friction factor m -> punch force (force), an upper bound.

    Metal of a constant flow stress (von Mises) in a container. Beneath the punch, over a height b, it is compressed
    uniformly, v_r = r/(2 b), v_z = -z/b (unit punch velocity); in the ring around it v_r = A (R²/r - r), v_z = 2 A z with
    A = r_p²/(2 b (R² - r_p²)): both incompressible, v_r continuous at the punch's radius. The power in both
    zones, of shear at their faces (towards the can, and towards metal at rest below b), and of friction m k at punch, bottom
    and wall bounds the force from above; b is the best below ``height``.
    Source: the upper-bound theorem, Prager and Hodge (1951), Theory of Perfectly Plastic Solids; the velocities are those above.

    Raises ValueError for lengths or a stress <= 0, a punch as wide as the container, m outside 0 ... 1.
    """
    from scipy.optimize import minimize_scalar

    positive(radius=radius, punch=punch, height=height, stress=stress)
    not_negative(m=m)
    if punch >= radius or m > 1:
        raise ValueError("the punch is narrower than the container, and m is at most 1")
    R, p, k = radius, punch, stress / np.sqrt(3.0)
    r: Array = np.linspace(p, R, 2001)

    def force(b: float, below: float) -> float:
        """With a zone of height b and friction of ``below`` times k beneath it."""
        A = p**2 / (2 * b * (R**2 - p**2))
        v = A * (R**2 / r - r)
        beneath = stress * np.pi * p**2
        # strain rates of the ring: A (-R²/r² - 1), A (R²/r² - 1), 2 A
        rate = 2 * A * np.sqrt(R**4 / r**4 / 3 + 1)
        around = stress * np.trapezoid(2 * np.pi * r * b * rate, r)
        between = k * 2 * np.pi * p * (1 / b + 2 * A) * b**2 / 2
        above = k * np.trapezoid(2 * np.pi * r * v, r)
        sliding = 2 * np.pi * p**3 / (6 * b)
        beneath += below * k * (np.trapezoid(2 * np.pi * r * v, r) + sliding)
        wall = m * k * 2 * np.pi * R * A * b**2
        return float(beneath + around + between + above + m * k * sliding + wall)

    inner = minimize_scalar(lambda b: force(b, 1.0), bounds=(0.0, height), method="bounded")
    return min(force(height, m), float(inner.fun))


def can_strain(radius: float, punch: float, height: float, left: float) -> float:
    """Radii, initial ``height`` and what is ``left`` of it beneath the punch (length) -> mean strain of metal that has flowed.

    Half that beneath the punch, ln(h0/h), half that of the wall, which is larger by 1 + d/(8 w).
    Source: Dipper (1949), Das Fließpressen von Hülsen in Rechnung und Versuch; Lange (1985), Handbook of Metal Forming, ch. 15.
    Raises ValueError for lengths <= 0 or left > height.
    """
    positive(radius=radius, punch=punch, height=height, left=left)
    if left > height or punch >= radius:
        raise ValueError("less is left than there was, and the punch is narrower than the container")
    strain = np.log(height / left)
    return float(0.5 * strain * (2 + 2 * punch / (8 * (radius - punch))))
