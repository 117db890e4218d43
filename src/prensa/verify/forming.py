"""Large-strain plasticity: upsetting, rings, tubes, the flat punch and the necking bar against closed forms and tables.

References: homogeneous upsetting is exact (elasticity included); upsetting with friction and ring compression come from
an independent solver (published figures repeated in `prensa.reference.tables`); the rest are textbook closed forms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

import prensa as pr
from prensa import reference as ref
from prensa.materials.flow_curve import FlowCurve
from prensa.materials.hardening import flow_curve
from prensa.reference import tables
from prensa.result.increment import Increment
from prensa.verify.balance import Balance
from prensa.verify.table import Row, case, row

E, NU = 200e3, 0.3
BILLET_FLOW = pr.Ludwik(250.0, 500.0, 0.3)
REDUCTIONS = (0.1, 0.2, 0.3, 0.4, 0.5)
TIME_RULES: tuple[Literal["backward_euler", "bdf2"], ...] = ("backward_euler", "bdf2")  # of orders 1 and 2
FLOWS: dict[str, FlowCurve] = {
    "perfect": pr.Perfect(250.0),
    "linear": pr.Linear(250.0, 500.0),
    "ludwik": BILLET_FLOW,
    "swift": pr.Swift(565.3, 0.007117, 0.2589),
    "voce": pr.Voce(160.0, 120.0, 8.0),
    "hockett_sherby": pr.HockettSherby(200.0, 500.0, 2.0, 0.7),
    "table": pr.FlowTable(((0.0, 250.0), (0.1, 400.0), (0.3, 500.0), (1.0, 600.0))),
}


def curve(flow: FlowCurve) -> Callable[[float], float]:
    """Flow stress at a plastic strain, for the closed forms."""
    return lambda strain: float(flow_curve(flow, np.array([strain]))[0])


def stroke(tool: str, height: float, reductions: tuple[float, ...] = REDUCTIONS) -> dict[str, pr.Motion]:
    """Motion of a punch to the last reduction; increments end exactly at each of them."""
    last = reductions[-1]
    table = tuple((r / last, -r * height) for r in (0.0, *reductions))
    return {tool: pr.Motion(y=table)}


def at(reductions: tuple[float, ...], increments: list[Increment]) -> list[Increment]:
    """The increments that end at the reductions of `stroke`."""
    times = np.array([i.time for i in increments])
    return [increments[int(np.argmin(np.abs(times - r / reductions[-1])))] for r in reductions]


def upsetting(
    n: tuple[int, int], mu: float, flow: FlowCurve = BILLET_FLOW, *, space: str = "axisymmetric", graded: bool = False,
    enforcement: pr.Penalty | pr.Augmented | pr.Exact | None = None, increments: int | None = None, yield_on: str = "cauchy",
    E_scale: float = 1.0, reductions: tuple[float, ...] = REDUCTIONS,
) -> pr.Problem:  # fmt: skip
    """Quarter of a cylinder (or strip) R = 10, half height 7.5 between flat dies; its free side may fold onto the die."""
    grade = pr.Grade(x=(10.0,), y=(7.5,), ratio=5) if graded else None
    body = pr.Body(pr.Rectangle(size=(10, 7.5), n=n, grade=grade), pr.J2(E * E_scale, NU, flow, yield_on))
    return pr.Problem(
        "upsetting", space=space, bodies={"billet": body}, tools={"punch": pr.Plane(touching="billet.top")},
        contacts=(pr.Contact(
            ("billet.top", "billet.right"), "punch", friction=pr.Coulomb(mu) if mu else None,
            enforcement=enforcement or pr.Penalty(),
        ),),
        fixed={"billet.bottom": "y", "billet.left": "x"},
        steps=(pr.Step("press", move=stroke("punch", 7.5, reductions), increments=increments, duration=1.0),),
    )  # fmt: skip


@case("frictionless upsetting, every flow law", suite="forming")
def frictionless(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The homogeneous solution, elasticity included, to 1e-4 in force and radius with augmented contact."""
    balance = Balance()
    for name, flow in FLOWS.items():
        for yield_on in ("cauchy", "kirchhoff") if name == "ludwik" else ("cauchy",):
            p = upsetting(
                (3, 2), 0.0, flow, enforcement=pr.Augmented(), increments=50, yield_on=yield_on, E_scale=E_scale
            )
            history = list(balance.watch(p))
            for r, inc in list(zip(REDUCTIONS, at(REDUCTIONS, history), strict=True))[-1 if name != "ludwik" else 0 :]:
                exact = ref.upset_cylinder(r, R=10.0, flow=curve(flow), E=E, nu=NU, yield_on=yield_on)
                yield row(f"{name}, {yield_on}: force at {r:.0%}", float(exact.force), inc.force("punch").y, 1e-4)
                radius = float(inc.bodies["billet"].x[:, 0].max())
                yield row(f"{name}, {yield_on}: radius at {r:.0%}", float(exact.size), radius, 1e-4)
    yield from balance.rows()


