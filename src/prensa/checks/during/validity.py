"""Limits of validity that a run exceeds: small-strain kinematics, and tables with an end.

Converged and balanced answers may still be those of another problem. Strains and rotations are those at the elements' centres.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prensa.checks.check import Committed, Failed, Finished, ended_by, warning
from prensa.checks.force_share import ForceShare
from prensa.checks.thresholds import NO_DIFFERENCE, SLIGHT
from prensa.errors import Finding, per_cent
from prensa.geometry.plane import cross
from prensa.materials.flow_curve import FlowCurve
from prensa.model.metals import metals_of
from prensa.model.problem import Problem
from prensa.model.seconds import stated
from prensa.model.units import factor
from prensa.policy import Policy
from prensa.precision import SMALLEST
from prensa.system.assembly import Block
from prensa.system.failure import BeyondSmall, in_degrees
from prensa.system.interaction import Context
from prensa.system.system import Evaluation, System
from prensa.types import Array, Index

STRAIN_WARNING = 0.05
"""Strain, rotation (rad) or share of a force worth a warning: of strains that should be small forces are off by as much."""
YIELDS_BEFORE = "metals yield long before; give it a 'j2' material with its flow curve"
STRAIN_LIMIT = 0.1
"""Strain, rotation (rad) or loss of volume beyond which linear elasticity does not hold, nor small-strain kinematics."""
VOLUME_SHARE = 0.05
"""Share of a body's volume that must exceed these; peaks under an edge depend on the mesh."""


class Deformation(NamedTuple):
    """Strain and rotation (rad) of a body: those that `VOLUME_SHARE` of its volume exceeds, and the largest."""

    strain: float
    rotation: float
    most_strain: float
    most_rotation: float

    def beyond(self, other: Deformation) -> Deformation:
        """The larger of each."""
        return Deformation(*map(max, zip(self, other)))


REST = Deformation(0.0, 0.0, 0.0, 0.0)


