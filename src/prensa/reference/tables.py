"""Reference tables that ship with the package: loaders for the csv files in `data/`, and published or computed numbers.

Units N, mm, MPa. The tables come from programs independent of this package and of `prensa.reference` itself.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from importlib import resources

import numpy as np

from ._check import Array, one_of

EXAMPLE1_DELTA = (0.5, 1.0, 2.0)
"""Indentations (mm) of the next two rows: R = 80 on a block 160 x 40, plane strain, smooth base, linear elastic."""
EXAMPLE1_FORCE_REFERENCE_GEOMETRY = (2999.2, 7009.3, 16884.7)
"""P (N/mm) of the block itself, contact on the undeformed surface (linear Signorini)."""
EXAMPLE1_FORCE_CURRENT_GEOMETRY = (3017.0, 7073.0, 17074.0)
"""P (N/mm) of the block itself, linear elasticity with contact on the moved surface and the true cylinder normal."""
EXAMPLE1_NEO_HOOKE = {0.5: 3019.0, 1.0: 7098.5, 2.0: 17293.0, 4.0: 44143.0, 8.0: 118826.0}
"""delta (mm): P (N/mm), finite strain, psi = mu/2 (I1 - 3) - mu ln J + lambda/2 (ln J)^2; agreed to 0.1 %."""

EXAMPLE2_STIFFNESS = {"halfspace": 25039.1, "layer_smooth_base": 54689.6}
"""P/delta (N/mm) of the ring 8-12, E = 1000, nu = 0.3; layer of thickness 10 (Shibuya et al. 1974; computed)."""
EXAMPLE2_DISC_STIFFNESS = (51750.0, 51840.0)
"""P/delta (N/mm), range of two solvers for the disc of radius 20 and thickness 10 itself, smooth base."""

PLATE_UX = {0.0: 28.6, 1.25: 27.2, 5.0: 22.8, 7.5: 19.8, 11.25: 15.0}
"""x (mm): u_x (1e-3 mm), plate pushed on a rigid plane with mu = 1; published mean (code_aster SSNV128)."""
PLATE_UX_CONVERGED = {0.0: 28.60, 1.25: 27.22, 5.0: 22.87, 7.5: 19.81, 11.25: 15.41}
"""x (mm): u_x (1e-3 mm), the same, mesh-converged exact Coulomb. Lift-off to x = 3.3, slip to x = 29.7."""

UPSETTING_REDUCTION = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Reductions of the next rows: R = 10, half height 7.5, E = 200 000, nu = 0.3, flow 250 + 500 eps^0.3."""
UPSETTING_FORCE = {
    "cauchy": (175.304, 222.643, 276.136, 344.051, 437.493),
    "kirchhoff": (175.480, 222.895, 276.476, 344.503, 438.102),
}
"""F (kN), frictionless, exact, yield on the Cauchy or Kirchhoff stress; R = 14.1323 at 50 % (Cauchy)."""
UPSETTING_FORCE_MU_01 = {
    "cauchy": {0.1: 183.70, 0.2: 235.29, 0.3: 294.90},
    "kirchhoff": {0.1: 183.91, 0.2: 235.61, 0.3: 295.35},
}
"""Reduction: F (kN) for mu = 0.1, independent solver; barrel radius 14.350 at 50 %."""
UPSETTING_FORCE_MU_03 = {0.1: 193.5, 0.2: 248.0}
"""Reduction: F (kN) for mu = 0.3, +- 0.2 %; barrel radius 14.517 at 50 %."""
RING_BORE_CHANGE = {
    0.0: (5.36, 11.74, 19.45, 29.01, 41.32),
    0.05: (3.54, 7.28, 11.00, 14.11, 15.71),
    0.1: (1.43, 2.33, 2.27, -0.21, -6.25),
}
"""mu: change of the bore at mid-height (%) at 10 ... 50 %, ring OD 18, ID 9, height 6, same material; +- 0.3 points."""

