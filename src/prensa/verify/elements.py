"""Elements and plane stress: patch tests, bending, incompressibility and homogeneous large strain against closed forms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.reference import tables
from prensa.types import Array
from prensa.verify import example1, example2, friction
from prensa.verify.balance import Balance
from prensa.verify.drive import Drive
from prensa.verify.example2 import extrapolated
from prensa.verify.forming import FLOWS, NU, REDUCTIONS, TIME_RULES, E, at, curve, johnson_cook_force, upsetting
from prensa.verify.table import Row, case, row


@case("frictionless upsetting in plane stress, every flow law", suite="elements")
def plane_stress_upsetting(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The uniaxial solution, elasticity included, to 1e-6 in force, width and thickness, with exact enforcement."""
    balance = Balance()
    for name, flow in FLOWS.items():
        p = upsetting(
            (2, 2), 0.0, flow, space="plane stress", enforcement=pr.Exact(), increments=25, E_scale=E_scale,
            reductions=REDUCTIONS if name == "ludwik" else (0.5,),
        )  # fmt: skip
        history = list(balance.watch(p))
        marks = REDUCTIONS if name == "ludwik" else (0.5,)
        for r, inc in zip(marks, at(marks, history), strict=True):
            exact = ref.upset_plane_stress(r, width=10.0, flow=curve(flow), E=E, nu=NU)
            sheet = inc.bodies["billet"]
            assert sheet.thickness is not None
            yield row(f"{name}: force at {r:.0%}", float(exact.force), inc.force("punch").y, 1e-6)
            yield row(f"{name}: width at {r:.0%}", float(exact.size), float(sheet.x[:, 0].max()), 1e-6)
            thin, thick = float(sheet.thickness.min()), float(sheet.thickness.max())
            yield row(f"{name}: least thickness at {r:.0%}", float(exact.lateral_stretch), thin, 1e-6)
            yield row(f"{name}: largest thickness at {r:.0%}", float(exact.lateral_stretch), thick, 1e-6)
    yield from balance.rows()


@case("rate-dependent upsetting in plane stress", suite="elements")
def plane_stress_rate(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Johnson-Cook under uniaxial stress: each time rule has its order, and the limit is the solution of the rate equation."""
    balance = Balance()
    flow = pr.JohnsonCook(250.0, 500.0, 0.3, 0.05, 1e-3)
    # the cylinder of radius 10 and the strip of width 10 and thickness 1 have the same stress: areas 100π and 10
    exact = johnson_cook_force(flow, 0.3) / (100.0 * 3.141592653589793) * 10.0
    for order, rule in enumerate(TIME_RULES, 1):
        forces = []
        for increments in (25, 50, 100):
            p = upsetting(
                (1, 1), 0.0, flow, space="plane stress", enforcement=pr.Augmented(), increments=increments,
                E_scale=E_scale, reductions=(0.3,),
            )  # fmt: skip
            forces.append(balance.last(p, pr.Numerics(time_rule=rule)).force("punch").y)
        falls = 2.0**order  # the error, when the number of increments is doubled
        yield row(f"{rule}: force at 30 % in 100 increments", exact, forces[2], 1e-3)
        extrapolated = forces[2] + (forces[2] - forces[1]) / (falls - 1.0)
        yield row(f"{rule}: force extrapolated to zero step", exact, extrapolated, 1e-4)
        yield row(f"{rule}: ratio of differences", falls, (forces[1] - forces[0]) / (forces[2] - forces[1]), 0.1)
    yield from balance.rows()


# --------------------------------------------------------------------------------------------------------- patch tests
ELEMENTS = ("q4_fbar", "q4_bbar", "q4_enhanced", "q4_sheet", "q4", "t3", "t6", "q8", "q8_full")
SPACES = ("plane strain", "plane stress", "axisymmetric")


def elements_in(space: str) -> tuple[str, ...]:
    """The elements that a space has."""
    return ELEMENTS[2:] if space == "plane stress" else ELEMENTS


def quadrilaterals(
    n: tuple[int, int], size: tuple[float, float], bent: float = 0.0, skew: float = 0.0, x0: float = 0.0
) -> pr.Points:
    """Rectangle from (x0, 0) whose inner nodes are displaced by ``bent`` of an element, then sheared by ``skew``."""
    x, y = np.meshgrid(np.arange(n[0] + 1.0), np.arange(n[1] + 1.0))
    inside = (x > 0) & (x < n[0]) & (y > 0) & (y < n[1])
    rng = np.random.default_rng(1)
    X = np.stack([x, y], axis=-1) + bent * inside[..., None] * rng.uniform(-1, 1, (*x.shape, 2))
    X *= np.array(size) / np.array(n)
    X[..., 0] += x0 + skew * X[..., 1]
    node = np.arange(x.size).reshape(x.shape)
    cells = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1).reshape(-1, 4)
    boundaries = {"bottom": node[0], "right": node[:, -1], "top": node[-1], "left": node[:, 0]}
    return pr.Points(
        points=tuple((float(a), float(b)) for a, b in X.reshape(-1, 2)),
        cells=tuple(tuple(c) for c in cells.tolist()),
        boundaries={k: tuple(v.tolist()) for k, v in boundaries.items()},
    )


@case("patch test, constant stress", suite="elements")
def patch_constant(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A linear displacement of the outline of distorted elements is continued exactly inside, with a uniform stress."""
    worst = 0.0
    for space in SPACES:
        axi = space == "axisymmetric"
        gradient = np.diag([0.08, -0.05]) if axi else np.array([[0.08, 0.03], [-0.02, -0.05]])
        for kinematics in ("small", "finite"):
            for element in elements_in(space):
                mesh = quadrilaterals((4, 3), (4.0, 3.0), bent=0.25, x0=0.0 if axi else 1.0)
                drive = Drive(pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.3), element), space, kinematics)
                exact = drive.X @ gradient.T
                outline = drive.outline()
                drive.to(1.0, outline, exact.ravel()[outline])
                error = float(np.abs(drive.state.u - exact.ravel()).max() / np.abs(exact).max())
                stress = drive.cauchy()
                spread = float(np.abs(stress - stress.mean(axis=0)).max() / np.abs(stress).max())
                worst = max(worst, drive.imbalance())
                name = f"{element}, {space}, {kinematics}"
                yield row(f"{name}: largest error of u, of spread of σ", 0.0, max(error, spread), 1e-10, "absolute")
    yield row("forces out of balance / sum of forces", 0.0, worst, 1e-10, "absolute")