class Validity:
    """Looks at every committed increment, and keeps the largest of what it sees."""

    def __init__(self, system: System, policy: Policy) -> None:
        self.system, self.policy = system, policy
        p = system.problem
        self.small = p.kinematics == "small" and not p.allow_large_strain
        self.metals = dict(metals_of(p))
        self.seen: dict[str, Deformation] = {}
        self.used_to: dict[str, float] = {}
        self.beyond_tests: dict[str, float] = {}
        self.fastest: dict[str, float] = {}
        self.rubbed: dict[tuple[str, str], tuple[float, float]] = {}
        self.squeezed: dict[str, float] = {}
        self.too_soft: dict[str, ForceShare] = {}
        self.unbalanced = ForceShare()
        self.stretched: set[str] = set()
        self.reported: set[str] = set()
        self._slopes: dict[str, Array] = {}
        self._areas: dict[str, Array] = {}
        self._volumes: dict[str, Array] = {}
        self._left_out: dict[str, float] = {}
        self.finite = p.kinematics == "finite" and p.remesh == "off"

    def __call__(self, given: Committed) -> Iterator[Finding]:
        """Note a committed increment, and end the run with one in which small-strain kinematics does not hold."""
        self.look_at_friction(given.context, given.evaluation)
        self._note_rates(given.context, given.state.history)
        # of condensed bodies the displacements are known at the end of a step
        if given.complete and (reason := self.look(given.state.u, given.state.history)):
            yield ended_by(reason)
        if given.complete:
            for body, energy in self._left_out.items():
                self.too_soft.setdefault(body, ForceShare()).note(given, energy)
            self.unbalanced.note(given, given.state.energy.imbalance)
        yield from self._elastic_metals()

    def _elastic_metals(self) -> Iterator[Finding]:
        """As soon as it is seen, once a body: elastic metals that are strained as no metal can be."""
        for body in sorted(self.stretched - self.reported):
            self.reported.add(body)
            yield warning(
                f"body {body!r} is elastic with the modulus of a metal, and a twentieth of it is strained by more than "
                f"{STRAIN_WARNING:g}: {YIELDS_BEFORE}"
            )

    def look(self, u: Array, history: Sequence[Array]) -> BeyondSmall | None:
        """Note an increment that ends at dofs u (ndof,) with a ``history``; why it is refused, or None."""
        self._note_flow(history)
        if self.finite:
            for block in self.system.blocks:
                self._note_shape(block, self.system.displacement(u))
        if not self.small:
            return None
        for block in self.system.blocks:
            now = self._deformation(block, self.system.displacement(u))
            self.seen[block.body] = now.beyond(self.seen.get(block.body, REST))
            # What a twentieth of the volume exceeds, not the peak, which is the mesh's: under the edge of a flat punch 0.5
            # where that is 0.04. A shorter increment would end there too, so nothing is cut.
            if max(now.strain, now.rotation) > STRAIN_LIMIT:
                del self.seen[block.body]  # reported as the failure
                return BeyondSmall(block.body, *now)
        return None

    def look_at_friction(self, c: Context, e: Evaluation) -> None:
        """Note where an increment went beyond what the friction of its contacts was measured for."""
        for s, law, f, before in zip(self.system.surfaces, c.laws, e.contacts, c.committed):
            ends = law.known_to() if law is not None else {}
            touching = f.p > 0
            if not ends or not touching.any():
                continue
            speed = (f.kappa - before.slip) / c.seconds
            reached = {"pressure": f.p * f.weight / f.area, "slip": f.kappa, "speed": speed}
            for name, end in ends.items():
                most = float(reached[name][touching].max())
                if most > end * (1.0 + NO_DIFFERENCE):
                    self.rubbed[s.name, name] = end, max(most, self.rubbed.get((s.name, name), (0.0, 0.0))[1])

    def _without_bound(self, body: str) -> bool:
        """Whether friction that grows with the pressure for ever acts on a body."""
        p = self.system.problem
        laws = [s.description.friction or p.friction for s in self.system.tool_contacts if s.acts_on((body,))]
        return any(law is not None and law.proportional and not law.frictionless for law in laws)

    def warnings(self, _: Finished | Failed) -> Iterator[Finding]:
        """The largest of what was seen."""
        yield from map(warning, self._sentences())

    def _sentences(self) -> Iterator[str]:
        """Sentences about what was exceeded."""
        for body, d in self.seen.items():
            if max(d.strain, d.rotation) > STRAIN_WARNING:
                yield (
                    f"body {body!r} is strained by up to {d.most_strain:.2g} and rotated by up to "
                    f"{in_degrees(d.most_rotation)}, a twentieth of it by more than {d.strain:.2g} and "
                    f"{in_degrees(d.rotation)}: 'kinematics: small' neglects terms of that size; use 'finite', or add "
                    "'allow_large_strain: true'"
                )
        yield from self._of_compression()
        for body, strain in self.used_to.items():
            end = self.system.problem.bodies[body].material.flow.known_to()
            yield (
                f"the flow curve of body {body!r} ends at a plastic strain of {end:g} and was used up to {strain:.3g}, where "
                "its last stress is kept; give stresses up to there"
            )
        yield from self._of_metals()
        for (contact, name), (end, most) in self.rubbed.items():
            yield (
                f"the friction of contact {contact!r} has a table that ends at a {name} of {end:g} and was used up to "
                f"{most:.3g}, where its last value is kept; give values up to there"
            )

    def _of_compression(self) -> Iterator[str]:
        """Sentences about bodies that flow and lose volume, where their forces show it."""
        for body, lost in self.squeezed.items():
            much = f"body {body!r}: a twentieth of it has lost more than {per_cent(lost)} of its volume"
            soft, missed = self.too_soft[body].at_most_work(), abs(self.unbalanced.at_most_work())
            rubbed = self._without_bound(body)
            if soft > STRAIN_WARNING:
                yield (
                    f"{much}, where metals are stiffer than a constant bulk modulus, and forces are too low by an estimated "
                    f"{per_cent(soft)}; plastic flow preserves volume: tools and supports leave it no room"
                    + ", or friction that no shear strength bounds presses it" * rubbed
                    + "; check supports and travels" + ", and take 'capped' or 'shear' friction" * rubbed
                )  # fmt: skip
            elif missed > SLIGHT:
                yield (
                    f"{much}, and under such pressures the work of its elements' stresses differs from that of their forces by "
                    f"{per_cent(missed)}: the mesh is too coarse; take a finer one, and check the forces of both"
                )

    def _of_metals(self) -> Iterator[str]:
        """Sentences about metals that left the range of their tests."""
        for body, strain in self.beyond_tests.items():
            metal = self.metals[body]
            yield (
                f"the flow curve of body {body!r}, {metal.name}, was measured up to a plastic strain of {metal.strain[1]:g} and "
                f"was used up to {strain:.3g}: beyond its tests it is extrapolated; compare with a curve measured up to there"
            )
        for body, rate in self.fastest.items():
            metal = self.metals[body]
            low, high = metal.rate or (0.0, math.inf)
            if low <= rate * (1.0 + NO_DIFFERENCE) and rate <= high * (1.0 + NO_DIFFERENCE):
                continue
            yield (
                f"body {body!r}, {metal.name}, deforms at plastic strain rates of up to {rate:.3g} /s, and its flow curve was "
                f"measured at {low:g} to {high:g} /s; take a curve of that rate, or see whether 'duration' is what was meant"
            )

    def _note_rates(self, c: Context, history: Sequence[Array]) -> None:
        """Note the largest plastic strain rate of metals with a range of rates, where the step says how long it lasts."""
        rated = {body for body, metal in self.metals.items() if metal.rate is not None}
        if not rated or not self.system.has_memory or stated(self.system.problem.steps[c.plan.number]) is None:
            return
        for block, old, new in zip(self.system.blocks, c.state.history, history):
            if block.body in rated and block.law.plastic:
                rise = block.field(new, "plastic_strain") - block.field(old, "plastic_strain")
                rate = float(rise.max()) / c.seconds
                self.fastest[block.body] = max(rate, self.fastest.get(block.body, 0.0))

    def _note_shape(self, block: Block, moved: Array) -> None:
        """Note the loss of volume of a body that flows, or the strain of an elastic metal, where a share exceeds it."""
        problem = self.system.problem
        if block.law.plastic:
            if problem.space != "plane stress":
                self._note_volume(block, moved)
            return
        if block.body in self.stretched or not elastic_metal(problem, block, self.policy):
            return
        F = np.eye(moved.shape[1]) + self._gradients(block, moved)
        square = np.maximum(principal(np.swapaxes(F, 1, 2) @ F), SMALLEST)  # of the principal stretches
        strain = _exceeded(0.5 * np.abs(np.log(square)).max(axis=1), block.volume.sum(axis=1), VOLUME_SHARE)
        if strain > STRAIN_WARNING:
            self.stretched.add(block.body)

    def _note_volume(self, block: Block, moved: Array) -> None:
        """Note the loss of volume of a body that flows, at the centres of its elements, where a share exceeds it.

        And the energy of compression that its constant bulk modulus leaves out. Where little is lost, so is that.
        """
        if block.body not in self._volumes:
            self._volumes[block.body] = block.volume.sum(axis=1)
        det, volume = self._determinants(block, moved), self._volumes[block.body]
        material = self.system.problem.bodies[block.body].material
        bulk = material.modulus / (3.0 * (1.0 - 2.0 * material.poisson))
        self._left_out[block.body] = bulk * float(volume @ _stiffening(det))
        known = max(STRAIN_LIMIT, self.squeezed.get(block.body, 0.0))
        kept = float(volume[1.0 - det <= known].sum())
        if kept < (1.0 - VOLUME_SHARE) * float(volume.sum()):  # most increments need no sorting
            lost = _exceeded(1.0 - det, volume, VOLUME_SHARE)
            if lost > known:
                self.squeezed[block.body] = lost

    def _determinants(self, block: Block, moved: Array) -> Array:
        """Determinants (m,) of the deformation gradients at the centres of elements whose nodes are ``moved`` (n, d).

        Of quadratic elements the mean: their sides curve, and flow preserves the volume within these.
        """
        if block.cells.shape[1] > block.corners.shape[1]:
            x = np.ascontiguousarray((self.system.X + moved)[block.cells])
            return np.asarray(block.element.volumes(x, block.mode)[0].sum(axis=1) / self._volumes[block.body])
        if self.system.dofs.dimension == 3:
            return np.asarray(np.linalg.det(np.eye(3) + self._gradients(block, moved)))
        corners, X = block.corners.T, self.system.X
        if block.body not in self._areas:
            self._areas[block.body] = _area(X, corners)
        # of bilinear elements too, det F at the centre is what the area of the corners became
        det = _area(X + moved, corners) / self._areas[block.body]
        if self.system.axisymmetric:
            det *= 1.0 + moved[:, 0].take(corners).sum(axis=0) / X[:, 0].take(corners).sum(axis=0)
        return det

    def _gradients(self, block: Block, moved: Array) -> Array:
        """Displacement gradients (m, d, d) at the centres of elements whose nodes are ``moved`` (n, d)."""
        if block.body not in self._slopes:
            self._slopes[block.body] = slopes(self.system.X[block.corners])
        return np.asarray(np.einsum("mai,maj->mij", moved.take(block.corners, axis=0), self._slopes[block.body]))

    def _note_flow(self, history: Sequence[Array]) -> None:
        if not self.system.has_memory:
            return
        for block, values in zip(self.system.blocks, history):
            flow: FlowCurve | None = getattr(self.system.problem.bodies[block.body].material, "flow", None)
            metal = self.metals.get(block.body)
            if flow is None or not block.law.plastic or (metal is None and not math.isfinite(flow.known_to())):
                continue
            strain = float(block.field(values, "plastic_strain").max())
            ends = [(self.used_to, flow.known_to()), (self.beyond_tests, math.inf if metal is None else metal.strain[1])]
            for noted, end in ends:
                if strain > end * (1.0 + NO_DIFFERENCE):
                    noted[block.body] = max(strain, noted.get(block.body, 0.0))

    def _deformation(self, block: Block, moved: Array) -> Deformation:
        """Of a body with nodes ``moved`` (n, d) from their initial places."""
        H = self._gradients(block, moved)
        turned = np.swapaxes(H, 1, 2)
        strain = np.abs(principal(0.5 * (H + turned))).max(axis=1)
        if self.system.axisymmetric:
            hoop = moved[block.corners, 0].sum(axis=1) / self.system.X[block.corners, 0].sum(axis=1)
            strain = np.maximum(strain, np.abs(hoop))
        # half the curl, whose square is half that of the skew part
        rotation = np.arctan(np.sqrt(0.125 * ((H - turned) ** 2).sum(axis=(1, 2))))
        volume = block.volume.sum(axis=1)
        much, far = (_exceeded(v, volume, VOLUME_SHARE) for v in (strain, rotation))
        return Deformation(much, far, float(strain.max()), float(rotation.max()))