SQUARE_BILLET_FORCE = {
    0.1: (200.2242, 235.928, 268.9028, 302.9039, 339.8022, 381.1693),
    0.3: (214.7695, 254.5138, 291.4539, 329.3636, 369.4183, 411.5656),
}
"""mu: F (kN) at 5, 10 ... 30 %, billet 20 x 20 x 15, E = 200 000, nu = 0.3, flow 250 + 500 eps^0.3 on the Cauchy stress,
8 x 6 x 8 bricks with F-bar of an eighth, computed by an independent program; the limit of fine meshes is 0.05 to 0.2 % lower for
mu = 0.1 (second program: 380.7 at 30 %, 235.8 at 10 %)."""
SQUARE_BILLET_LIMIT = {0.1: (200.11, 235.78, 268.68, 302.58, 339.34, 380.45), 0.3: (213.85, 252.9)}
"""mu: F (kN) of the same program at 5, 10 ... 30 % for bricks of size zero, from 8, 12 and 16; +- 0.1 % (0.15 % at 30 %) for
mu = 0.1, +- 0.2 and 0.3 % for mu = 0.3."""
BLOCK_SPHERE_FORCE = {0.5: 2051.60, 1.0: 6386.44, 1.5: 12662.69, 2.0: 20780.03}
"""delta (mm): P (N), sphere R = 10 on a block 20 x 20 x 10, base bonded, mu = 0.3, psi = mu/2 (I1 - 3) - mu ln J + lambda/2 ln²J,
E = 1000, nu = 0.3; independent program, 16 graded bricks a side; +- 0.5 %."""
BLOCK_CORRECTION = 0.4105
"""c of a block 20 x 20 x 10 on a bonded base, nu = 0.3, small strain: what presses with P on a half-space by delta presses on the
block by delta - c P/(E* H). Regular part of the point-load Green function by p-elements; 1e-4."""
HERTZ_ELLIPSE = {20.0: (0.79380956, 0.31743414, 0.025829784, 37.896703)}
"""P (N): semi-axes a, b (mm), delta (mm), p0 (MPa), gap x²/2Rx + y²/2Ry with Rx = 20, Ry = 5 on a half-space, E = 1000, nu = 0.3;
exact elliptic integrals."""
SQUARE_PUNCH_STIFFNESS = 2532.5351
"""P/delta (N/mm) of a rigid frictionless square flat punch 2 x 2 on a half-space, E = 1000, nu = 0.3; boundary elements,
extrapolated to 1e-5."""
BLOCK_SPHERE_DRAG = {
    0.1: (6460.3305, 544.431), 0.2: (6461.4601, 1043.872), 0.3: (6460.4210, 1445.914), 0.5: (6447.2583, 1922.776),
    0.75: (6401.3276, 1895.050),
}  # fmt: skip
"""Shift (mm): P, Q (N), the sphere of BLOCK_SPHERE_FORCE shifted at delta = 1; independent program, 8 bricks a side of a quarter;
Q/P +- 2 % to 0.3, +- 3 % beyond (2.3 % between meshes at 0.1)."""
THICK_PLATE = {0.1: (5955.47, 0.008, -0.096290, -0.101179, 0.034186), 0.2: (11889.0, 0.012, -0.192582, -0.202352, 0.068182)}
"""Travel (mm): P (N) with its relative uncertainty, deflection of the bottom in the middle and at its edge, lift of the end (mm).
Plate 100 x 40 x 10 on two rollers R = 5 at x = +- 40 under one in the middle, frictionless, E = 200 000, nu = 0.3; independent
program, force extrapolated from 4, 8 and 12 bricks through the thickness; +- 0.5 % of the deflections. A beam with shear and the
free width gives 5960 N at 0.1."""
TORSION_STIFFNESS = 294_683.0
"""M/theta (N mm): bar 20 x 20 x 30, E = 1000, nu = 0.3, both ends held, one turned about the axis without a way along it; linear
elasticity, elements of orders 2 to 5: 294 699, 294 690, 294 686; +- 0.003 % (Saint-Venant without ends: 288 360)."""


@dataclass(frozen=True)
class DamagePath:
    """Damage integrals at a plastic ``strain`` on a ``path`` of constant stress ratios, rigid-plastic, σ̄ = 250 + 500 ε̄^0.3 MPa.

    Cockcroft-Latham normalised and not (MPa), Oyane ∫(σ_m/σ̄ + A) dε̄ with A = 1/3 and 0.1 and with the first cut off at zero,
    Rice-Tracey ∫exp(1.5 σ_m/σ̄) dε̄ where σ_m/σ̄ > −1/3, plastic work (MPa). "Plane strain tension" is the sheet, σ_t = 0.
    """

    path: str
    strain: float
    cockcroft_latham: float
    cockcroft_latham_plain: float
    oyane_third: float
    oyane_tenth: float
    oyane_third_cut_off: float
    rice_tracey: float
    plastic_work: float


def damage_paths() -> list[DamagePath]:
    """Damage integrals along homogeneous paths: closed forms, twelve digits, computed apart from this package."""
    path = resources.files(__package__) / "data" / "damage_paths.csv"
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))[1:]
    return [DamagePath(row[0], *map(float, row[1:])) for row in rows]


@dataclass(frozen=True)
class RingCalibration:
    """friction (n,): labels like "mu=0.1" or "m=0.3"; reduction (k,) (-); change (n, k) (-) of the inner diameter."""

    friction: tuple[str, ...]
    reduction: Array
    change: Array

    def curve(self, friction: str) -> Array:
        """friction: a label -> (k,) (-): change of the inner diameter at `reduction`; ValueError if unknown."""
        one_of("friction", friction, self.friction)
        return np.asarray(self.change[self.friction.index(friction)])


