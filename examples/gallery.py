"""The gallery: forming processes run from their case files, each beside its slab, slip-line, closed-form or published solution.

    python examples/gallery.py                      # all of them, one after the other: some ten minutes
    python examples/gallery.py --jobs 2             # two at a time
    python examples/gallery.py cup_drawing          # by name
    python examples/gallery.py --page docs/gallery/forming  # writes the page of the documentation and its pictures too

What was measured is kept beside the pictures (``measured.json``). With names, ``--page`` takes the rest of the page from what its
folder keeps, and writes none where an example is missing.

Ends with exit code 1 if a number is farther from its reference than the table allows.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import prensa as pr
from prensa import reference as ref
from prensa.errors import PrensaError
from prensa.measures import parse_all
from prensa.output import plot, style
from prensa.reference.drawing import cup_force, slab_drawing, strip_upper_bound, wire_upper_bound
from prensa.reference.rolling import orowan_rolling
from prensa.reference.tables import die_deflection
from prensa.result.increment import Increment
from prensa.verify.table import Row, cells, heard, not_meant, row

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from common import beside, judged  # noqa: E402  (a neighbour, also when this file is run from elsewhere)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """Measures of a case over its increments: ``table`` by name, ``ends`` the row at the end of each step, the ``last`` one."""

    problem: pr.Problem
    table: dict[str, Array]
    ends: dict[str, int]
    last: Increment | None = None

    def __getitem__(self, name: str) -> float:
        """The last value of a measure."""
        return float(self.table[name][-1])

    def end(self, name: str, step: str) -> float:
        """The value of a measure at the end of a step."""
        return float(self.table[name][self.ends[step]])

    def when(self, name: str, other: str, value: float) -> float:
        """The value of a measure where another one, which rises, has a value."""
        return float(np.interp(value, self.table[other], self.table[name]))


Compare = Callable[[Run], Iterable[Row]]


@dataclass(frozen=True)
class Example:
    """A case file with ``changes``, what is compared, and whether it is of those that run in seconds, or for minutes.

    ``box``: part of the plane (x from, to, y from, to) that its picture shows; None for all. ``section``: across which axis, in
    space, its picture is cut in the middle. ``expected_warnings``: parts of the warnings
    that it is meant to give; any other is a failing row.
    """

    title: str
    case: str
    compare: Compare
    changes: tuple[str, ...] = ()
    quick: bool = False
    long: bool = False
    box: tuple[float, float, float, float] | None = None
    section: str = ""
    expected_warnings: tuple[str, ...] = ()


_EXAMPLES: dict[str, Example] = {}


def example(title: str, name: str = "", changes: tuple[str, ...] = (), **how: Any) -> Callable[[Compare], Compare]:
    """Put what is compared of the case file that the function is named after (or *name*) on the list; *how*: see `Example`."""

    def put(compare: Compare) -> Compare:
        case = name or compare.__name__
        key = case + "".join(f", {c.rpartition('=')[0].rpartition('.')[2]} = {c.rpartition('=')[2]}" for c in changes)
        _EXAMPLES[key] = Example(title, case, compare, changes, **how)
        return compare

    return put


# -------------------------------------------------------------------------------------------- drawing, extrusion, rolling
WEDGE = {"alpha": math.radians(15.0), "k": 100.0}


def _through_a_wedge(stress: float, what: str) -> Iterator[Row]:
    exact = ref.wedge_drawing(H=1.0, **WEDGE)
    sizes = {"before": 1.0, "after": exact.exit, "alpha": WEDGE["alpha"]}
    yield row(f"{what} (MPa), slip-line field", exact.pull / exact.exit, stress, 0.04)
    slab = slab_drawing(**sizes, Y=WEDGE["k"] * math.sqrt(3.0), axisymmetric=False)
    yield row(f"{what} (MPa), slab method: no work of turning the flow", slab, stress, 0.0, "at least")
    bound = strip_upper_bound(**sizes, k=WEDGE["k"])
    yield beside(f"{what} (MPa), upper bound of a rigid triangle, rigid-plastic", bound, stress)


@example("Strip drawing")
def strip_drawing(run: Run) -> Iterator[Row]:
    """Pull over the thickness behind the die."""
    yield from _through_a_wedge(run["pull"] / ref.wedge_drawing(H=1.0, **WEDGE).exit, "drawing stress")


STEPS = ("elements lie in the contact, forces step by",)  # true: what is compared are means over a passage


@example("Plane extrusion", expected_warnings=STEPS)
def plane_extrusion(run: Run) -> Iterator[Row]:
    """Force of the ram over the thickness of the billet."""
    yield from _through_a_wedge(run["ram"], "pressure on the ram")


@example("Wire drawing", quick=True)
def wire_drawing(run: Run) -> Iterator[Row]:
    """Pull over the section of the drawn wire, between the slab method and the upper bound of the nominal reduction."""
    stress = run["pull"] / (math.pi * run["drawn_radius"] ** 2)
    sizes = {"before": 5.0, "after": 4.5, "alpha": math.radians(8.0), "Y": 300.0, "m": 0.1}
    yield row("drawing stress (MPa), slab method", slab_drawing(**sizes), stress, 0.0, "at least")
    yield row("drawing stress (MPa), upper bound (Avitzur)", wire_upper_bound(**sizes), stress, 0.0, "at most")
    yield row("radius of the drawn wire (mm), the die's", 4.5, run["drawn_radius"], 0.002)


@example("Flat rolling", expected_warnings=STEPS)
def flat_rolling(run: Run) -> Iterator[Row]:
    """Force and moment over a passage, and the neutral point, beside the slab methods with elastic recovery."""
    data = {"R": 65.0, "H": 1.0, "h": 0.75, "mu": 0.1, "k": 100.0, "E": 50e3}
    slab, orowan = ref.strip_rolling(**data), orowan_rolling(**data)
    neutral = float(run.table["neutral"][run.ends["fill"] + 1 :].mean())
    yield row("force (N/mm), Kármán", slab.force, run["force"], 0.05)
    yield row("force (N/mm), Orowan", orowan.force, run["force"], 0.05)
    yield row("moment (N mm/mm), Kármán", slab.torque, -run["moment"], 0.05)
    yield row("moment (N mm/mm), Orowan", orowan.torque, -run["moment"], 0.05)
    # the elements are 0.4 mm long before the rolls
    yield row("neutral point (mm before the rolls), Kármán", 65.0 * math.sin(slab.neutral), -neutral, 0.2, "absolute")


@example("A roll bites a bar")
def bar_rolling(run: Run) -> Iterator[Row]:
    """Force and moment per width of the bar over the last fifth of a radian, in which six elements pass, beside Orowan."""
    width, height, gap = 7.0, 5.0, 4.0

    def k(half: float) -> float:
        return float(500.0 * (0.01 + 2.0 / math.sqrt(3.0) * math.log(height / half)) ** 0.15 / math.sqrt(3.0))

    orowan = orowan_rolling(R=40.0, H=height, h=gap, mu=0.35, k=k, E=200e3)
    turn = run.table["turn"]
    last = turn >= 0.7 * turn[-1]
    means = (float(np.trapezoid(run.table[m][last], turn[last])) for m in ("force", "moment", "push"))
    force, moment, push = (mean / width / float(np.ptp(turn[last])) for mean in means)
    # the arc of contact is as long as the bar is thick, which slab methods are not made for, and the bar spreads
    yield row("force (N/mm), Orowan, plane strain", orowan.force, force, 0.1)
    yield row("moment (N mm/mm), Orowan, plane strain", orowan.torque, -moment, 0.1)
    yield row("push (N/mm), a free bar has none", 0.0, push, 1e-6 * force, "absolute")


# --------------------------------------------------------------------------------------------------------- sheet forming
@example("Hemispherical stretching")
def hemispherical_stretching(run: Run) -> Iterator[Row]:
    """Depth at the forces read off the published curve, forces at its depths beside a smooth curve through the readings.

    The readings lie up to 3.2 % off the best cubic through the origin: no curve of force against depth has their kinks.
    """
    depths, forces = np.array([10.6, 15.4, 20.0, 24.7, 28.2, 33.0, 37.4]), np.arange(10.0, 80.0, 10.0)
    for force, depth in zip(forces[:-1], depths):
        ours = float(np.interp(force, -run.table["force"] / 1e3, run.table["depth"]))
        yield row(f"depth (mm) at {force:g} kN, read off the curve of the benchmark", float(depth), ours, 0.05)
    powers = depths[:, None] ** [1, 2, 3]
    smooth = powers @ np.linalg.lstsq(powers / forces[:, None], np.ones(7), rcond=None)[0]
    for force, curve, depth in zip(forces, smooth, depths):
        ours = -run.when("force", "depth", float(depth)) / 1e3
        yield row(f"force (kN) at {depth:g} mm, smooth curve through the readings", float(curve), ours, 0.05)
        if force == 70.0:
            yield row(f"force (kN) at {depth:g} mm, read off", 70.0, ours, 0.05)
        else:
            yield beside(f"force (kN) at {depth:g} mm, read off", float(force), ours)


@example("Cup drawing")
def cup_drawing(run: Run) -> Iterator[Row]:
    """Largest force beside Siebel's estimate at that rim, and the volume of the flange by its thickness."""
    k = int(np.argmax(run.table["force"]))
    rim, inner = 2.0 * float(run.table["rim"][k]), 41.0
    strains = (math.log(80.0 / rim), math.log(math.sqrt(80.0**2 + inner**2 - rim**2) / inner))
    flow = float(np.mean([560.0 * (0.007 + e) ** 0.22 for e in strains]))
    siebel = cup_force(punch=40.0, blank=rim, thickness=1.0, flow=flow, binder=15000.0, mu=0.08)
    yield row("largest force (kN), Siebel", siebel / 1e3, float(run.table["force"][k]) / 1e3, 0.15)
    # a rim under hoop compression alone: its thickness strain is half of what it is compressed by
    yield row(
        "thickness of the rim (mm), uniaxial compression", math.sqrt(40.0 / run["rim"]), run["rim_thickness"], 0.03
    )


