"""Materials of one's own written as a point function: compiled, with all their derivatives generated.

It derives from `PointMaterial` and states its energy; one that flows says what is left of its strain too::

    class Exponentiated(pr.PointMaterial):
        E: float
        nu: float
        k: float

        def energy(self, strain):
            G, K = self.E / (2 + 2 * self.nu), self.E / (3 - 6 * self.nu)
            d = strain.deviator
            return G / self.k * (exp(self.k * d.dot(d)) - 1) + 0.5 * K * strain.trace**2
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from prensa.errors import ArgumentError
from prensa.kernels import algebra
from prensa.kernels.differentiate import forward, reverse, units
from prensa.kernels.emit import Kind, Marks, Program, Rows, Shared, puts
from prensa.kernels.machine_code import generated
from prensa.kernels.record import ONE, ZERO, Node, as_found, differs, given, many, one_like, sqrt, where
from prensa.kernels.template import Template
from prensa.layout import PLANE, TensorLayout
from prensa.materials.corotational import Tensor, from_axes, in_axes, kirchhoff, turned_axes
from prensa.materials.flow_curve import NO_TABLE, stress_at
from prensa.materials.hardening import TABLE_ARRAYS, Curve, scalars, table_at
from prensa.materials.j2 import TABLES
from prensa.materials.material import Material
from prensa.materials.motion import MOTION_OF, Motion, admissible
from prensa.materials.point_form import Found, Given, PointLaw
from prensa.materials.protocol import At, Field, Out
from prensa.materials.protocol import Material as Law
from prensa.types import Array

AXES_NUMBERS = {2: 2, 3: 6}
"""Numbers of the history that say how the axes lie: cosine and sine of an angle, or the first two axes in space."""


class PointAt(NamedTuple):
    """What a point function may depend on besides its strain: seconds ``dt``, volume ``J`` over the initial one, ``J_n`` before.

    ``temperature``: None where nobody says it. ``active``: see `flowing`. ``curve``: the flow curve of the field ``flow``.
    """

    dt: Node
    J: Node
    J_n: Node
    temperature: Node | None = None
    active: Node | None = None
    curve: Curve | None = None

    def flowing(self, beyond: Node) -> Node:
        """Whether the point flows: where its trial stress is beyond the limit, or where a solver holds it."""
        return beyond if self.active is None else self.active

    def flow_stress(self, strain: Node, rise: Node | None = None) -> Node:
        """Of the field ``flow`` at an equivalent plastic strain; ``rise``: what the increment brought of it, None: before it."""
        assert self.curve is not None
        return self.curve.at_rest(strain) if rise is None else self.curve.stress(strain, rise, self.dt)


class PointMaterial(Material, abstract=True):
    """Base of materials whose law is a point function: plain Python on numbers with the functions of `prensa.kernels.record`.

    Strains are logarithmic elastic ones, ½ ln b_e, in finite kinematics, and those of small strain in small; stresses are
    Kirchhoff's. Plastic flow keeps the volume. Derivatives are exact, those by the fields that are numbers too. Increments of
    second order in time are those of backward Euler from a shifted beginning, of the variables too.
    """

    variables: ClassVar[tuple[str, ...]] = ()
    """Names of numbers that a point remembers, 0 at first; ``plastic_strain`` and ``plastic_work`` of one that is ``plastic``."""
    directed: ClassVar[bool] = False
    """Whether it depends on directions: tensors then have the components along the material's own axes, which turn with it."""
    symmetric: ClassVar[bool | None] = None
    """Whether its tangent is symmetric; None: that of an elastic material is."""

    def energy(self, strain: Tensor) -> Any:
        """Stored energy per initial volume at an elastic strain."""
        raise NotImplementedError(f"{type(self).__name__} states no energy: define energy(self, strain)")

    def stress(self, strain: Tensor) -> Tensor:
        """Stress at an elastic strain: the derivative of `energy`, unless a material states it."""
        return _derivative(self.energy, strain)

    def respond(self, trial: Tensor, old: Sequence[Any], at: PointAt) -> tuple[Tensor, Sequence[Any]]:
        """Elastic strain and variables after an increment; ``trial``: what the strain is if nothing flows, ``old``: variables."""
        return trial, old

    def flow_stress(self, strain: Array) -> Array:
        """Flow stress (k,) at rest at equivalent plastic strains (k,), of one that is ``plastic``: that of its field ``flow``."""
        curve: Any = getattr(self, "flow", None)
        if curve is None:
            raise NotImplementedError(f"{type(self).__name__} states no flow stress: define flow_stress(self, strain)")
        return stress_at(curve, strain, np.zeros_like(strain))

    def shear_strength(self, flow_stress: Array, layout: TensorLayout) -> Array:
        """Shear stress at which it yields at flow stresses (k,): σ_y/√3, von Mises', unless a material states another."""
        return flow_stress / np.sqrt(3.0)

    def equivalent(self, stress: Tensor) -> Any:
        """Equivalent stress of its yield function, von Mises' unless a material states another."""
        d = stress.deviator
        return sqrt(1.5 * d.dot(d))

    def axes(self, X: Array) -> Array:
        """Angles (k,) in radians of the first material axis to x at initial places X (k, 2 or 3), of one that is ``directed``."""
        return np.zeros(len(X))

    def directions(self, X: Array) -> Array:
        """First and second axis (k, 2, 3) at initial places X (k, 3) in space; turned by `axes` about z unless it says other."""
        angle = self.axes(X)
        c, s, none = np.cos(angle), np.sin(angle), np.zeros(len(X))
        return np.stack([np.stack([c, s, none], axis=-1), np.stack([-s, c, none], axis=-1)], axis=1)

    def bulk_law(self, finite: bool, **tensors: Any) -> Law:
        """The law.

        Raises
        ------
        ArgumentError
            For a flow curve that is not compiled, and in three dimensions where it is a material of the plane.

        """
        name = type(self).__name__
        layout: TensorLayout = tensors.get("layout", PLANE)
        if layout is not PLANE and not self.in_space:
            raise ArgumentError(f"{name}: it has no law in three dimensions")
        curve: Any = getattr(self, "flow", None)
        if curve is not None and curve.kernel() is None:
            raise ArgumentError(f"{name}: its flow curve {type(curve).__name__} is not compiled; derive it from PointCurve")
        missing = {"plastic_strain", "plastic_work"} - set(self.variables) if self.plastic else set()
        if missing:
            raise ArgumentError(f"{name}: it is plastic and has no {' and '.join(sorted(missing))} among its variables")
        return PointMaterialLaw(self, finite, layout)