def _rows(name: str) -> list[list[str]]:
    """Rows of data/<name>.csv, header first."""
    text = resources.files(__package__).joinpath("data", f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.reader(text.splitlines()))


def _columns(rows: list[list[str]], names: tuple[str, ...]) -> dict[str, Array]:
    """Numeric rows -> name: (n,)."""
    return {name: column for name, column in zip(names, np.array(rows, dtype=float).T)}


def cylinder_on_layer_table() -> dict[str, Array]:
    """-> delta, a, a_hertz (mm), P (N/mm), p0, p0_hertz (MPa), each (15,): cylinder R = 80 on a layer of thickness 40.

    E = 10 000, nu = 0.3, plane strain, frictionless, smooth base; *_hertz at the same P. Good to about 1e-6.
    Source: integral equation with the exact layer kernel, computed independently.
    """
    return _columns(_rows("example1_smooth_base")[1:], ("delta", "a", "P", "p0", "a_hertz", "p0_hertz"))


def cylinder_on_layer_pressure(delta: float) -> dict[str, Array]:
    """`delta` (mm): 0.1, 0.5, 1 or 2 -> x (mm), p, p_hertz (MPa), each (41,): the same problem, pressure profile.

    Raises ValueError for an indentation that is not tabulated.
    Source: as `cylinder_on_layer_table`.
    """
    rows = _rows("example1_smooth_base_pressure")[1:]
    chosen = [row[1:] for row in rows if math.isclose(float(row[0]), delta)]
    if not chosen:
        raise ValueError(f"delta = {delta!r}: not tabulated; choose from {sorted({float(row[0]) for row in rows})}")
    return _columns(chosen, ("x", "p", "p_hertz"))


def ring_stamp_pressure(support: str) -> dict[str, Array]:
    """support: "halfspace" or "layer_smooth_base" -> r (mm), p (MPa per mm), p_over_mean (-), each (80,).

    Ring 8-12 mm, E = 1000, nu = 0.3; layer of thickness 10. Both edges are singular: compare the interior.
    Raises ValueError for an unknown support.
    Source: Shibuya et al. (1974) and an independent computation.
    """
    one_of("support", support, ("halfspace", "layer_smooth_base"))
    rows = [row[1:] for row in _rows("example2_ring_pressure")[1:] if row[0] == support]
    return _columns(rows, ("r", "p", "p_over_mean"))


def plate_on_rigid_plane() -> dict[str, Array]:
    """-> x (mm), p, tau (MPa), ux, uy (mm), each (128,): plate pushed on a rigid plane with mu = 1, Q4 128 x 128.

    tau acts on the body; p is lumped (the node x = 0 has half a tributary length); the held node
    x = 40 is not listed.
    Source: Feijoo, Barbosa & Zouain (code_aster SSNV128), solved by an independent program.
    """
    return _columns([row for row in _rows("plate_on_rigid_plane_friction")[1:] if row], ("x", "p", "tau", "ux", "uy"))


def ring_compression_calibration() -> RingCalibration:
    """-> RingCalibration: the classical 6:3:2 ring, change of the inner diameter against height reduction.

    Perfectly plastic, no bulging, Coulomb capped at k; finite elements shift it by a few points. Signs (where the
    change exceeds 3 %) and the order of the curves are firm.
    Source: computed independently; the test is Male & Cockcroft's (1964), J. Inst. Metals 93.
    """
    header, *rows = _rows("ring_compression_6_3_2")
    reduction = np.array([float(name.rsplit("_", 1)[1].rstrip("%")) / 100.0 for name in header[1:]])
    change = np.array([row[1:] for row in rows], dtype=float) / 100.0
    return RingCalibration(tuple(row[0] for row in rows), reduction, change)


def die_deflection() -> dict[str, Array]:
    """-> half_height, force (kN), lift_0, lift_5, lift_10, lift_15, lift_20 (mm), each (4,): upsetting with an elastic die.

    Billet R = 10, half height 7.5, flow 250 + 500 eps^0.3, E = 200 000, nu = 0.3; die R = 20, height 20, E = 210 000, nu = 0.3,
    its back free to slide; Coulomb 0.1. half_height: of the billet on the axis; lift_r: of the die's face at r against its back.
    Good to 0.3 % in force, 1.5 % in lift, 3 % on the axis.
    Source: computed independently (node-to-segment, 48 elements); a second program agrees.
    """
    header, *rows = _rows("die_deflection")
    known = dict(zip(reversed(header), np.array(rows, dtype=float).T[::-1]))  # the second program's columns come later
    names = {"half_height": "billet_half_height_at_axis", "force": "F_kN_n48", "lift_0": "face_lift_r0", "lift_5": "r5"}
    names |= {"lift_10": "r10", "lift_15": "r15", "lift_20": "r_outer"}
    return {ours: known[theirs] for ours, theirs in names.items()}
