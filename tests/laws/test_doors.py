"""Suites for flow curves and materials, prensa's own and users'; wrong ones are reported in words."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

import prensa as pr
from prensa.materials.laws import J2, Hencky
from prensa.materials.material import material_of
from prensa.materials.return_map import return_map
from prensa.model.schema import dump, loads
from prensa.registry import DOORS, examples
from prensa.testing import LawError, check_flow, check_material


class Power(pr.FlowCurve):
    """As a user writes it: the stress alone."""

    s0: float
    K: float
    n: float

    def stress(self, strain, rate):
        return self.s0 + self.K * strain**self.n


class Viscous(pr.FlowCurve):
    """Cowper and Symonds (1957): the stress depends on the rate, the derivatives are found."""

    s0: float
    H: float
    D: float
    q: float

    def stress(self, strain, rate):
        return (self.s0 + self.H * strain) * (1 + (rate / self.D) ** (1 / self.q))


class Real(pr.FlowCurve):
    """The absolute value takes the imaginary part of a complex number away: differences stand in."""

    s0: float

    def stress(self, strain, rate):
        return self.s0 * (1 + np.abs(strain)) ** 0.2


FLOWS = {
    "perfect": pr.Perfect(250.0),
    "linear": pr.Linear(250.0, 500.0),
    "ludwik": pr.Ludwik(250.0, 500.0, 0.3),
    "swift": pr.Swift(565.0, 0.007, 0.26),
    "voce": pr.Voce(60.0, 120.0, 8.0),
    "hockett-sherby": pr.HockettSherby(100.0, 300.0, 2.0, 0.7),
    "johnson-cook": pr.JohnsonCook(250.0, 500.0, 0.3, 0.02, 1e-3),
    "table": pr.FlowTable(((0.0, 200.0), (0.1, 300.0), (1.0, 400.0))),
    "a user's": Power(60.0, 120.0, 0.4),
    "a user's of the rate": Viscous(100.0, 50.0, 40.0, 5.0),
    "a user's of real numbers only": Real(100.0),
} | examples("flow")


@pytest.mark.parametrize("name", FLOWS)
def test_every_flow_curve_passes_the_suite_that_curves_inherit(name):
    """Stress, derivatives, purity and the return map hold for every curve."""
    check_flow(FLOWS[name])


@pytest.mark.parametrize("name", FLOWS)
def test_a_body_with_any_flow_curve_passes_the_suite_of_materials(name):
    """J2 with every curve: exact tangent in small and finite strain, in the plane, in plane stress and in space."""
    check_material(pr.J2(200e3, 0.3, FLOWS[name]))
    check_material(pr.J2(200e3, 0.3, FLOWS[name], yield_on="kirchhoff"))


def test_every_flow_curve_behind_the_door_is_in_the_list():
    """A curve that is added is tested: each type of the registry has an example here."""
    assert {curve.type for curve in FLOWS.values()} >= set(DOORS["flow"].own())


class Uncompiled(pr.FlowCurve):
    """A curve of prensa's without its kernel."""

    name: str

    def stress(self, strain, rate):
        return FLOWS[self.name].stress(strain, rate)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize("name", [n for n, f in FLOWS.items() if f.kernel() is not None])
def test_the_return_map_of_any_curve_is_the_compiled_one(name, kinematics):
    """With and without the kernel stress, tangent, history and shear strength agree to 1e-11."""
    answers = []
    for flow in (FLOWS[name], Uncompiled(name)):
        law = material_of(pr.J2(200e3, 0.3, flow), kinematics)
        rng = np.random.default_rng(1)
        old = update(law, rng.normal(size=(500, 5)) * 0.02, np.zeros((500, law.size))).new
        answers.append((*update(law, rng.normal(size=(500, 5)) * 0.01, old), law.shear_strength(old)))
    for a, b, tolerance in zip(*answers, (1e-11, 1e-8, 1e-11, 0.0, 1e-11), strict=True):
        assert np.abs(a * 1.0 - b).max() <= tolerance * np.abs(a).max()