def _derivative(energy: Any, strain: Tensor) -> Tensor:
    """Of an energy by a strain, exact."""
    # Nodes of their own, at which `reverse` stops: components may be made of one another.
    at = [as_found(x, x) for x in strain]
    slopes = reverse([energy(Tensor(*at))], [ONE], at)
    return Tensor(*slopes[:3], *(0.5 * x for x in slopes[3:]))


@dataclass(frozen=True)
class Form:
    """The `PointForm` of a material: what it is without its numbers, its flow curve, whether it is of finite strain.

    Numbers p: seconds, the material's fields, the scalars of its curve.
    """

    template: Template
    curve: Template | None
    finite: bool
    layout: TensorLayout = PLANE

    @classmethod
    def of(cls, material: PointMaterial, finite: bool, layout: TensorLayout, seconds: float) -> PointLaw:
        """With the numbers of a material."""
        template, p, tables = Template.of(material, ["flow"] if hasattr(material, "flow") else [])
        if tables:
            raise ArgumentError(f"{template.description.__name__}: a material has no table but that of its field 'flow'")
        curve: Any = material.flow.kernel() if hasattr(material, "flow") else None
        if curve is None:
            return PointLaw(cls(template, None, finite, layout), np.append(seconds, p), *NO_TABLE)
        own = cls(template, curve.kind, finite, layout)
        return PointLaw(own, np.hstack([seconds, p, curve.p]), curve.knots, curve.coefficients)

    @property
    def material(self) -> type[PointMaterial]:
        """Its class."""
        found: type[PointMaterial] = self.template.description
        return found

    @property
    def motion(self) -> Motion:
        """Kinematics of plane or space."""
        return MOTION_OF[self.layout]

    @property
    def strain(self) -> slice:
        """Columns of b_e − I or the elastic strain."""
        return slice(0, self.layout.kept)

    @property
    def axes(self) -> slice:
        """Columns of the axes, none of a material that has none; see `AXES_NUMBERS`."""
        many = AXES_NUMBERS[self.layout.dimension] if self.material.directed else 0
        return slice(self.strain.stop, self.strain.stop + many)

    @property
    def first_variable(self) -> int:
        """Column of the first variable."""
        return self.axes.stop

    @property
    def size(self) -> int:
        """Columns of the history: b_e − I or the elastic strain, the axes of a material that has some, the variables.

        Of one that flows the trial tensor, see `prensa.materials.laws.J2`, and the last rise of each variable too.
        """
        return self.rises.stop if self.material.plastic else self.variables.stop

    @property
    def variables(self) -> slice:
        """Columns of the variables."""
        return slice(self.first_variable, self.first_variable + len(self.material.variables))

    @property
    def trial(self) -> slice:
        """Columns of the trial tensor of a material that flows."""
        return slice(self.variables.stop, self.variables.stop + self.strain.stop)

    @property
    def rises(self) -> slice:
        """Columns of the last rises of the variables of a material that flows."""
        return slice(self.trial.stop, self.trial.stop + len(self.material.variables))

    @property
    def numbers(self) -> int:
        """How many there are."""
        return 1 + self.template.numbers + scalars(self.curve)

    @property
    def table_at(self) -> int | None:
        """Place of a table's numbers."""
        at = table_at(self.curve)
        return None if at is None else 1 + self.template.numbers + at

    def point(
        self, h: Sequence[Node], old: Sequence[Node], p: Sequence[Node], begun: bool, active: Node | None = None,
        warm: Node | None = None,
    ) -> Point:  # fmt: skip
        """The law at a gradient h, from a history; ``begun``: from one of `begin`, else a committed one."""
        material: PointMaterial = self.template.filled(p[1:])
        motion, axes, b = self.motion, tuple(old[self.axes]), old[self.strain]
        t, J, J_n = self._carried(h, b), one_like(h[0]), one_like(h[0])
        trial = Tensor(*t)
        if self.finite:
            trial, J, J_n = Tensor(*motion.logarithm(t)), sqrt(motion.determinant(t)), sqrt(motion.determinant(b))
            if axes:
                axes = turned_axes(h, b, trial, axes)
        if axes:
            trial = in_axes(trial, axes)
        curve = None if self.curve is None else Curve(self.curve, p[1 + self.template.numbers :], TABLE_ARRAYS)
        was = old[self.variables]
        elastic, variables = material.respond(trial, was, PointAt(p[0], J, J_n, warm, active, curve))
        if elastic is not trial and not material.plastic:
            raise ArgumentError(f"{self.material.__name__} returns another strain than 'trial': say that it is plastic")
        stress, left, energy = material.stress(elastic), elastic, material.energy(elastic)
        if axes:
            stress = from_axes(kirchhoff(stress, elastic) if self.finite else stress, axes)
            left = from_axes(elastic, axes)
        history = [*t, *axes, *variables]
        if material.plastic:
            moved = _any_differs(elastic, trial)
            new = motion.exponential(tuple(left)) if self.finite else tuple(left)
            history[self.strain] = kept = [where(moved, x, y) for x, y in zip(new, t)]
            as_if = self._carried(h, old[self.trial] if begun else b)
            history += [where(moved, a, b) for a, b in zip(as_if, kept)]
            shifts = old[self.rises] if begun else [ZERO] * len(was)
            # The rise since the last commit, the shift with which the increment began included.
            history += [where(moved, a - b + c, 0.0) for a, b, c in zip(variables, was, shifts)]
        return Point(stress, history, energy, t)

    def _carried(self, h: Sequence[Node], b: Sequence[Node]) -> tuple[Node, ...]:
        """What b_e − I, or an elastic strain, becomes if nothing flows."""
        if self.finite:
            return self.motion.push_forward(h, b)
        H = algebra.tensor(h)
        return tuple(
            x + (H[4 * i] if i == j else 0.5 * (H[3 * i + j] + H[3 * j + i])) for x, (i, j) in zip(b, self.layout.symmetric)
        )

    def at_rest(self, old: Sequence[Node], p: Sequence[Node]) -> tuple[Tensor, Node]:
        """Cauchy stress along x, y and z and stored energy per initial volume of a committed history."""
        material: PointMaterial = self.template.filled(p[1:])
        b, axes = old[self.strain], tuple(old[self.axes])
        strain = Tensor(*(self.motion.logarithm(b) if self.finite else b))
        strain = in_axes(strain, axes) if axes else strain
        stress, energy = material.stress(strain), material.energy(strain)
        if axes:
            stress = from_axes(kirchhoff(stress, strain) if self.finite else stress, axes)
        return stress * (1.0 / sqrt(self.motion.determinant(b))) if self.finite else stress, energy

    def begin(self, old: Sequence[Node], share: Node) -> list[Node]:
        """A history after a ``share`` of what the last increment has brought more; rises are then what variables shifted by."""
        b, out, motion = old[self.strain], list(old), self.motion
        e, was = (motion.logarithm(x) if self.finite else x for x in (b, old[self.trial]))
        moved = _any_differs(Tensor(*b), Tensor(*old[self.trial]))
        flow = share * (Tensor(*was) - Tensor(*e)).deviator
        less = tuple(Tensor(*e) - flow)
        new = motion.exponential(less) if self.finite else less
        shifts = [where(moved, share * x, 0.0) for x in old[self.rises]]
        out[self.strain] = [where(moved, x, y) for x, y in zip(new, b)]
        out[self.variables] = [x + y for x, y in zip(old[self.variables], shifts)]
        out[self.trial], out[self.rises] = b, shifts
        return out

    def answer(self, h: Sequence[Node], at: Given) -> Found:
        """The law at a gradient of the increment."""
        begun = at.committed if at.share is None else self.begin(at.committed, at.share)
        found, names = self.point(h, begun, at.p, at.share is not None), self.material.variables
        work, strains = ZERO, (ZERO, ZERO, ZERO)
        if self.material.plastic:
            work = found.history[self.first_variable + names.index("plastic_work")]
            k = self.first_variable + names.index("plastic_strain")
            strains = at.committed[k], begun[k], found.history[k]
        volume = sqrt(self.motion.determinant(begun[self.strain]))
        return Found(tuple(found.stress), found.history, found.energy, work, volume, strains)