def _area(x: Array, corners: Index) -> Array:
    """Twice the areas (m,) of triangles or quadrilaterals with ``corners`` (3|4, m) among points x (n, 2)."""
    at = x.take(corners, axis=0)
    one, other = (at[2] - at[0], at[3] - at[1]) if len(at) == 4 else (at[1] - at[0], at[2] - at[0])
    return cross(one, other)


def slopes(x: Array) -> Array:
    """Derivatives ∂N_a/∂x_j (m, a, d) of the shape functions of elements x (m, a, d) with a corners at their centres."""
    d = x.shape[2]
    if x.shape[1] == d + 1:
        g = np.vstack([-np.ones((1, d)), np.eye(d)])
    else:
        ring = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2**d
        g = ring if d == 2 else np.vstack([np.insert(ring, 2, end, axis=1) for end in (-0.125, 0.125)])
    return np.asarray(g @ np.linalg.inv(np.einsum("maj,ak->mjk", x, g)))


def elastic_metal(problem: Problem, block: Block, policy: Policy) -> bool:
    """Whether the elements of a block have the modulus of a metal and no flow."""
    gpa = factor("1 GPa", problem.units.length, problem.units.force, (1, -2))
    return not block.law.plastic and problem.bodies[block.body].material.modulus >= policy.metal_modulus * gpa