def update(law, h, old, dt=0.1):
    from prensa.testing.materials import _answer

    return _answer(law, h, old, dt)


class WrongCurve(pr.FlowCurve):
    """A curve that goes wrong in a given way."""

    way: str
    calls = [0]  # noqa: RUF012 (the memory that a curve must not have)

    def stress(self, strain, rate):
        self.calls[0] += 1
        zero = np.zeros_like(strain)
        match self.way:
            case "negative":
                return 50.0 - 100.0 * strain, zero - 100.0
            case "memory":
                return 100.0 + 1e-6 * self.calls[0] + zero, zero
            case "others":
                return 100.0 * (1 + strain / strain.max()), 100.0 / strain.max() + zero
            case "slope":
                return 100.0 + 50.0 * strain, zero + 60.0
            case "rate":
                return 100.0 + 50.0 * rate, zero
            case "shape":
                return np.full((len(strain), 2), 100.0)
        return np.full_like(strain, np.nan)


class Leap(pr.FlowCurve):
    """A flow stress that jumps from 100 to 150 at a plastic strain of 1e-3, stated in NumPy."""

    def stress(self, strain, rate):
        return np.where(strain < 1e-3, 100.0, 150.0), np.zeros_like(strain)


@pytest.mark.parametrize(("beyond", "on"), [(10.0, 100.0), (20.0, None), (80.0, 150.0)])
def test_a_curve_that_jumps_past_the_stress_fails_there(beyond, on):
    """Where q − 3GΔ lies within the jump no stress is on the curve: the point is flagged, others are as they were."""
    K, G = 20000.0, 1e5 / 3.0 * 0.2
    shear = (100.0 + beyond + 3.0 * G * (1e-3 if on != 100.0 else 0.0)) / (2.0 * np.sqrt(3.0) * G)
    tau, dtau, eps_e, new = np.empty((1, 3)), np.empty((1, 3, 3)), np.empty((1, 3)), np.zeros((1, 2))
    failed = np.zeros(1, dtype=bool)
    eps = np.array([[shear, -shear, 0.0]])
    return_map(eps, np.ones(1), np.zeros((1, 2)), 0, K, G, False, Leap(), 1.0, tau, dtau, eps_e, new, failed, True)
    assert failed[0] == (on is None)
    if on is not None:
        assert np.sqrt(1.5 * (tau**2).sum()) == pytest.approx(on, rel=1e-13)


@pytest.mark.parametrize(
    ("way", "said"),
    [
        ("negative", "must stay positive"), ("memory", "remember"), ("others", "other points"), ("slope", "mend it"),
        ("rate", "three values"), ("shape", "one number a point"), ("nan", "not a finite number"),
    ],
)  # fmt: skip
def test_the_suite_says_what_is_wrong_with_a_flow_curve(way, said):
    """Each kind of wrong curve is found, in words."""
    with pytest.raises(LawError, match=said):
        check_flow(WrongCurve(way))


def test_a_kernel_of_another_curve_is_reported():
    """A compiled curve that is not the one of 'stress' is found."""

    class Borrowed(pr.FlowCurve):
        def stress(self, strain, rate):
            return 100.0 + 50.0 * strain

        def kernel(self):
            return pr.Linear(100.0, 51.0).kernel()

    with pytest.raises(LawError, match="the compiled curve has other stresses"):
        check_flow(Borrowed())


# ------------------------------------------------------------------------------------------------------------ materials
def moduli(m):
    return m.E / (2 * (1 + m.nu)), m.E / (3 * (1 - 2 * m.nu))


class Ogden(pr.IsotropicMaterial):
    """As a user writes it: the energy alone. One term of Ogden (1972), and the bulk in ln J."""

    E: float
    nu: float
    alpha: float

    def energy(self, eps):
        mu, bulk = moduli(self)
        mean = eps.sum(axis=1, keepdims=True) / 3
        return (
            2 * mu / self.alpha**2 * (np.exp(self.alpha * (eps - mean)).sum(axis=1) - 3) + 4.5 * bulk * mean[:, 0] ** 2
        )