class Point(NamedTuple):
    """What a law answers: Kirchhoff stress along x, y and z, history, stored energy, trial b_e − I or strain."""

    stress: Tensor
    history: Sequence[Node]
    energy: Node
    trial: Sequence[Node]


def _any_differs(a: Tensor, b: Tensor) -> Node:
    first, *others = (differs(x, y) for x, y in zip(a, b))
    for one in others:
        first = first | one
    return first


@generated
def _update(form: Form, begun: bool, tangent: bool, held: bool, heated: bool) -> Program:
    h, old, flag = many("h", form.layout.components), many("old", form.size), given("failed", 0)
    active, warm = given("held", 0) if held else None, given("temperature", 0) if heated else None
    found, motion = form.point(h, old, many("p", form.numbers), begun, active, warm), form.motion
    s: tuple[Node, ...] = tuple(found.stress)
    if form.finite:
        P = motion.first_piola(h, s, 1.0 / sqrt(motion.determinant(old[form.strain])))
        flag = flag | ~admissible(h, found.trial)
    else:
        P = algebra.components(algebra.symmetric(s), h)
    # What differs from itself is NaN: a root that was not found, or a user's formula outside its domain.
    for x in (*found.history[form.strain.stop :], *s):
        flag = flag | differs(x, x)
    written = [*puts("P", P), *puts("new", found.history), *puts("failed", [flag])]
    if tangent:
        written += puts("A", [x for row in forward(P, units(h), len(h)) for x in row])
    arrays: dict[str, Kind] = {
        "h": Rows(len(h)), "old": Rows(form.size), "p": Shared(), **TABLES, "held": Marks(), "temperature": Rows(1),
        "P": Rows(len(h)), "A": Rows(len(h) ** 2), "new": Rows(form.size), "failed": Marks(),
    }  # fmt: skip
    return Program(arrays, written)