def principal(S: Array) -> Array:
    """Principal values (m, d) of symmetric tensors (m, d, d), in the plane from Mohr's circle."""
    if S.shape[1] == 3:
        return np.asarray(np.linalg.eigvalsh(S))
    middle, radius = 0.5 * (S[:, 0, 0] + S[:, 1, 1]), np.hypot(0.5 * (S[:, 0, 0] - S[:, 1, 1]), S[:, 0, 1])
    return np.stack([middle - radius, middle + radius], axis=1)


def _stiffening(det: Array) -> Array:
    """Energy, per initial volume and bulk modulus, that Birch's equation of state has beyond ½ ln² J where J = det (m,) < 1.

    That of second order, 9/2 f² with f = ½ (J^(−2/3) − 1) (Birch, Phys. Rev. 71, 1947, 809): under pressure the bulk modulus
    rises by four times the pressure, that of metals by four to six times. ½ ln² J is Hencky's law, whose modulus rises by twice.
    """
    J = np.where(det > 0.0, np.minimum(det, 1.0), 1.0)  # of an element that is turned inside out nothing is known
    f = 0.5 * (J ** (-2.0 / 3.0) - 1.0)
    return np.asarray(4.5 * f**2 - 0.5 * np.log(J) ** 2)


def _exceeded(values: Array, volume: Array, share: float) -> float:
    """The value (of (m,)) that a share of the volume exceeds."""
    order = np.argsort(values)
    below = np.cumsum(volume[order])
    return float(values[order][min(int(np.searchsorted(below, (1.0 - share) * below[-1])), len(order) - 1)])