class HenckyStress(pr.IsotropicMaterial):
    """The stress alone; the energy is its work."""

    E: float
    nu: float

    def stress(self, eps):
        mu, bulk = moduli(self)
        mean = eps.sum(axis=1, keepdims=True) / 3
        return 3 * bulk * mean + 2 * mu * (eps - mean)


class RealEnergy(pr.IsotropicMaterial):
    """The norm takes real numbers only: differences stand in. Its moduli are properties."""

    mu: float
    bulk: float

    @property
    def modulus(self):
        return 9 * self.bulk * self.mu / (3 * self.bulk + self.mu)

    @property
    def poisson(self):
        return (3 * self.bulk - 2 * self.mu) / (2 * (3 * self.bulk + self.mu))

    def energy(self, eps):
        deviator = np.linalg.norm(eps - eps.mean(axis=1, keepdims=True), axis=1)
        return self.mu * deviator**2 + 0.5 * self.bulk * np.abs(eps.sum(axis=1)) ** 2


MATERIALS = {
    "elastic": pr.Elastic(200e3, 0.3),
    "neo_hooke": pr.NeoHooke(200e3, 0.3),
    "svk": pr.StVenantKirchhoff(200e3, 0.3),
    "j2": pr.J2(200e3, 0.3, pr.Voce(60.0, 120.0, 8.0)),
    "hill": pr.Hill(200e3, 0.3, pr.Voce(60.0, 120.0, 8.0), r=(1.9, 1.2, 2.3), angle=0.35),
    "a user's energy": Ogden(1000.0, 0.4, 3.0),
    "a user's stress": HenckyStress(1000.0, 0.3),
    "a user's energy of real numbers": RealEnergy(400.0, 900.0),
} | examples("material")


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_passes_the_suite_that_materials_inherit(name):
    """Tangent, purity, objectivity, energy, path and dissipation hold for every material in all its modes."""
    check_material(MATERIALS[name])


def test_every_material_behind_the_door_is_in_the_list():
    """A material that is added is tested: each type of the registry has an example here."""
    assert {m.type for m in MATERIALS.values()} >= set(DOORS["material"].own())


@pytest.mark.parametrize("space", ["plane strain", "plane stress", "solid"])
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_hencky_of_ones_own_is_hencky(kinematics, space):
    """The stress stated in Python gives the stresses, tangents, histories and energies of the compiled law, to 1e-12."""
    answers = []
    for m in (pr.Elastic(1000.0, 0.3), HenckyStress(1000.0, 0.3)):
        law = material_of(m, kinematics, space)
        rng = np.random.default_rng(2)
        c = law.layout.components
        old = update(law, rng.normal(size=(50, c)) * 0.05, np.zeros((50, law.size))).new
        answers.append((*update(law, rng.normal(size=(50, c)) * 0.05, old)[:3], law.energy(old)))
    for a, b in zip(*answers, strict=True):
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()


def test_ogdens_sheet_under_tension_is_the_closed_form():
    """Uniaxial tension of an incompressible Ogden body, σ = 2μ/α (λ^α − λ^(−α/2)), to the compressibility left, 1e-4."""
    m = Ogden(1000.0, 0.49999, 3.0)
    law = material_of(m, "finite", "plane stress")
    stretch = 1.5
    h = np.array([[stretch - 1, 0.0, 0.0, stretch**-0.5 - 1, 0.0]])
    sigma = law.cauchy(update(law, h, np.zeros((1, law.size))).new)[0]
    expected = 2 * moduli(m)[0] / 3.0 * (stretch**3 - stretch**-1.5)
    assert sigma[0] == pytest.approx(expected, rel=1e-4)
    assert abs(sigma[1]) <= 1e-4 * expected