@generated
def _at_rest(form: Form) -> Program:
    stress, energy = form.at_rest(many("old", form.size), many("p", form.numbers))
    arrays: dict[str, Kind] = {"old": Rows(form.size), "p": Shared(), "out": Rows(form.layout.kept + 1)}
    return Program(arrays, puts("out", [*stress, energy]))


@generated
def _begin(form: Form) -> Program:
    arrays: dict[str, Kind] = {"old": Rows(form.size), "share": Shared(), "new": Rows(form.size)}
    return Program(arrays, puts("new", form.begin(many("old", form.size), given("share", 0))))


@dataclass(frozen=True)
class PointMaterialLaw:
    """The law of a `PointMaterial`; fields of the history: see `Form.size`."""

    material: PointMaterial
    finite: bool
    layout: TensorLayout = PLANE

    @cached_property
    def _form(self) -> Form:
        form: Any = Form.of(self.material, self.finite, self.layout, 0.0).form
        return form

    @property
    def size(self) -> int:
        """Columns of the history."""
        return self._form.size

    @property
    def fields(self) -> Mapping[str, Field]:
        """Of the history."""
        out = {"elastic": Field(self._form.strain, travel="strain")}
        if self.material.directed:
            out["axes"] = Field(self._form.axes, self._axes, "axes")
        for k, name in enumerate(self.material.variables, self._form.first_variable):
            out[name] = Field(slice(k, k + 1), travel="growing" if name in ("plastic_strain", "plastic_work") else "smooth")
        if self.plastic:
            out |= {"trial": Field(self._form.trial, travel="flow"), "rises": Field(self._form.rises)}
        return out

    def _axes(self, X: Array) -> Array:
        """Cosine and sine (n, 2) of the angle of the axes at initial places (n, 2); in space the first two axes (n, 6)."""
        if self.layout is not PLANE:
            return self.material.directions(X).reshape(len(X), -1)
        angle = self.material.axes(X)
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    @property
    def plastic(self) -> bool:
        """As the material."""
        return self.material.plastic

    @property
    def linear(self) -> bool:
        """False: nobody says so."""
        return False

    @property
    def fbar_has_energy(self) -> bool:
        """False."""
        return False

    @property
    def symmetric(self) -> bool:
        """As the material says; elastic ones derive from an energy."""
        said = self.material.symmetric
        return not self.plastic if said is None else said

    @property
    def E(self) -> float:
        """Young's modulus."""
        return self.material.modulus

    @property
    def nu(self) -> float:
        """Poisson's ratio."""
        return self.material.poisson

    def modulus(self) -> float:
        """Plane-strain modulus E/(1 − ν²)."""
        return self.E / (1.0 - self.nu**2)

    def confined_modulus(self) -> float:
        """Stress over strain of a layer that cannot spread."""
        return self.E * (1.0 - self.nu) / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))

    def thickness(self, history: Array) -> Array | None:
        """None: the law does not change the thickness that the element integrates over."""
        return None

    def point_law(self, seconds: float) -> PointLaw | None:
        """Of finite strain in the plane."""
        return Form.of(self.material, True, PLANE, seconds) if self.finite and self.layout is PLANE else None

    def update(self, h: Array, old: Array, at: At, out: Out) -> None:
        """H (n, c) = f − I, old (n, h) → out; see `Material`."""
        form, p, knots, coefficients = Form.of(self.material, self.finite, self.layout, at.dt)
        held = out.failed if at.flows is None else at.flows
        warm = np.zeros(len(h)) if at.temperature is None else at.temperature
        begun = at.begun and self.plastic  # others begin as they were committed
        kernel = _update(form, begun, at.tangent, at.flows is not None, at.temperature is not None)
        kernel(len(h), h, old, p, knots, coefficients, held, warm[:, None], out.P, out.A, out.new, out.failed)

    def begin(self, history: Array, share: float) -> Array:
        """What an increment begins with: a committed history (n, h) after a ``share`` of what the last one has brought more."""
        form, out = self._form, history.copy()
        if share:
            _begin(form)(len(history), history, np.array([share]), out)
        else:
            out[:, form.trial], out[:, form.rises] = history[:, form.strain], 0.0
        return out

    def _at_rest(self, history: Array) -> Array:
        """Cauchy stress and energy (n, k + 1) of committed histories (n, h)."""
        out = np.empty((len(history), self.layout.kept + 1))
        form, p, _, _ = Form.of(self.material, self.finite, self.layout, 0.0)
        _at_rest(form)(len(history), history, p, out)
        return out

    def energy(self, history: Array) -> Array:
        """Elastic energy per initial volume, (..., h) → (...)."""
        flat = np.ascontiguousarray(history.reshape(-1, history.shape[-1]))
        return self._at_rest(flat)[:, -1].reshape(history.shape[:-1])

    def cauchy(self, history: Array) -> Array:
        """Cauchy stress xx, yy, zz, xy[, xz, yz] of committed histories (n, h) → (n, k)."""
        return np.ascontiguousarray(self._at_rest(history)[:, :-1])

    def flow_stress(self, strain: Array) -> Array:
        """Flow stress (n,) at plastic strains (n,), at rest."""
        return np.asarray(self.material.flow_stress(strain), dtype=np.float64) + np.zeros_like(strain)

    def equivalent_stress(self, history: Array) -> Array:
        """Equivalent stress (n,) of committed histories (n, h)."""
        stress = Tensor(*self.cauchy(history).T)
        if self.material.directed:
            stress = in_axes(stress, tuple(history[:, self._form.axes].T))
        return np.asarray(self.material.equivalent(stress))

    def shear_strength(self, history: Array) -> Array:
        """Shear yield stress (n,) of committed histories (n, h)."""
        k = self._form.first_variable + self.material.variables.index("plastic_strain")
        return self.material.shear_strength(self.flow_stress(np.ascontiguousarray(history[:, k])), self.layout)