@case("frictionless upsetting in plane strain", suite="forming")
def plane_strain(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The elastic-plastic ODE of homogeneous plane-strain compression, to 1e-4."""
    balance = Balance()
    p = upsetting((3, 2), 0.0, space="plane strain", enforcement=pr.Augmented(), increments=400, E_scale=E_scale)
    history = list(balance.watch(p))
    for r, inc in zip(REDUCTIONS, at(REDUCTIONS, history), strict=True):
        exact = ref.upset_plane_strain(r, width=10.0, flow=curve(BILLET_FLOW), E=E, nu=NU)
        yield row(f"force at {r:.0%}", float(exact.force), inc.force("punch").y, 1e-4)
        yield row(f"width at {r:.0%}", float(exact.size), float(inc.bodies["billet"].x[:, 0].max()), 1e-4)
    yield from balance.rows()


def johnson_cook_force(flow: pr.JohnsonCook, reduction: float) -> float:
    """Force (N) of rate-dependent homogeneous upsetting at constant speed in one unit of time, from its own equation.

    With Hencky's law along the axis, σ = E ε_e exp((1 − 2ν) ε_e) and ε_e = ln(h₀/h) − ε̄, the yield condition
    σ = σ_static(ε̄) (1 + C ln(ε̄̇/rate0)) is solved for ε_e(t) by fixed-point passes; they contract while
    C σ/(E ε̄̇ Δt) < 1, hence the coarse grid, whose differences are second order.
    """
    t = np.linspace(0.0, 1.0, 401)
    total = -np.log1p(-reduction * t)
    elastic = np.zeros_like(t)
    for _ in range(60):
        a = np.maximum(total - elastic, 1e-14)
        rate = np.maximum(np.gradient(a, t, edge_order=2), 1e-300) / flow.rate0
        s = (flow.A + flow.B * a**flow.n) * (1.0 + flow.C * np.log(np.maximum(rate, 1.0)))
        new = np.minimum(total, s / E * np.exp(-(1 - 2 * NU) * elastic))
        if np.abs(new - elastic).max() < 1e-15:
            break
        elastic = new
    e = float(elastic[-1])
    stress = E * e * np.exp((1 - 2 * NU) * e)
    lateral = np.exp(0.5 * (float(total[-1]) - e) + NU * e)
    return float(stress * np.pi * 100.0 * lateral**2)


@case("rate-dependent upsetting", suite="forming")
def johnson_cook(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Johnson-Cook: each time rule has its order in time, and its limit is the solution of the rate equation."""
    balance = Balance()
    flow = pr.JohnsonCook(250.0, 500.0, 0.3, 0.05, 1e-3)
    exact = johnson_cook_force(flow, 0.3)
    for order, rule in enumerate(TIME_RULES, 1):
        errors = []
        for increments in (25, 50, 100):
            p = upsetting(
                (2, 2), 0.0, flow, enforcement=pr.Augmented(), increments=increments, E_scale=E_scale, reductions=(0.3,)
            )
            errors.append(balance.last(p, pr.Numerics(time_rule=rule)).force("punch").y / exact - 1.0)
        yield row(f"{rule}: force at 30 % in 100 increments", exact, exact * (1 + errors[-1]), 1e-3)
        extrapolated = errors[2] + (errors[2] - errors[1]) / (2**order - 1)
        yield row(f"{rule}: force extrapolated to zero step", exact, exact * (1 + extrapolated), 1e-4)
        observed = float(np.log2((errors[0] - errors[1]) / (errors[1] - errors[2])))
        yield row(f"{rule}: observed order in time", order, observed, 0.15, "absolute")
    yield from balance.rows()


MESHES = ((16, 12), (32, 24), (48, 36), (64, 48))


def _friction(
    mu: float, mesh: tuple[int, int], graded: bool, E_scale: float, mu_scale: float
) -> tuple[list[Increment], Balance]:
    balance = Balance()
    return list(balance.watch(upsetting(mesh, mu * mu_scale, graded=graded, E_scale=E_scale), pr.Numerics())), balance


def _register(mesh: tuple[int, int], graded: bool) -> None:
    label = f"{mesh[0]} × {mesh[1]}{' graded' if graded else ''}"
    slow = mesh[0] > 32

    @case(f"upsetting, mu = 0.1, {label}", suite="upsetting", slow=slow)
    def mu_01(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
        """Force and barrel radius of an independent solver, default settings."""
        history, balance = _friction(0.1, mesh, graded, E_scale, mu_scale)
        marks = at(REDUCTIONS, history)
        for r, F, inc in zip(REDUCTIONS, tables.UPSETTING_FORCE_MU_01["cauchy"].values(), marks):
            yield row(f"force at {r:.0%}, kN", F, inc.force("punch").y / 1e3, 0.002)
        yield row("barrel radius at 50 %", 14.350, float(marks[-1].bodies["billet"].x[:, 0].max()), 0.001)
        yield from _reports(history, marks)
        yield from balance.rows()

    @case(f"upsetting, mu = 0.3, {label}", suite="upsetting", slow=slow)
    def mu_03(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
        """To 50 % with the free side folding onto the die; force and barrel radius of an independent solver."""
        history, balance = _friction(0.3, mesh, graded, E_scale, mu_scale)
        marks = at(REDUCTIONS, history)
        for r, F, inc in zip(REDUCTIONS, tables.UPSETTING_FORCE_MU_03.values(), marks):
            yield row(f"force at {r:.0%}, kN", F, inc.force("punch").y / 1e3, 0.004 if mesh[0] > 32 else 0.01)
        yield row("barrel radius at 50 %", 14.517, float(marks[-1].bodies["billet"].x[:, 0].max()), 0.002)
        yield from _reports(history, marks)
        yield from balance.rows()


def _reports(history: list[Increment], marks: list[Increment]) -> Iterator[Row]:
    for r, inc in list(zip(REDUCTIONS, marks))[2:]:
        yield row(f"force at {r:.0%}, kN", np.nan, inc.force("punch").y / 1e3, 0.0, "report")
    yield row("increments", np.nan, len(history), 0.0, "report")
    yield row("Newton iterations", np.nan, sum(i.statistics.iterations for i in history), 0.0, "report")
    yield row("cut-backs", np.nan, sum(i.statistics.cutbacks for i in history), 0.0, "report")
    energy = history[-1].energy
    yield row("energy imbalance", 0.0, energy["imbalance"] / energy["external"], 5e-3, "absolute")
    least = min(i.energy[k] for i in history for k in ("plastic", "friction"))
    yield row("least accumulated dissipation", 0.0, least, 0.0, "at least")


for _graded in (False, True):
    for _mesh in MESHES:
        _register(_mesh, _graded)


def ring(n: tuple[int, int], mu: float, *, E_scale: float = 1.0, flow: FlowCurve = BILLET_FLOW) -> pr.Problem:
    """Upper half of the ring OD 18, ID 9, height 6; both free sides may fold onto the die."""
    body = pr.Body(pr.Rectangle(size=(4.5, 3), n=n, origin=(4.5, 0)), pr.J2(E * E_scale, NU, flow))
    return pr.Problem(
        "ring compression", space="axisymmetric", bodies={"ring": body}, tools={"die": pr.Plane(touching="ring.top")},
        contacts=(pr.Contact(("ring.top", "ring.right", "ring.left"), "die", friction=pr.Coulomb(mu) if mu else None),),
        fixed={"ring.bottom": "y"}, steps=(pr.Step("press", move=stroke("die", 3.0)),),
    )  # fmt: skip


def bore_change(inc: Increment) -> float:
    """Change of the bore diameter at mid-height, %: the inner corner at the die is overrun and says nothing."""
    b = inc.bodies["ring"]
    node = int(np.argmin(np.abs(b.X[:, 0] - 4.5) + np.abs(b.X[:, 1])))
    return float(100.0 * (b.x[node, 0] / b.X[node, 0] - 1.0))


@case("ring compression", suite="forming", slow=True)
def ring_compression(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Change of the bore at mid-height within 0.4 points of an independent solver up to 50 %."""
    for mu, table in tables.RING_BORE_CHANGE.items():
        balance = Balance()
        history = list(balance.watch(ring((30, 20), mu * mu_scale, E_scale=E_scale), pr.Numerics()))
        for r, change, inc in zip(REDUCTIONS, table, at(REDUCTIONS, history), strict=True):
            yield row(f"mu = {mu:g}: change of bore at {r:.0%}, points", change, bore_change(inc), 0.4, "absolute")
        yield from balance.rows()


def tube(n: int, displacement: float, kinematics: str, increments: int, E_scale: float = 1.0) -> pr.Problem:
    """Thick tube, radii 10 and 20, plane strain along its axis, perfectly plastic with k = 100; bore displaced outwards."""
    body = pr.Body(
        pr.Rectangle(size=(10, 1), n=(n, 1), origin=(10, 0)), pr.J2(E * E_scale, NU, pr.Perfect(100.0 * np.sqrt(3.0)))
    )
    return pr.Problem(
        "tube", space="axisymmetric", kinematics=kinematics, allow_large_strain=kinematics == "small", bodies={"tube": body},
        fixed={"tube.bottom": "y", "tube.top": "y", "tube.left": pr.Fixed(x=displacement)},
        steps=(pr.Step("expand", increments=increments),),
    )  # fmt: skip


def bore_pressure(inc: Increment) -> float:
    """Mean pressure on the bore from the support reactions, per current area."""
    b = inc.bodies["tube"]
    bore = b.X[:, 0] == b.X[:, 0].min()
    return float(b.reaction[bore, 0].sum() / (2 * np.pi * b.x[bore, 0].mean() * 1.0))


@case("thick tube", suite="forming")
def thick_tube(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Full-yield pressure 2k ln(b/a) with second-order convergence, and the finite expansion of a rigid-plastic tube."""
    balance = Balance()
    exact = ref.tube_pressure(100.0, 10.0, 20.0)
    errors = []
    for n in (8, 16, 32):
        *_, last = balance.watch(tube(n, 0.6, "small", 10, E_scale))
        # the bore moves by 6 %: small strain keeps the initial area
        errors.append(bore_pressure(last) * (1 + 0.06) / exact - 1.0)
    yield row("full-yield pressure, 16 elements", exact, exact * (1 + errors[1]), 0.002)
    yield row("full-yield pressure, 32 elements", exact, exact * (1 + errors[2]), 0.0005)
    yield row("observed order in h", 2.0, float(np.log2(errors[1] / errors[2])), 0.1, "absolute")
    *_, last = balance.watch(tube(16, 10.0, "finite", 100, E_scale))
    expansion = float(ref.tube_expansion(100.0 * np.sqrt(3.0), 10.0, 20.0, 20.0))
    yield row("pressure of the tube expanded to twice its bore", expansion, bore_pressure(last), 0.005)
    yield from balance.rows()


def flat_punch(n: int, E_scale: float = 1.0) -> pr.Problem:
    """Flat punch of half-width 1 on a block 6 × 4, n elements under the punch, smooth, small strain, k = 100/√3."""
    mesh = pr.Rectangle(size=(6, 4), n=(4 * n, 3 * n), grade=pr.Grade(x=(1.0,), y=(4.0,), ratio=6))
    body = pr.Body(mesh, pr.J2(E * E_scale, NU, pr.Perfect(100.0)))
    return pr.Problem(
        "flat punch", kinematics="small", contact_geometry="reference", bodies={"block": body},
        tools={"punch": pr.Stamp(width=2.0, touching="block.top")}, contacts=(pr.Contact("block.top", "punch"),),
        fixed={"block.bottom": "y", "block.left": "x", "block.right": "x"},
        steps=(pr.Step("press", move={"punch": pr.Motion(y=-0.06)}, increments=30),),
    )  # fmt: skip


@case("flat punch (Prandtl)", suite="forming", slow=True)
def prandtl(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The limit load falls to (2 + π)k with refinement; within 1 % when referred to the effective width.

    The nodal rule carries pressure on half an element beyond the edge node, so the effective half-width is 1 + h/2.
    """
    exact = ref.prandtl_punch(100.0 / np.sqrt(3.0))
    balance = Balance()
    errors, sizes, corrected = [], [], []
    for n in (4, 8, 16):
        p = flat_punch(n, E_scale)
        *_, last = balance.watch(p)
        x = np.unique(last.contacts["block.top-punch"].X[:, 0])
        h = float(x[x > 1.0 + 1e-9][0] - 1.0)
        F = last.force("punch").y
        errors.append(F / exact - 1.0)
        corrected.append(F / (1.0 + 0.5 * h) / exact - 1.0)
        sizes.append(h)
    for h, e, c in zip(sizes, errors, corrected, strict=True):
        yield row(f"limit pressure, h = {h:.3g}: excess over (2 + π)k", np.nan, e, 0.0, "report")
        yield row(f"limit pressure, h = {h:.3g}: the same on the effective width", np.nan, c, 0.0, "report")
    yield row("falls with refinement (ratio of the last two excesses)", 1.0, errors[2] / errors[1], 0.0, "at most")
    yield row(
        "observed order in h", np.nan, float(np.log(errors[1] / errors[2]) / np.log(sizes[1] / sizes[2])), 0.0, "report"
    )
    yield row("limit pressure on the effective width", exact, exact * (1 + corrected[2]), 0.01)
    yield from balance.rows()


NECKING = pr.Voce(450.0, 265.0, 16.93, 129.24)


def necking_bar(
    n: tuple[int, int], E_scale: float = 1.0, increments: int = 60, half_elongation: float = 6.0
) -> pr.Problem:
    """Quarter of the bar R = 6.413, length 53.334, with its ends gripped, so that it necks in the middle by itself."""
    mesh = pr.Rectangle(size=(6.413, 26.667), n=n, grade=pr.Grade(y=(0.0,), ratio=4))
    return pr.Problem(
        "necking bar", space="axisymmetric", bodies={"bar": pr.Body(mesh, pr.J2(206_900.0 * E_scale, 0.29, NECKING))},
        fixed={"bar.bottom": "y", "bar.top": pr.Fixed(x="held", y=half_elongation)},
        steps=(pr.Step("pull", increments=increments),),
    )  # fmt: skip


def bar_force(inc: Increment) -> float:
    """Pulling force at the grip, kN."""
    b = inc.bodies["bar"]
    top = b.X[:, 1] == b.X[:, 1].max()
    return float(b.reaction[top, 1].sum()) / 1e3


@case("necking bar (Considère)", suite="forming", slow=True)
def considere(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """The largest force is Considère's; afterwards the bar necks."""
    balance = Balance()
    area = np.pi * 6.413**2
    exact = ref.considere(curve(NECKING), area=area, length=53.334, E=206_900.0, nu=0.29)
    history = list(balance.watch(necking_bar((8, 24), E_scale)))
    F = np.array([bar_force(i) for i in history])
    yield row("largest force, kN (elastic-plastic bar)", float(exact.force) / 1e3, float(F.max()), 0.003)
    yield row("largest force, kN (rigid-plastic bar)", 79.73, float(F.max()), 0.003)
    last = history[-1].bodies["bar"]
    middle = float(last.x[last.X[:, 1] == 0.0, 0].max()) / 6.413
    yield row("radius of the neck over the initial one", 0.9, middle, 0.0, "at most")
    yield row("force at the end over the largest", 1.0, float(F[-1] / F.max()), 0.0, "at most")
    yield from balance.rows()


@case("energy ledger", suite="forming")
def energy_balance(E_scale: float = 1.0, mu_scale: float = 1.0) -> Iterator[Row]:
    """Work of the tools equals stored plus dissipated energy; the imbalance falls with the step."""
    balance = Balance()
    imbalance = []
    for increments in (25, 50, 100):
        *_, last = balance.watch(upsetting((16, 12), 0.1, increments=increments, reductions=(0.3,)))
        imbalance.append(abs(last.energy["imbalance"]) / last.energy["external"])
    yield row("frictional upsetting to 30 %, 100 increments", 0.0, imbalance[2], 5e-3, "absolute")
    yield row("imbalance at half the step over that at the whole", 0.7, imbalance[2] / imbalance[1], 0.0, "at most")
    yield row("the same, one step earlier", 0.7, imbalance[1] / imbalance[0], 0.0, "at most")
    from prensa.verify.example1 import problem

    press = pr.Step("press", move={"cylinder": pr.Motion(y=-2.0)}, increments=50)
    p = problem((40, 30), "finite", "current", pr.NeoHooke(1e4, 0.3), (press,))
    *_, last = balance.watch(p)
    yield row(
        "elastic, frictionless, 50 increments",
        0.0,
        last.energy["imbalance"] / last.energy["external"],
        1e-4,
        "absolute",
    )
    yield from balance.rows()
