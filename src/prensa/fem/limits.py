"""How far elements and friction are from their limits: shapes of deformed elements, bounds of tractions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prensa.contact.forces import ContactForces
from prensa.fem.context import Context
from prensa.fem.system import System
from prensa.friction.law import bounded
from prensa.mesh.mesh import displaced
from prensa.mesh.quality import quality

Array = NDArray[np.float64]


def shapes(system: System, body: str, u: Array) -> Array:
    """Scaled Jacobians (m,) of the elements of a body in the plane, for degrees of freedom u (ndof,)."""
    first, mesh = system.offsets[body], system.meshes[body]
    return quality(displaced(mesh, system.positions(u)[first : first + len(mesh.points)])).jacobian


def friction_bound(c: Context, number: int, f: ContactForces) -> Array | None:
    """Bounds (k,) of the tractions f of contact ``number``; None without friction."""
    law = c.laws[number]
    return None if law is None else bounded(law, f.p, f.kappa, c.law_at[number])[0]