class WrongMaterial(pr.IsotropicMaterial):
    """A material that goes wrong in a given way."""

    way: str
    E: float = 1000.0
    nu: float = 0.3
    calls = [0]  # noqa: RUF012 (the memory that a material must not have)

    def energy(self, eps):
        psi = HenckyStress(self.E, self.nu).energy(eps)
        return 1.01 * psi if self.way == "energy" else psi

    def stress(self, eps):
        self.calls[0] += 1
        tau = HenckyStress(self.E, self.nu).stress(eps)
        match self.way:
            case "memory":
                return tau * (1 + 1e-9 * self.calls[0])
            case "others":
                return tau * (1 + 0.01 * np.abs(eps).max())
            case "tangent":
                lam = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
                return tau, np.broadcast_to(lam + 1.01 * self.E / (1 + self.nu) * np.eye(3), (len(eps), 3, 3))
            case "order":
                return tau * [1.0, 1.0, 1.1]
            case "rest":
                return tau + 1.0
            case "moduli":
                return 3.0 * tau
            case "cauchy":
                return tau * np.exp(-eps.sum(axis=1, keepdims=True))
            case "nan":
                return tau * np.nan
        return tau


@pytest.mark.parametrize(
    ("way", "said"),
    [
        ("memory", "remember"), ("others", "other points"), ("tangent", "tangent differs"), ("order", "not isotropic"),
        ("rest", "undeformed"), ("moduli", "stiffness at rest"), ("cauchy", "symmetric"), ("energy", "derivative of its energy"),
        ("nan", "not a finite number"),
    ],
)  # fmt: skip
def test_the_suite_says_what_is_wrong_with_a_material(way, said):
    """Each kind of wrong material is found, in words."""
    with pytest.raises(LawError, match=said):
        check_material(WrongMaterial(way))


@dataclasses.dataclass(frozen=True)
class Skewed(Hencky):
    """A law that knows the axes."""

    def update(self, h, old, at, out):
        super().update(h, old, at, out)
        out.P[:, 0] += 10.0 * h[:, 0]
        out.A[:, 0, 0] += 10.0


@dataclasses.dataclass(frozen=True)
class Generous(J2):
    """A law whose flow gives work back."""

    def update(self, h, old, at, out):
        super().update(h, old, at, out)
        work = self.fields["plastic_work"].columns
        out.new[:, work] = 2.0 * old[:, work] - out.new[:, work]


@dataclasses.dataclass(frozen=True)
class Halved(Hencky):
    """A law that keeps half of what it went through."""

    def update(self, h, old, at, out):
        super().update(h, old, at, out)
        out.new[:] *= 0.5


@pytest.mark.parametrize(
    ("law", "said"),
    [(Skewed, "not objective"), (Generous, "gives work back"), (Halved, "another stress than the whole")],
)
def test_the_suite_says_what_is_wrong_with_a_law_of_ones_own(law, said):
    """A description may make a law of its own; one that is not objective, gives work back or depends on the path is reported."""

    class Own(pr.Material):
        E: float = 1000.0
        nu: float = 0.3

        @property
        def type(self):
            return "own"

        def bulk_law(self, finite, **tensors):
            if issubclass(law, J2):
                return law(self.E, self.nu, finite, pr.Linear(5.0, 10.0).kernel(), **tensors)
            return law(self.E, self.nu, finite, **tensors)

    with pytest.raises(LawError, match=said):
        check_material(Own())


# ---------------------------------------------------------------------------------------------------------- in a case
CASE = """\
name: own laws
kinematics: {kinematics}
space: {space}
bodies:
  a:
    mesh: {{type: rectangle, size: [2, 1], n: [2, 1]}}
    material: {material}
tools: {{punch: {{type: plane, touching: a.top}}}}
contacts: [{{surface: a.top, against: punch, friction: {{type: shear, m: 0.2{k}}}}}]
fixed: {{a.bottom: y, a.left: x}}
steps: [{{name: press, move: {{punch: {{y: -0.05}}}}, increments: 2}}]
"""
MODULE = """
import numpy as np
import prensa as pr

class Curve(pr.FlowCurve):
    s0: float
    K: float
    n: float

    def stress(self, strain, rate):
        return self.s0 + self.K * (0.001 + strain) ** self.n

class Rubber(pr.IsotropicMaterial):
    E: float
    nu: float

    def energy(self, eps):
        mu, lam = self.E / (2 * (1 + self.nu)), self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        return mu * (eps**2).sum(axis=1) + 0.5 * lam * eps.sum(axis=1) ** 2
"""