def effective(space: str, E: float, nu: float) -> tuple[float, float]:
    """E and ν with which plane stress formulae hold in that space."""
    return (E, nu) if space == "plane stress" else (E / (1 - nu**2), nu / (1 - nu))


@case("patch test, linear stress", suite="elements")
def patch_linear(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Pure bending, u = κxy, v = −κ(x² + ν y²)/2, is continued exactly by quadratic elements (Q8: parallelograms)."""
    worst = 0.0
    for space in SPACES[:2]:
        modulus, nu = effective(space, 1000.0 * E_scale, 0.3)
        for element, bent, skew in (
            ("t6", 0.25, 0.3),
            ("q8", 0.0, 0.3),
            ("q8_full", 0.0, 0.3),
            ("q4_enhanced", 0.0, 0.0),
            ("q4_sheet", 0.0, 0.0),
        ):
            mesh = quadrilaterals((4, 2), (10.0, 1.0), bent, skew)
            drive = Drive(pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.3), element), space, "small")
            x, y = (drive.X - [0.0, 0.5]).T
            exact = 1e-3 * np.stack([x * y, -0.5 * (x**2 + nu * y**2)], axis=1)
            outline = drive.outline()
            drive.to(1.0, outline, exact.ravel()[outline])
            error = float(np.abs(drive.state.u - exact.ravel()).max() / np.abs(exact).max())
            (block,) = drive.system.blocks
            height = block.positions(drive.X).reshape(-1, 2)[:, 1] - 0.5
            fibre = float(np.abs(drive.cauchy()[:, 0] - 1e-3 * modulus * height).max() / (0.5e-3 * modulus))
            worst = max(worst, drive.imbalance())
            yield row(f"{element}, {space}: largest error of u, of σ_xx", 0.0, max(error, fibre), 1e-10, "absolute")
    yield row("forces out of balance / sum of forces", 0.0, worst, 1e-10, "absolute")


# -------------------------------------------------------------------------------------------------------- convergence
def cantilever(X: Array, space: str) -> Array:
    """Displacements (n, 2) of a cantilever 8 × 2 under end shear, E = 1000, ν = 0.3 (Timoshenko & Goodier 1970, art. 21)."""
    modulus, nu = effective(space, 1000.0, 0.3)
    L, D, P = 8.0, 2.0, 1.0
    x, y = X[:, 0], X[:, 1] - 0.5 * D
    c = P / (6 * modulus * D**3 / 12)
    u = -c * y * ((6 * L - 3 * x) * x + (2 + nu) * (y**2 - D**2 / 4))
    v = c * (3 * nu * y**2 * (L - x) + (4 + 5 * nu) * D**2 * x / 4 + (3 * L - x) * x**2)
    return np.stack([u, v], axis=1)


@case("cantilever, rates", suite="elements")
def cantilever_rates(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """With the exact displacement on the outline the inside converges in u at order 2 (linear) and 3 (quadratic)."""
    worst = 0.0
    for space in SPACES[:2]:
        for element in elements_in(space):
            errors = []
            for n in ((8, 2), (16, 4), (32, 8)):
                mesh = quadrilaterals(n, (8.0, 2.0))
                drive = Drive(pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.3), element), space, "small")
                exact, outline = cantilever(drive.X, space), drive.outline()
                drive.to(1.0, outline, exact.ravel()[outline])
                (block,) = drive.system.blocks
                shape = block.element.N
                at_points = cantilever(block.positions(drive.X).reshape(-1, 2), space)
                u = np.einsum("qa,mad->mqd", shape, drive.state.u.reshape(-1, 2)[block.cells]).reshape(-1, 2)
                w = block.volume.reshape(-1, 1)
                errors.append(float(np.sqrt((w * (u - at_points) ** 2).sum() / (w * at_points**2).sum())))
                worst = max(worst, drive.imbalance())
            least = 2.8 if element[1] in "68" and element != "q4" else 1.85
            yield row(
                f"{element}, {space}: observed order of u",
                least,
                float(np.log2(errors[1] / errors[2])),
                0.0,
                "at least",
            )
            yield row(f"{element}, {space}: error of u on 32 × 8", 0.0, errors[2], 0.0, "report")
    yield row("forces out of balance / sum of forces", 0.0, worst, 1e-10, "absolute")


def bore(element: str, n: int, nu: float, E_scale: float) -> pr.Problem:
    """Tube of radii 10 and 20 in plane strain with a bore pressure of 1, E = 1000, n square elements through the wall."""
    body = pr.Body(pr.Rectangle(size=(10, 10 / n), n=(n, 1), origin=(10, 0)), pr.Elastic(1000.0 * E_scale, nu), element)
    return pr.Problem(
        "tube", space="axisymmetric", kinematics="small", bodies={"tube": body},
        fixed={"tube.bottom": "y", "tube.top": "y"},
        steps=(pr.Step("press", loads={"tube.left": pr.Load(pressure=1.0)}, increments=1),),
    )  # fmt: skip


def lame(r: Array, nu: float) -> Array:
    """Radial displacement (n,) of the tube at radii r (n,)."""
    return (1 + nu) / 1000.0 * 100.0 / 300.0 * ((1 - 2 * nu) * r + 400.0 / r)


@case("pressurised thick tube, rates", suite="elements")
def tube_rates(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Lamé's bore displacement at order 2 (linear) and 3 or more (quadratic); nearly incompressible without locking."""
    balance = Balance()
    for nu in (0.3, 0.4999):
        for element in ELEMENTS:
            errors = []
            for n in (8, 16, 32):
                tube = balance.last(bore(element, n, nu, E_scale)).bodies["tube"]
                errors.append(float(np.abs(tube.displacement[:, 0] / lame(tube.X[:, 0], nu) - 1).max()))
            rate = float(np.log2(errors[1] / errors[2]))
            name = f"{element}, ν = {nu:g}"
            if nu > 0.4 and element in ("q4", "t3", "t6", "q8_full"):  # they lock, or are on the way to it
                yield row(f"{name}: observed order", 1.9, rate, 0.0, "report")
                yield row(f"{name}: largest error of u on 32 elements", 0.0, errors[2], 0.0, "report")
                continue
            yield row(f"{name}: largest error of u on 32 elements", 0.0, errors[2], 0.002, "absolute")
            if element == "q8":  # exact at the nodes, by superconvergence
                yield row(f"{name}: largest error of u on 8 elements", 0.0, errors[0], 1e-8, "absolute")
            else:
                yield row(
                    f"{name}: observed order", 2.8 if element in ("t6", "q8_full") else 1.8, rate, 0.0, "at least"
                )
    yield from balance.rows()


def isochoric(X: Array, axisymmetric: bool) -> Array:
    """Displacements (n, 2) at X (n, 2) that are gradients of a harmonic potential: equilibrium without volume change.

    Plane: φ = eˣ cos y; axisymmetric: φ = z⁴ − 3 z² r² + 3/8 r⁴. ∇·∇φ = 0 and ∇²∇φ = 0, so Navier's equations hold for every
    ν, with zero mean stress.
    """
    x, y = X.T
    if axisymmetric:
        return np.stack([-6 * y**2 * x + 1.5 * x**3, 4 * y**3 - 6 * y * x**2], axis=1)
    return np.stack([np.exp(x) * np.cos(y), -np.exp(x) * np.sin(y)], axis=1)


@case("nearly incompressible block, rates", suite="elements")
def block_rates(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """A block of ν = 0.4999 whose outline follows an isochoric field deforms like it inside, at order 2 or 3, unlocked."""
    worst = 0.0
    for space in ("plane strain", "axisymmetric"):
        axi = space == "axisymmetric"
        for element in elements_in(space):
            errors = []
            for n in (4, 8, 16):
                mesh = quadrilaterals((n, n), (1.0, 1.0), skew=0.2, x0=1.0)
                drive = Drive(pr.Body(mesh, pr.Elastic(1000.0 * E_scale, 0.4999), element), space, "small")
                exact, outline = 1e-3 * isochoric(drive.X, axi), drive.outline()
                drive.to(1.0, outline, exact.ravel()[outline])
                off = drive.state.u.reshape(-1, 2) - exact
                errors.append(float(np.sqrt((off**2).sum(axis=1).mean() / (exact**2).sum(axis=1).mean())))
                worst = max(worst, drive.imbalance())
            rate = float(np.log2(errors[1] / errors[2]))
            name = f"{element}, {space}"
            if element in ("q4", "t3", "t6", "q8_full"):  # they lock, or are on the way to it
                yield row(f"{name}: observed order", 1.9, rate, 0.0, "report")
                yield row(f"{name}: error of u on 16 × 16", 0.0, errors[2], 0.0, "report")
                continue
            yield row(f"{name}: error of u on 16 × 16", 0.0, errors[2], 1e-4, "absolute")
            yield row(f"{name}: observed order", 2.8 if element == "q8" else 1.8, rate, 0.0, "at least")
    yield row("forces out of balance / sum of forces", 0.0, worst, 1e-10, "absolute")


def cook(element: str, n: int, E_scale: float) -> pr.Problem:
    """Cook's membrane: corners (0, 0), (48, 44), (48, 60), (0, 44), clamped left, shear 1 in total right; E = 1, ν = 1/3."""
    corners = ((0.0, 0.0), (48.0, 44.0), (48.0, 60.0), (0.0, 44.0))
    body = pr.Body(pr.Patch(corners=corners, n=(n, n)), pr.Elastic(E_scale, 1 / 3), element)
    return pr.Problem(
        "Cook", space="plane stress", kinematics="small", allow_large_strain=True, bodies={"membrane": body},
        fixed={"membrane.left": "xy"},
        steps=(pr.Step("load", loads={"membrane.right": pr.Load(traction=(0.0, 1 / 16))}, increments=1),),
    )  # fmt: skip


@case("Cook's membrane", suite="elements")
def cooks_membrane(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The middle of the loaded side moves by 23.96 (Cook et al. 1989) on every element, by Richardson's extrapolation."""
    balance = Balance()
    for element in elements_in("plane stress"):
        values = []
        for n in (8, 16, 32):
            membrane = balance.last(cook(element, n, E_scale)).bodies["membrane"]
            k = int(np.argmin(np.hypot(*(membrane.X - [48.0, 52.0]).T)))
            values.append(float(membrane.displacement[k, 1]))
        limit, rate = extrapolated(values)
        yield row(f"{element}: deflection extrapolated", 23.96, limit, 0.002)
        yield row(f"{element}: deflection on 32 × 32", 23.96, values[2], 0.0, "report")
        yield row(f"{element}: observed order (a corner singularity rules it)", 1.0, rate, 0.0, "report")
    yield from balance.rows()


# ------------------------------------------------------------------------------------------------------------- bending
def bent_strip(
    element: str, space: str, material: pr.Elastic | pr.J2, layers: int, aspect: float, curvatures: Array
) -> tuple[float, float]:
    """Last moment and imbalance of a strip of thickness 1, one row of elements long, its right end turned through curvatures."""
    length = aspect / layers
    drive = Drive(pr.Body(quadrilaterals((1, layers), (length, 1.0)), material, element), space, "small")
    left, right = (np.flatnonzero(np.abs(drive.X[:, 0] - x) < 1e-9) for x in (0.0, length))
    foot = left[np.argmin(np.abs(drive.X[left, 1] - 0.5))]
    dofs = np.concatenate([2 * left, 2 * right, [2 * foot + 1]])
    for k, curvature in enumerate(curvatures):
        turned = -curvature * length * (drive.X[right, 1] - 0.5)
        drive.to(1e-3 * (k + 1), dofs, np.concatenate([np.zeros(len(left)), turned, [0.0]]))
    return -float(drive.reaction[right, 0] @ (drive.X[right, 1] - 0.5)), drive.imbalance()


def bent_and_released(body: pr.Body, curvature: float) -> tuple[float, float, float]:
    """Moment of a strip of thickness 1, the curvature that goes back when the moment goes, and the moment left over.

    The release is elastic: a few steps by the moment that is left over, which Newton would take, end at round-off.
    """
    drive = Drive(body, "plane strain", "small")
    length = float(drive.X[:, 0].max())
    left, right = (np.flatnonzero(np.abs(drive.X[:, 0] - x) < 1e-9) for x in (0.0, length))
    foot = left[np.argmin(np.abs(drive.X[left, 1] - 0.5))]
    dofs = np.concatenate([2 * left, 2 * right, [2 * foot + 1]])
    height = drive.X[right, 1] - 0.5

    def turn(to: float) -> float:
        values = np.concatenate([np.zeros(len(left)), -to * length * height, [0.0]])
        drive.to(drive.state.clock.time + 1e-3, dofs, values)
        return -float(drive.reaction[right, 0] @ height)

    for part in np.linspace(0.0, curvature, 9)[1:]:
        moment = turn(float(part))
    now, left_over = curvature, moment
    for _ in range(5):
        now -= 12.0 * (1.0 - NU**2) / E * left_over
        left_over = turn(now)
    return moment, curvature - now, abs(left_over) / moment


@case("moment and curvature of a strip", suite="elements")
def strip(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Two layers of elements five times as long as thick: exact moment, elastic and plastic; F-bar's and the plain one beside."""
    flow = pr.Ludwik(250.0, 500.0, 0.3)
    worst = 0.0
    for space in SPACES[:2]:
        steps = np.geomspace(2e-3, 0.1, 20)
        plastic = ref.bend_strip(steps[-1:], thickness=1.0, flow=curve(flow), E=E, nu=NU, space=space).moment[0]
        elastic = effective(space, E, NU)[0] / 12 * steps[0]
        for element in elements_in(space):
            good = element in ("q4_enhanced", "q4_sheet", "q8", "t6", "q8_full")
            ours, gap = bent_strip(element, space, pr.Elastic(E * E_scale, NU), 2, 5.0, steps[:1])
            worst = max(worst, gap)
            yield row(f"{element}, {space}, elastic", elastic, ours, 0.002, "relative" if good else "report")
            ours, gap = bent_strip(element, space, pr.J2(E * E_scale, NU, flow), 2, 5.0, steps)
            worst = max(worst, gap)
            yield row(f"{element}, {space}, outer strain 5 %", plastic, ours, 0.002, "relative" if good else "report")
    yield row("forces out of balance / sum of forces", 0.0, worst, 1e-8, "absolute")


@case("springback of a strip in two layers", suite="elements")
def strip_released(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Moment of a strip with an elastic core, and the curvature that it goes back by, from outer strains of 0.2 % on."""
    worst = 0.0
    for flow in (pr.Ludwik(250.0, 500.0, 0.3), pr.Linear(250.0, 100.0)):
        for outer in (0.002, 0.0025, 0.005, 0.01, 0.05):
            exact = ref.bend_strip(np.array([2.0 * outer]), thickness=1.0, flow=curve(flow), E=E, nu=NU)
            body = pr.Body(quadrilaterals((1, 2), (2.5, 1.0)), pr.J2(E * E_scale, NU, flow), "q4_sheet")
            moment, back, gap = bent_and_released(body, 2.0 * outer)
            worst = max(worst, gap)
            name = f"{flow.type}, outer strain {outer:.2%}"
            yield row(f"{name}: moment", float(exact.moment[0]), moment, 0.005)
            yield row(f"{name}: springback", 2.0 * outer - float(exact.released_curvature[0]), back, 0.005)
    yield row("forces out of balance / moment", 0.0, worst, 1e-8, "absolute")


# ------------------------------------------------------------------------------------------------------------- contact
def on(problem: pr.Problem, element: str) -> pr.Problem:
    """The problem with its body in another element."""
    return replace(problem, bodies={k: replace(b, element=element) for k, b in problem.bodies.items()})


CONTACT_ELEMENTS = ("t6", "q8", "q4_enhanced")


@case("example 1 on other elements", suite="elements", expected_warnings=("have a scaled Jacobian below 0.2",))
def other_example1(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The linear Signorini problem on T6, Q8 and enhanced Q4: the block's force, half-width and pressure."""
    balance = Balance()
    for element in CONTACT_ELEMENTS:
        n = (60, 60) if element == "q4_enhanced" else (40, 40)
        p = example1.problem(n, "small", "reference", pr.Elastic(E=example1.E * E_scale, nu=NU), (example1.press(1.0),))
        inc = balance.last(on(p, element))
        P = tables.EXAMPLE1_FORCE_REFERENCE_GEOMETRY[tables.EXAMPLE1_DELTA.index(1.0)]
        yield row(f"{element}: P at δ = 1", P, example1.force(inc), 0.002)
        layer = ref.layer_line(R=example1.R, H=example1.H, E=example1.E, nu=NU, delta=1.0)
        a, h = example1.half_width(inc)
        yield row(f"{element}: half-width a, within an element", layer.a, a, h, "absolute")
        for name, rms in example1.pressure_errors(inc.contacts["block.top-cylinder"], layer):
            yield row(f"{element}: RMS error of p from {name} / p0", 0.0, rms, 0.01, "absolute")
    yield from balance.rows()


@case("example 2 on other elements", suite="elements", expected_warnings=("have a scaled Jacobian below 0.2",))
def other_example2(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The ring on the disc, axisymmetric, on T6, Q8 and enhanced Q4: the published stiffness by extrapolation."""
    balance = Balance()
    low, high = tables.EXAMPLE2_DISC_STIFFNESS
    for element in CONTACT_ELEMENTS:
        sizes = (40, 80, 160) if element == "q4_enhanced" else (20, 40, 80)
        values = [
            example2.stiffness(balance.last(on(example2.problem((n, n // 2), 20, 10, 10, E_scale), element)))
            for n in sizes
        ]
        limit, rate = extrapolated(values)
        yield row(f"{element}: P/δ on {sizes[-1]} × {sizes[-1] // 2}", 51_800, values[-1], 0.004)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        yield row(f"{element}: P/δ extrapolated, inside the published range", middle, limit, half, "absolute")
        yield row(f"{element}: observed order in h", 0.9, rate, 0.0, "at least")
    yield from balance.rows()


@case("plate with friction on other elements", suite="elements")
def other_plate(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Lift-off, slip and stick of SSNV128 on T6, Q8 and enhanced Q4: the mesh-converged displacements."""
    balance = Balance()
    for element in CONTACT_ELEMENTS:
        n = 64 if element == "q4_enhanced" else 32
        inc = balance.last(on(friction.plate(n, E_scale, mu_scale), element))
        yield from friction.plate_rows(inc, f"{element}: ")
    yield from balance.rows()


@case("upsetting with friction on other elements", suite="elements", slow=True)
def other_upsetting(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Large plastic flow with μ = 0.1 to 30 % on Q8 and T6: the force of an independent solver."""
    balance = Balance()
    reductions = (0.1, 0.2, 0.3)
    for element, n in (("q8", (8, 6)), ("t6", (8, 6)), ("q4_enhanced", (12, 9))):
        p = upsetting(n, 0.1 * mu_scale, E_scale=E_scale, reductions=reductions)
        history = list(balance.watch(on(p, element)))
        for r, inc in zip(reductions, at(reductions, history), strict=True):
            force = tables.UPSETTING_FORCE_MU_01["cauchy"][r]
            yield row(f"{element}: F (kN) at {r:.0%}", force, 1e-3 * inc.force("punch").y, 0.004)
    yield from balance.rows()