@example("Channel forming")
def channel_forming(run: Run) -> Iterator[Row]:
    """Punch force of the published example; the force of the holder is what was asked for."""
    force = run.table["force"][run.ends["hold"] + 1 :]
    plateau = float(force[len(force) // 2 :].mean())
    yield row("punch force (N/mm), mean of the second half, Abaqus: Getting Started", 160.0, plateau, 0.1)
    yield row("punch force (N/mm), largest, Abaqus: Getting Started", 160.0, float(force.max()), 0.1)
    yield row("holder force (N/mm)", 440.0, run["holder_force"], 1e-8)
    yield beside("largest plastic strain (at the skin), Abaqus: Getting Started", 0.21, run["strain"])
    # strain of bending grows with the distance from the middle; there lie the outer points of four layers of reduced elements
    yield beside("the same at three quarters of the way from the middle to the skin", 0.21, 0.75 * run["strain"])


@example("Free bending with springback")
def free_bending(run: Run) -> Iterator[Row]:
    """Angle between the legs at the end of the stroke, and after release beside the spread of other programs."""
    flow = lambda strain: 550.4 * (0.0093146 + strain) ** 0.223  # noqa: E731
    exact = ref.free_bending(
        punch=23.5, shoulder=4.0, apart=29.0, thickness=1.0, E=70500.0, nu=0.342, mu=0.1342, flow=flow
    )
    bent, released = (180.0 - 2.0 * run.end("leg", step) for step in ("bend", "release"))
    yield row("angle between the legs (deg), strip in bending", math.degrees(exact.angle), bent, 0.02)
    yield beside("angle between the legs (deg), NAFEMS R0094", 21.84, bent)
    as_bent = math.degrees(exact.released)
    yield beside("angle after release (deg), strip with the curvature of the punch along its whole length", as_bent, released)
    yield beside("angle after release (deg), NAFEMS R0094", 54.45, released)
    yield beside("angle after release (deg), another program there", 43.2, released)


@example("V-bending with springback")
def v_bending(run: Run) -> Iterator[Row]:
    """Half way, with punch and shoulders level, a strip in bending; the pressed leg lies on the die of 45 degrees."""
    level = -run.table["stroke"][: run.ends["bend"] + 1]
    leg, force = (float(np.interp(9.0, level, run.table[m][: len(level)])) for m in ("leg", "force"))
    free = ref.free_bending(
        punch=4.0, shoulder=3.0, apart=16.0 + 3.0 * math.tan(math.radians(22.5)), thickness=2.0, E=210e3, nu=0.3, mu=0.1,
        flow=lambda strain: 560.0 * (0.007 + strain) ** 0.26,
    )  # fmt: skip
    exact = 0.5 * math.pi - 0.5 * free.angle
    yield row("angle of the leg (deg) at a stroke of 9 mm, strip in bending", math.degrees(exact), abs(leg), 0.02)
    push = free.force * (math.cos(exact) + 0.1 * math.sin(exact))
    yield row("force (N/mm) at a stroke of 9 mm, strip in bending", push, force, 0.03)
    yield row("angle of the leg in the die (deg)", 45.0, run.end("leg", "bend"), 0.02)
    yield beside("springback of the leg (deg)", float("nan"), -run["springback"])


@example("Draw bending", long=True, box=(0.0, 110.0, -78.0, 14.0))
def draw_bending(run: Run) -> Iterator[Row]:
    """Pull in the wall over the second half of the stroke and its curl, beside a strip drawn over the radius of the die."""
    drawn = ref.draw_bending(
        [5.0], [0.5 * math.pi], thickness=0.78, tension=2.0 * 0.144 * 35.0, E=206e3, nu=0.3, mu=0.144,
        flow=lambda strain: 565.32 * (0.007117 + strain) ** 0.2589,
    )  # fmt: skip
    stroke = -run.table["stroke"][: run.ends["draw"] + 1]
    force = run.table["force"][: len(stroke)]
    way = np.linspace(0.5 * stroke[-1], stroke[-1], 400)
    pull = float(np.interp(way, stroke, force).mean())
    yield row("pull in a wall (N/mm), mean of the second half, strip drawn over the radius", drawn.tension, pull, 0.05)
    yield row("force of the binder (N/mm)", 35.0, run.end("holder_force", "draw"), 1e-8)
    curl, exact = abs(run["curl"]), 1e3 * abs(drawn.curvature)
    yield row("curl of the wall (1/m) after release, strip drawn over the radius and straightened", exact, 1e3 * curl, 0.1)
    bottom, foot, head, flange = (run.end(name, "release") for name in ("bottom", "foot", "head", "flange"))
    yield beside("angle between bottom and wall (deg), theta 1", float("nan"), 180.0 - (foot - bottom))
    yield beside("angle between wall and flange (deg), theta 2", float("nan"), 180.0 - (head - flange))
    yield beside("radius of the wall (mm), rho", float("nan"), 1.0 / curl)


@example("Drawbead", expected_warnings=STEPS)
def drawbead(run: Run) -> Iterator[Row]:
    """The steady pull beside that of a strip which is bent to every bar and straightened behind it."""
    apart, deep = 9.0, 2.0
    wrap = math.asin(2.0 * 4.4 / math.hypot(apart, deep)) - math.atan2(deep, apart)
    data = {"thickness": 0.8, "tension": 0.0, "E": 210e3, "nu": 0.3, "flow": lambda strain: 560.0 * (0.007 + strain) ** 0.22}
    bent = ref.draw_bending([4.0, -4.0, 4.0], [wrap, 2.0 * wrap, wrap], mu=0.1, **data)
    way = run.table["way"] - 14.0
    late = np.linspace(0.75 * way[-1], way[-1], 400)
    pull = float(np.interp(late, way, run.table["pull"]).mean())
    yield row("steady pull (N/mm), strip bent to the bars and straightened", bent.tension, pull, 0.1)


@example("Bending and springback of a strip", quick=True)
def strip_springback(run: Run) -> Iterator[Row]:
    """Curvature of the middle between the curvatures of both sides, that goes back by 12 M/(E' t³)."""

    def middle(step: str) -> float:
        return 2.0 / (1.0 / abs(run.end("top", step)) + 1.0 / abs(run.end("bottom", step)))

    flow = lambda strain: 250.0 + 500.0 * strain**0.3  # noqa: E731
    loaded = middle("bend")
    back = loaded - float(ref.bend_strip(loaded, thickness=1.0, flow=flow, E=210e3, nu=0.3).released_curvature)
    yield row("springback (1/m), closed form of the bent strip", 1e3 * back, 1e3 * (loaded - middle("release")), 0.01)


# ---------------------------------------------------------------------------------------------------------- bulk forming
@example("Tube expansion", quick=True)
def thick_tube(run: Run) -> Iterator[Row]:
    """Pressure on the bore, at twice the bore and on the way, of a rigid-plastic tube."""
    for radius in (15.0, 20.0):
        force = run.when("force", "bore", radius)
        exact = float(ref.tube_expansion(173.20508, 10.0, 20.0, radius))
        yield row(f"pressure (MPa) at a bore of {radius:g} mm", exact, force / (2.0 * math.pi * radius), 0.005)


@example("Die of an upsetting, its load and deflection", quick=True)
def die_load(run: Run) -> Iterator[Row]:
    """Force and lift of the face of the die beside a solution in which die and billet are elastic together."""
    known = die_deflection()
    k = int(np.argmin(np.abs(known["half_height"] - (7.5 - 1.45932))))
    yield row("force (kN), die and billet elastic together", float(known["force"][k]), run["force"] / 1e3, 0.003)
    die = None if run.last is None else pr.die_stress(run.last, run.problem, "die", pr.Die(thickness=20.0, span=(0.0, 20.0)))
    for r in (0, 10, 20) if die is not None else ():
        lift = float(np.interp(r, die.X[:, 0], die.u[:, 1]))
        exact, within = 1e3 * float(known[f"lift_{r}"][k]), 0.015 if r else 0.03
        yield row(f"lift of the face (µm) at r = {r} mm", exact, 1e3 * lift, within)
    worn = 1e-5 / 6000.0 * run["wear"]
    yield beside("worn volume a part (mm³), k/H times normal force times way of slip", float("nan"), worn)


@example("Two blows of a hammer", quick=True)
def hammer(run: Run) -> Iterator[Row]:
    """Energy given beside what became of it, blow by blow."""
    ends = {name: run.ends[name] for name in ("first blow", "up", "second blow")}
    for blow, before, given in (("first blow", None, 500e3), ("second blow", "up", 800e3)):
        row_of = lambda name: run.table[name][ends[blow]] - (0.0 if before is None else run.table[name][ends[before]])  # noqa: E731, B023
        spent = sum(row_of(name) for name in ("plastic", "friction", "elastic", "contact"))
        yield row(f"{blow}: plastic, friction and elastic (J), energy given", given / 1e3, spent / 1e3, 0.001)
        yield beside(f"{blow}: efficiency (%)", float("nan"), 100.0 * (row_of("plastic") + row_of("friction")) / given)


@example("Upsetting until the equator cracks", quick=True)
def upsetting_cracks(run: Run) -> Iterator[Row]:
    """Cockcroft and Latham's damage at the equator beside Lévy and Mises' flow on its free surface."""
    if run.last is None:
        stretched = float(run["equator"])
    else:
        body = run.last.bodies["billet"]
        side = np.flatnonzero((body.X[:, 0] == 10.0) & (body.X[:, 1] < 4.0))
        Y, y = body.X[side, 1], body.x[side, 1]
        slope = np.polynomial.Polynomial.fit(Y[Y > 0] ** 2, y[Y > 0] / Y[Y > 0], 2)(0.0)
        stretched = 2.0 / 3.0 * (2.0 * math.log(run["largest_radius"] / 10.0) + math.log(slope))
    yield row("damage at the equator, from the stretch of its surface", stretched, run["equator"], 0.03)


@example("Forging in a closed die", quick=True)
def die_filling(run: Run) -> Iterator[Row]:
    """Missing volume beside the die's, drawn and integrated here, less that of the billet as it was, and as it is pressed."""
    height = 17.0 - 8.79
    ring = math.pi * (100.0 * 3.0 - (10.0**3 - 7.0**3) / 3.0)  # cut off by the chamfer: ∫ 10² - (7 + y)² dy
    # fillets of radius 1 where the outline turns by 45 degrees, each near its own radius
    rounded = 2.0 * math.pi * (10.0 + 7.0) * (math.tan(math.radians(22.5)) - math.radians(22.5))
    die, billet = math.pi * 100.0 * height - ring - rounded, math.pi * 6.5**2 * 17.0
    yield row("missing volume (mm³), within 0.2 % of the billet", die - run["volume"], run["missing"], 0.002 * billet, "absolute")
    yield beside("missing volume (mm³), of an incompressible billet", die - billet, run["missing"])
    yield row("share of the die that is filled (%)", 100.0 * run["volume"] / die, 100.0 * run["fill"], 0.2, "absolute")


@example("Upsetting on a crank press", quick=True)
def crank_press(run: Run) -> Iterator[Row]:
    """The elementary formula of the force, and the torque as the slope of the way of crank and rod makes it of that."""
    height, radius = 10.0, 10.0 * math.sqrt(1.5)
    stress = 250.0 + 500.0 * math.log(1.5) ** 0.3
    force = math.pi * radius**2 * stress * (1.0 + 2.0 * 0.1 * radius / (3.0 * height))
    yield row("force (kN) at dead centre, elementary formula", 1e-3 * force, 1e-3 * abs(run["force"]), 0.06)
    way, crank, rod = 5.0, 80.0, 400.0

    def slope(left: float) -> float:
        """Way over turn, ``left`` before dead centre."""
        turns = np.linspace(0.0, 0.6, 6001)
        ways = crank * (1.0 - np.cos(turns)) + rod - np.sqrt(rod**2 - (crank * np.sin(turns)) ** 2)
        return float(np.interp(left, ways, np.gradient(ways, turns)))

    k = int(np.argmax(run.table["used"]))
    torque, used = abs(run.table["force"][k]) * slope(way + run.table["stroke"][k]), 5.0 * run.table["used"][k]
    yield row("torque (kN m) where the press is used most, from the slope of crank and rod", 1e-6 * torque, used, 2e-3)


@example("Which strokes and frictions are safe", expected_warnings=("beyond its tests it is extrapolated",))
def forging_window(run: Run) -> Iterator[Row]:
    """One run of the window: the elementary formula, and the damage of its equator beside flow without friction."""
    height, strain = 21.0, math.log(30.0 / 21.0)
    radius = 10.0 * math.sqrt(30.0 / height)
    force = math.pi * radius**2 * 1015.0 * strain**0.17 * (1.0 + 2.0 * 0.1 * radius / (3.0 * height))
    yield row("force (kN), elementary formula", 1e-3 * force, 450.0 * run["used"], 0.03)
    yield row("damage at the equator, none without friction", 0.0, run["equator"], 0.0, "at least")


@example("Indentation and unloading", box=(-15.0, 15.0, -15.0, 6.0))
def indentation(run: Run) -> Iterator[Row]:
    """Hardness and the slope of unloading."""
    radius = math.sqrt(run.end("contact_area", "slacken") / math.pi)
    slope = (run.end("force", "load") - run.end("force", "slacken")) / (
        run.end("depth", "slacken") - run.end("depth", "load")
    )
    yield row("mean pressure over yield stress, Tabor", 2.8, run.end("pressure", "load") / 400.0, 0.07)
    yield row("slope of unloading (kN/mm), Sneddon", 2.0 * 200e3 / 0.91 * radius / 1e3, slope / 1e3, 0.07)


@example("Square head of a bolt")
def square_head(run: Run) -> Iterator[Row]:
    """Before it comes to the walls the head is round, and its force that of a cylinder upset with friction."""
    height = 10.0 - 3.5
    radius, strain = 5.0 * math.sqrt(10.0 / height), math.log(10.0 / height)
    force = math.pi * radius**2 * (250.0 + 500.0 * strain**0.3) * (1.0 + 2.0 * 0.1 * radius / (3.0 * height))
    pressed = float(np.interp(3.5, -run.table["stroke"], run.table["force"]))
    yield row("force (kN) before the walls, elementary formula", 1e-3 * force, 4e-3 * pressed, 0.06)
    yield beside("force (kN) at the end, most of the walls covered", math.nan, 4e-3 * run["force"])


@example("Square cup", long=True, section="z")
def square_cup(run: Run) -> Iterator[Row]:
    """Statics, what a strip that does not stretch is drawn in, and that the corner follows less; forces of the whole cup.

    The strip lies on the edges of punch, radius 8, and die, radius 5 and 15 mm beside it, and is straight between them.
    """
    thickness, depth, beside_it = 0.78, 15.0, 15.0
    radii, drop = 13.0 + thickness, depth - thickness - 13.0
    way = math.hypot(beside_it, drop)
    turn = math.atan2(drop, beside_it) + math.asin(radii / way)
    drawn = radii * turn + math.sqrt(way**2 - radii**2) - beside_it
    yield row("force of the die (kN), punch and holder", 4e-3 * (run["force"] + run["holder"]), -4e-3 * run["die"], 1e-6)
    yield row("draw-in of the middle of a side (mm), a strip that does not stretch", drawn, -run["side"], 0.0, "at most")
    yield row("draw-in of the corner (mm), at most as at the sides", -run["side"], -run["corner"], 0.0, "at most")
    yield row("volume (mm³), as of the blank", 0.78 * 75.0**2, run["volume"], 0.002)
    yield beside("force of the punch (kN)", math.nan, 4e-3 * run["force"])
    yield beside("largest thinning (%)", math.nan, 100.0 * run["thinning"])
    yield beside("largest thickening (%)", math.nan, 100.0 * run["thickening"])


@example("Tube bending")
def tube_bending(run: Run) -> Iterator[Row]:
    """Legs as tangents of former and roller; force and springback by the plastic moment M of a round thin tube in pure bending.

    Behind the former M falls linearly to nothing at the roller, whose force it is by the length of the leg.
    """
    radius, wall, centre = 9.25, 1.5, 60.0

    def pull(angle: float) -> float:
        return 500.0 * (0.01 + math.log1p(radius * math.sin(angle) / centre)) ** 0.2 * math.sin(angle)

    angles = np.linspace(0.0, 0.5 * math.pi, 201)
    moment = 4.0 * radius**2 * wall * float(np.trapezoid([pull(a) for a in angles], angles))
    across, down = 80.0, 40.0 - 59.9 - 29.9
    leg = math.sqrt(across**2 + down**2 - 89.8**2)
    bent = 0.5 * math.pi - math.atan(leg / 89.8) + math.atan2(down, across)
    back = moment / (200e3 * math.pi * radius**3 * wall) * (centre * bent + 0.5 * leg)

    def angle(step: str) -> float:
        return math.degrees(math.atan2(run.end("y2", step) - run.end("y1", step), run.end("x2", step) - run.end("x1", step)))

    yield row("angle of a leg (deg), tangent of former and roller", math.degrees(bent), angle("bend"), 0.03)
    force = 2e-3 * moment * math.cos(bent) / leg
    yield row("force (kN), plastic moment over the leg", force, 4e-3 * run.end("force", "bend"), 0.15)
    yield row("springback of a leg (deg), M/(E I)", math.degrees(back), angle("bend") - angle("release"), 0.2)
    for name, side in (("outside", 1.0), ("inside", -1.0)):
        expected = wall * math.exp(-0.5 * math.log1p(side * radius / centre))
        yield row(f"wall {name} (mm), pure bending to {centre:g} mm", expected, run.end(name, "bend"), 0.05)
    yield beside("height of the section (mm)", 20.0, run.end("top", "bend") - run.end("bottom", "bend"))


def _ring(m: float, decrease: float) -> None:
    @example("Ring compression with a shear factor", "ring_shear_factor", (f"friction.m={m}",), quick=m == 0.1)
    def compare(run: Run) -> Iterator[Row]:
        ours = 100.0 * (1.0 - run["bore"] / 15.0)
        yield row(f"decrease of the bore at half the height (%), m = {m}", decrease, ours, 2.5, "absolute")


@example("Ring compression with a shear factor", "ring_shear_factor", ("friction.m=0",))
def ring_without_friction(run: Run) -> Iterator[Row]:
    """Without friction all radii grow alike; the source's ring grew as much."""
    ours = 100.0 * (1.0 - run["bore"] / 15.0)
    strain = -math.log(1.0 - 0.4902)
    stress = 560.0 * (0.007 + strain) ** 0.26
    # the elastic part of the strain changes the volume
    exact = 100.0 * (1.0 - math.exp(0.5 * strain - (0.5 - 0.3) * stress / 210e3))
    yield row("decrease of the bore at half the height (%), m = 0, exact", exact, ours, 0.05, "absolute")
    yield row("decrease of the bore at half the height (%), m = 0, source", -40.05, ours, 0.15, "absolute")


for _m, _decrease in ((0.1, -15.5), (0.3, 13.3), (0.5, 29.3)):
    _ring(_m, _decrease)


@example("Vickers indentation in three dimensions", long=True)
def vickers(run: Run) -> Iterator[Row]:
    """Curvature C of the force C h², over the second half of the depth, beside the fit of Dao et al. (2001, Acta Mater. 49).

    C/σ_r = −1.131 x³ + 13.635 x² − 30.594 x + 29.267 with x = ln(E*/σ_r) and the stress σ_r at a plastic strain of 0.033.
    """
    stress = 748.0 * (0.0019 + 0.033) ** 0.1
    x = math.log(210e3 / (1.0 - 0.3**2) / stress)
    exact = stress * (((-1.131 * x + 13.635) * x - 30.594) * x + 29.267)
    depth, force = np.abs(run.table["depth"]), 4.0 * np.abs(run.table["force"])
    late = depth > 0.5 * depth[-1]
    ours = float((force * depth**2)[late].sum() / (depth**4)[late].sum())
    yield row("force over the square of the depth (GPa), fitted finite elements", 1e-3 * exact, 1e-3 * ours, 0.08)


# --------------------------------------------------------------------------------------------------------------- running
Found = tuple[str, list[Row], float]


def solve(name: str, pictures: Path | None = None) -> Found:
    """Run an example; its name, its rows and the processor seconds it took.

    A case that ends early is a failing row, and so is each warning that it gives and is not meant to.
    """
    chosen, began = _EXAMPLES[name], time.process_time()
    case = pr.load(HERE / f"{chosen.case}.yaml", chosen.changes)
    problem = case.problem
    measures = parse_all(problem)
    table: dict[str, list[float]] = {m: [] for m in measures}
    ends: dict[str, int] = {}
    shown = None
    try:
        with heard() as warnings:
            for k, increment in enumerate(pr.solve(problem, case.numerics)):
                for m, measure in measures.items():
                    table[m].append(measure.value_or_nan(increment))
                if increment.end_of_step:
                    ends[increment.step] = k
                    shown = increment if shown is None or increment.step not in ("release", "unload") else shown
        run = Run(problem, {m: np.array(v) for m, v in table.items()}, ends, increment)
        rows = [*chosen.compare(run), *not_meant(warnings, chosen.expected_warnings)]
    except PrensaError as error:
        print(f"{name}: {error}", file=sys.stderr)
        rows = [row(f"ended early: {type(error).__name__}", 0.0, float("nan"))]
    if pictures is not None and shown is not None and name == _pictured(chosen.case):
        pictures.mkdir(parents=True, exist_ok=True)
        mirror = case.output.mirror if problem.space == "solid" else ()
        picture = plot.deformed(shown, problem, "plastic_strain", mirror=mirror, box=chosen.box, section=chosen.section)
        with style.styled():
            picture.savefig(pictures / f"{chosen.case}.png", dpi=90, bbox_inches="tight")
    return name, rows, time.process_time() - began


def _pictured(case: str) -> str:
    """The example that shows a case: of several the last."""
    return [n for n, e in _EXAMPLES.items() if e.case == case][-1]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the examples; the number of comparisons that are beyond what is allowed, at most 1."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0], prog="gallery.py")
    parser.add_argument("names", nargs="*", help="examples, all of them if not given")
    parser.add_argument("--jobs", type=int, default=1, help="examples at a time")
    parser.add_argument("--quick", action="store_true", help="only those of a few seconds")
    parser.add_argument("--out", type=Path, default=Path("results") / "gallery", help="folder of the pictures")
    parser.add_argument("--page", type=Path, help="write the page of the documentation, NAME.md beside its folder NAME")
    given = parser.parse_args(argv)
    known = [n for n, e in _EXAMPLES.items() if e.quick or not given.quick]
    wanted = [n for n in known if not given.names or n.partition(",")[0] in given.names]
    if unknown := set(given.names) - {n.partition(",")[0] for n in known}:
        parser.error(f"unknown examples {', '.join(sorted(unknown))}; known: {', '.join(known)}")
    folder: Path = given.page or given.out
    failed, began, spent = 0, time.perf_counter(), 0.0
    for name, rows, seconds in _results(partial(solve, pictures=folder), wanted, given.jobs):
        failed += judged(f"{_EXAMPLES[name].title}: {name}, {seconds:.0f} s", rows)
        spent += seconds
        keep(folder, {name: rows})
        if name == _pictured(_EXAMPLES[name].case):
            print(f"picture: {folder / _EXAMPLES[name].case}.png", flush=True)
    print(
        f"{len(wanted)} examples, {failed} numbers beyond what is allowed; {spent:.0f} s of a processor, "
        f"{time.perf_counter() - began:.0f} s in all"
    )
    if given.page is not None:
        if missing := set(_EXAMPLES) - set(kept(folder)):
            parser.error(f"no page: {folder / KEPT} has nothing of {', '.join(sorted(missing))}; run them too")
        folder.with_suffix(".md").write_text(page(folder.name, kept(folder)), encoding="utf-8")
    return int(failed > 0)


def _results(one: Callable[[str], Found], names: list[str], jobs: int) -> Iterator[Found]:
    """What is found, in the order in which it is known; the longest begin first, so that no process waits for it at the end."""
    if jobs == 1:
        yield from map(one, names)
    else:
        with ProcessPoolExecutor(jobs) as pool:
            ordered = sorted(names, key=lambda n: not _EXAMPLES[n].long)
            yield from (found.result() for found in as_completed([pool.submit(one, n) for n in ordered]))


# ----------------------------------------------------------------------------------------------------- what was measured
KEPT = "measured.json"  # rows by example, in the folder of the pictures


def kept(folder: Path) -> dict[str, list[Row]]:
    """Rows by example that runs left in a folder, in the order of the list."""
    file = folder / KEPT
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    return {name: [Row(**r) for r in known[name]] for name in _EXAMPLES if name in known}


def keep(folder: Path, found: dict[str, list[Row]]) -> None:
    """Put rows beside what other runs left in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    known = kept(folder) | found
    rows = {name: [asdict(r) for r in known[name]] for name in _EXAMPLES if name in known}
    (folder / KEPT).write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


# -------------------------------------------------------------------------------------------------------------- the page
OPENING = """\
# Forming processes

Forming processes from their case files, each compared with an independent solution. `make examples` runs them all and
prints these comparisons; it fails where a number is farther from its reference than the table allows. Written by
`examples/gallery.py --page`.
Pictures show the equivalent plastic strain, under load.
"""


def page(folder: str, done: dict[str, list[Row]]) -> str:
    """The page beside a *folder* of pictures: a section for each case, its comments, its picture, its comparisons."""
    text = [OPENING]
    for case in dict.fromkeys(_EXAMPLES[n].case for n in done):
        names = [n for n in done if _EXAMPLES[n].case == case]
        opening = (HERE / f"{case}.yaml").read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
        text += [f"## {_EXAMPLES[names[0]].title}", "", f"{opening} [`{case}.yaml`](../../examples/{case}.yaml)", ""]
        text += [f"![{_EXAMPLES[names[0]].title}]({folder}/{case}.png)", ""]
        text += ["| quantity | reference | prensa | error | allowed |", "|---|---:|---:|---:|---:|"]
        for r in (r for n in names for r in done[n]):
            text.append("| " + " | ".join(_written(r)) + " |")
        text.append("")
    return "\n".join(text)


def _written(r: Row) -> tuple[str, ...]:
    """Cells of a row of the page: as many digits as tell something, and none of an error that is round-off."""
    values = ("" if math.isnan(v) else f"{v:.4g}" for v in (r.reference, r.ours))
    allowed = "" if r.kind == "report" else cells(r)[5]
    if r.kind in ("at most", "at least") or math.isnan(r.error):
        return r.quantity, *values, "", allowed
    of, unit = (1.0, "") if r.kind == "absolute" else (0.01 * abs(r.reference), " %")
    error = round((r.ours - r.reference) / of, 4)
    return r.quantity, *values, f"{error:+.2g}{unit}" if error else f"0{unit}", allowed


if __name__ == "__main__":
    sys.exit(main())