@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize("space", ["plane strain", "plane stress", "axisymmetric"])
def test_users_flow_curve_and_material_stand_in_a_case_file(tmp_path, space, kinematics):
    """``my_laws:Curve`` of a file beside the case is solved in every mode, survives `dump`, and gives friction its strength."""
    (tmp_path / "my_laws.py").write_text(MODULE)
    for material, k in (
        ("{type: j2, E: 1000, nu: 0.3, flow: {type: 'my_laws:Curve', s0: 2, K: 5, n: 0.3}}", ""),
        ("{type: 'my_laws:Rubber', E: 1000, nu: 0.3}", ", k: 5"),
    ):
        text = CASE.format(material=material, space=space, kinematics=kinematics, k=k)
        case = loads(text, "case.yaml", tmp_path)
        assert loads(dump(case.problem)).problem == case.problem
        last = list(pr.solve(case.problem))[-1]
        assert last.time == pytest.approx(1.0)
        assert (last.bodies["a"].plastic_strain.max() > 0.01) == (k == "")


def test_what_a_users_material_lacks_is_reported_in_the_case(tmp_path):
    """An elastic material of one's own has no shear yield stress; a class that is not a flow curve is none."""
    (tmp_path / "my_laws.py").write_text(MODULE)
    options = {"space": "plane strain", "kinematics": "small", "k": ""}
    with pytest.raises(pr.CaseError, match="no shear yield stress"):
        loads(CASE.format(material="{type: 'my_laws:Rubber', E: 1, nu: 0.3}", **options), "case.yaml", tmp_path)
    with pytest.raises(pr.CaseError, match=r"must derive from prensa\.FlowCurve"):
        loads(
            CASE.format(material="{type: j2, E: 1, nu: 0.3, flow: {type: 'my_laws:Rubber', E: 1, nu: 0}}", **options),
            "case.yaml", tmp_path,
        )  # fmt: skip


def test_the_vocabulary_needs_no_compiler():
    """Descriptions of materials and flow curves import NumPy and pydantic at most."""
    code = "import sys, prensa.model.schema; print([m for m in ('numba', 'scipy') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_a_field_does_not_hide_what_a_law_is_asked_for():
    """A field named as a method of the base is refused where the class is written."""
    with pytest.raises(TypeError, match="'modulus' cannot be a field"):

        class Hiding(pr.IsotropicMaterial):
            modulus: float


def test_history_is_known_by_name():
    """The fields of a law cover its history without overlap, in every layout."""
    for material in MATERIALS.values():
        for space in ("plane strain", "plane stress", "solid"):
            law = material_of(material, "finite", space)
            places = [k for part in law.fields.values() for k in range(*part.columns.indices(law.size))]
            assert places == list(range(law.size))
            assert law.plastic == ("plastic_strain" in law.fields)


def test_a_type_longer_than_any_file_name_is_refused_in_words():
    """Looking for its module must not end in an error of the operating system."""
    from prensa.errors import CaseError
    from prensa.model.schema import loads

    case = (
        "name: x\nbodies: {b: {mesh: {type: rectangle, size: [1, 1], n: [2, 2]}, material: {type: elastic, E: 1, nu: 0.3}}}\n"
        "tools: {p: {type: plane, touching: b.top}}\nsteps: [{name: s, move: {p: {y: -0.1}}}]\n"
    )
    with pytest.raises(CaseError, match="cannot import"):
        loads(case + f'friction: {{type: "{"a: " * 300}x:Law"}}\n')
