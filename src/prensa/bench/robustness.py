"""Random contact problems on default settings, every answer checked.

A problem is drawn from tool shape, motion (press, press and slide, roll, turn, push by force, twist by moment, release), the
springs the tool hangs on, friction (none to sticking, hardening, softening, shear factor), mode, material, element, grading and
distortion of the mesh, steps that are often too large on purpose, and units. Elastic problems have any element, plastic ones
those that do not lock. Converged is not enough: equilibrium, complementarity, the friction bound, the sign of
the dissipations and the volume of every element are checked at every increment, and a sample is run again at half the
step and ten times the penalty.
"""

from __future__ import annotations

import csv
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import prensa as pr
from prensa.errors import PrensaError
from prensa.fem.discretise import discretise
from prensa.friction.law import At
from prensa.solver.increment import Increment

Array = NDArray[np.float64]
SYSTEMS = {"mm-N": (1.0, 1.0), "m-N": (1e-3, 1.0), "inch-lbf": (1 / 25.4, 1 / 4.4482216152605)}
RERUN_EVERY = 10  # one problem in so many is solved again with smaller increments and a larger penalty
CONVERGING = 0.75  # ratio of successive changes of the peak force, as the step is halved, below which it converges
BALANCE = 1e-7  # allowed force imbalance, relative to the largest tool force so far
AGREE = 0.05  # allowed relative difference of the peak tool force between the two solutions


@dataclass(frozen=True)
class Outcome:
    """Result of a problem: ``status`` 'right', 'failed' (reported by the solver) or 'wrong' (not reported), reason and cost."""

    number: int
    kind: str
    status: str
    words: str = ""
    iterations: int = 0
    cutbacks: int = 0
    seconds: float = 0.0


@dataclass
class Tally:
    """Outcomes of a suite."""

    suite: str
    seed: int
    outcomes: list[Outcome] = field(default_factory=list)

    def share(self, status: str) -> float:
        """Share of outcomes with a status."""
        return sum(o.status == status for o in self.outcomes) / max(len(self.outcomes), 1)


ANY = ("q4", "q4_enhanced", "t3", "t6", "q8", "q8_full")
# by suite, out of and in plane stress; F-bar, the default, more often
SUITE_ELEMENTS = {
    "elastic": (("q4_fbar", "q4_fbar", *ANY), ANY),
    "plastic": (("q4_fbar", "q4_fbar", "q4_fbar", "q4_enhanced", "t6", "q8"), ("q4", "q4", "q4_enhanced", "t6", "q8")),
}


def draw(suite: str, seed: int, number: int) -> pr.Problem:
    """Problem *number* of a suite (``elastic`` or ``plastic``): the same for the same arguments."""
    rng = np.random.default_rng([seed, number, suite == "plastic"])
    system = str(rng.choice(list(SYSTEMS)))
    L, F = SYSTEMS[system]
    P = F / L**2
    space = str(rng.choice(["plane strain", "axisymmetric", "plane stress"], p=[0.45, 0.4, 0.15]))
    axi = space == "axisymmetric"
    plastic = suite == "plastic"
    kinematics = "finite" if plastic or rng.random() < 0.5 else "small"
    geometry = "reference" if kinematics == "small" and rng.random() < 0.5 else "current"
    E = 10 ** rng.uniform(3, 5.3) * P
    nu = float(rng.uniform(0.0, 0.45))
    s0 = float(rng.uniform(0.001, 0.005)) * E
    material = _material(rng, plastic, kinematics, E, nu, s0)
    width, height = float(rng.uniform(8, 20)), float(rng.uniform(5, 15))
    nx, ny = int(rng.integers(8, 17)), int(rng.integers(5, 13))
    origin = float(rng.choice([0.0, 2.0])) if axi else 0.0
    element: Any = str(rng.choice(SUITE_ELEMENTS[suite][space == "plane stress"]))
    if element[:2] in ("t6", "q8"):  # of twice the size: as many nodes
        nx, ny = nx // 2 + 1, ny // 2 + 1
    body = pr.Body(_mesh(rng, width * L, height * L, nx, ny, origin * L), material, element)
    tool, flat, most = _tool(rng, axi, width, height, width / nx, origin, L)
    depth = float(rng.uniform(0.02, most)) * height * L
    law = _friction(rng, depth, L, plastic, E)
    motion = _motion(rng, axi, tool, law)
    if motion != "twist" and rng.random() < 0.15:
        tool = replace(tool, spring=_springs(rng, axi, E, width * L))
    increments = int(rng.integers(2, 9)) if rng.random() < 0.7 else None
    strength, share = (s0, (0.05, 0.6)) if plastic else (E, (1e-4, 2e-3))
    moment = (
        float(rng.uniform(0.1, 0.5)) * _smallest_coefficient(law) * getattr(tool, "radius", 0.0)
    )  # per force, of what friction bears
    steps = _steps(rng, motion, depth, width * L, strength, share, increments, axi, flat, moment, tool)
    hollow = tool.type == "circle" and tool.concave
    wide = flat or hollow or tool.type == "profile"
    sides = ["body.top", "body.right"] if rng.random() < (0.8 if plastic else 0.2) and wide else ["body.top"]
    tied = motion in ("press and slide", "roll", "twist")
    left = pr.Fixed(x=0.0) if origin else "x"  # round a rigid mandrel
    fixed = {"body.bottom": "xy" if tied or rng.random() < 0.5 else "y", "body.left": left}
    shape = ("hollow " if hollow else "") + tool.type + (" on springs" if tool.spring else "")
    return pr.Problem(
        f"{number}: {shape}, {motion}, {_name(law)}, {kinematics}-{geometry}, {space}, {material.type}, {element}, {system}",
        space=space, kinematics=kinematics, contact_geometry=geometry, allow_large_strain=kinematics == "small",
        bodies={"body": body}, tools={"tool": tool},
        contacts=(pr.Contact(tuple(sides), "tool", friction=law),), fixed=fixed, steps=tuple(steps),
        units=pr.Units(*system.split("-")),
    )  # fmt: skip


def _material(rng: np.random.Generator, plastic: bool, kinematics: str, E: float, nu: float, s0: float) -> Any:
    if plastic:
        return pr.J2(E, nu, _flow(rng, E, s0))
    return pr.NeoHooke(E, nu) if kinematics == "finite" and rng.random() < 0.5 else pr.Elastic(E, nu)


def _flow(rng: np.random.Generator, E: float, s0: float) -> Any:
    return [
        pr.Perfect(s0), pr.Linear(s0, 0.01 * E), pr.Ludwik(s0, 2 * s0, 0.3), pr.Swift(3 * s0, 0.01, 0.2),
        pr.Voce(s0, s0, 8.0), pr.HockettSherby(s0, 2 * s0, 3.0, 0.8), pr.JohnsonCook(s0, s0, 0.4, 0.02, 0.1),
        pr.FlowTable(((0.0, s0), (0.1, 1.6 * s0), (0.4, 2.2 * s0), (1.0, 2.6 * s0))),
    ][rng.integers(8)]  # fmt: skip


def _mesh(rng: np.random.Generator, width: float, height: float, nx: int, ny: int, x0: float) -> Any:
    kind = rng.integers(3)
    rectangle = pr.Rectangle(size=(width, height), n=(nx, ny), origin=(x0, 0.0))
    if kind == 1:
        grade = pr.Grade(x=(x0,), y=(height,), ratio=float(rng.uniform(2, 5)))
        return pr.Rectangle(size=(width, height), n=(nx, ny), origin=(x0, 0.0), grade=grade)
    if kind == 2:
        from prensa.mesh.generate import mesh_of

        mesh = mesh_of(rectangle)
        x = mesh.points.copy()
        inner = (
            (x[:, 0] > x0 + 1e-9 * width)
            & (x[:, 0] < x0 + width * (1 - 1e-9))
            & (x[:, 1] > 0)
            & (x[:, 1] < height * (1 - 1e-9))
        )
        x[inner] += rng.uniform(-0.2, 0.2, (int(inner.sum()), 2)) * np.array([width / nx, height / ny])
        return pr.Points(
            tuple(map(tuple, x.tolist())), tuple(map(tuple, mesh.cells.tolist())),
            {name: tuple(mesh.nodes(name).tolist()) for name in mesh.edges},
        )  # fmt: skip
    return rectangle


def _motion(rng: np.random.Generator, axi: bool, tool: Any, law: Any) -> str:
    """A motion that the problem has: friction must bear a moment, and a cylinder rolls."""
    options = ["press", "push", "release"]
    if not axi:
        options += ["press and slide", "turn"]
        if tool.type == "circle" and not tool.concave:
            options += ["roll", *(["twist"] if _smallest_coefficient(law) else [])]
    return str(rng.choice(options))


def _smallest_coefficient(law: Any) -> float:
    """The smallest coefficient that a Coulomb law can come to; 0 for others."""
    match getattr(law, "mu", None):
        case float() as mu:
            return mu
        case pr.MuExponential() as mu:
            return min(mu.mu0, mu.mu_inf)
        case pr.MuLinear() as mu:
            return mu.mu0
        case pr.MuTable() as mu:
            return min(mu.mu)
    return 0.0


def _springs(rng: np.random.Generator, axi: bool, E: float, width: float) -> Any:
    """A mount about as stiff as the body, along y, in rotation, or both."""
    c = float(10 ** rng.uniform(-0.5, 1.0)) * E
    if axi:
        return pr.Springs(y=c * width)
    which = rng.integers(3)
    return pr.Springs(y=c if which != 1 else None, rz=c * width**2 if which else None)


def _profile(rng: np.random.Generator, width: float, height: float, h: float, L: float) -> Any:
    """A wedge with a round nose, a bulged face, or two flats with a step between them."""
    w = float(rng.uniform(0.4, 0.9)) * width
    match rng.integers(3):
        case 0:
            slope = float(rng.uniform(0.2, 0.8))
            points: Any = ((-3 * width * L, 3 * width * slope * L), (0.0, 0.0), (3 * width * L, 3 * width * slope * L))
            fillet = float(rng.uniform(2.5, 6.0)) * h
        case 1:
            bulge, top = float(rng.uniform(0.05, 0.2)) * w, height * L
            points = ((-w * L, top), (-w * L, 0.0), pr.Arc(through=(0.0, -bulge * L), to=(w * L, 0.0)), (w * L, top))
            fillet = float(rng.uniform(1.0, 2.0)) * h
        case _:
            a, step = float(rng.uniform(0.3, 0.6)) * width, float(rng.uniform(0.02, 0.08)) * height
            b = a + step + h
            points = ((-3 * width * L, 0.0), (a * L, 0.0), (b * L, step * L), (3 * width * L, step * L))
            fillet = float(rng.uniform(1.0, 2.0)) * h
    return pr.Profile(points=points, fillet=fillet * L, touching="body.top")


def _polygon(rng: np.random.Generator, width: float, h: float, L: float) -> Any:
    """A trapezium on its short side, or a square on its tip."""
    a = float(rng.uniform(0.4, 1.0)) * width
    if rng.random() < 0.5:
        b = float(rng.uniform(0.1, 0.5)) * a
        points = ((-a, 0.0), (a, 0.0), (a + b, 2 * a), (-a - b, 2 * a))
        fillet = min(float(rng.uniform(1.0, 2.0)) * h, 0.4 * a)
    else:
        points = ((0.0, -2 * a), (2 * a, 0.0), (0.0, 2 * a), (-2 * a, 0.0))
        fillet = min(float(rng.uniform(2.5, 5.0)) * h, 1.2 * a)
    return pr.Polygon(points=tuple((x * L, y * L) for x, y in points), fillet=fillet * L, touching="body.top")


def _tool(
    rng: np.random.Generator, axi: bool, width: float, height: float, h: float, x0: float, L: float
) -> tuple[Any, bool, float]:
    """A tool, whether it is flat over the whole body, and the largest sensible depth as a share of the height."""
    kinds = ["plane", "circle", "stamp", "profile", "polygon", "hollow", *(["ring"] if axi else [])]
    kind = str(rng.choice(kinds))
    if kind == "plane":
        return pr.Plane(touching="body.top"), True, 0.3
    if kind == "circle":
        radius = max(float(rng.uniform(2.5 * h, 2 * width)), 1.2 * x0)  # larger than the bore of a ring
        return pr.Circle(radius=radius * L, touching="body.top"), False, 0.15
    if kind == "hollow":  # wide enough for the far corner of the body below
        radius = float(np.hypot(width + x0, rng.uniform(0.8, 3.0) * height))
        return pr.Circle(radius=radius * L, concave=True, touching="body.top"), False, 0.15
    if kind == "profile":
        return _profile(rng, width, height, h, L), False, 0.12
    if kind == "polygon":
        return _polygon(rng, width, h, L), False, 0.12
    if kind == "stamp":
        w = float(rng.uniform(0.4, 1.2)) * width
        fillet = float(rng.uniform(1.0, 2.0)) * h
        return pr.Stamp(width=w * L, fillet=min(fillet, 0.4 * w) * L, touching="body.top"), False, 0.1
    inner = float(rng.uniform(0.3, 0.5)) * width
    outer = inner + float(rng.uniform(0.25, 0.4)) * width
    return (
        pr.Ring(inner=inner * L, outer=outer * L, fillet=min(h, 0.3 * (outer - inner)) * L, touching="body.top"),
        False,
        0.1,
    )


def _friction(rng: np.random.Generator, depth: float, L: float, plastic: bool, E: float) -> Any:
    """None, weak, strong, sticking, hardening (exponential, linear, table), softening, shear factor.

    Softening stays slower than the body's own stiffness, (μ0 − μ∞) p/u0 < E/height with p ≈ E depth/height: beyond that
    the quasi-static answer jumps (stick-slip), and no increment, however small, follows a jump.
    """
    low, high = float(rng.uniform(0.05, 0.15)), float(rng.uniform(0.2, 0.5))
    slip = float(rng.uniform(0.05, 1.0)) * L
    match rng.integers(9):
        case 0:
            return None
        case 1:
            return pr.Coulomb(float(rng.uniform(0.02, 0.2)))
        case 2:
            return pr.Coulomb(float(rng.uniform(0.2, 0.6)))
        case 3:
            return pr.Coulomb(float(rng.uniform(1.0, 5.0)))
        case 4:
            return pr.Coulomb(pr.MuExponential(low, high, slip))
        case 5:
            return pr.Coulomb(pr.MuLinear(low, (high - low) / slip, high))
        case 6:
            return pr.Coulomb(pr.MuTable((0.0, 0.5 * slip, 2 * slip), (low, 0.8 * high, high)))
        case 7:
            return pr.Coulomb(pr.MuExponential(high, low, float(rng.uniform(1.5, 10.0)) * depth))
    return pr.Shear(float(rng.uniform(0.05, 1.0)), None if plastic else float(rng.uniform(1e-3, 1e-2)) * E)


def _name(law: Any) -> str:
    if law is None:
        return "frictionless"
    if law.type == "shear":
        return "shear factor"
    match law.mu:
        case pr.MuExponential() if law.mu.mu_inf < law.mu.mu0:
            return "softening"
        case float():
            return "sticking" if law.mu >= 1 else "Coulomb"
    return "hardening"


def _steps(
    rng: np.random.Generator, motion: str, depth: float, width: float, strength: float, share: tuple[float, float],
    increments: int | None, axi: bool, flat: bool, moment: float, tool: Any,
) -> Iterator[pr.Step]:  # fmt: skip
    """Steps of a motion; a force stays below what a plastic body of that flow stress can carry."""
    sign = float(rng.choice([-1, 1]))
    if motion in ("push", "twist"):
        area = width if not axi else np.pi * width**2
        force = float(rng.uniform(*share)) * strength * area
        if motion == "push" and tool.spring is not None and tool.spring.y is not None:
            # the mount is moved by what the spring would give under the force
            yield pr.Step("push", move={"tool": pr.Motion(y=-min(force / tool.spring.y, depth))}, increments=increments)
            return
        yield pr.Step("push", push={"tool": pr.Push(y=-force)}, increments=increments)
        if motion == "twist":
            push = pr.Push(y=-force, m=sign * moment * force)
            yield pr.Step("twist", push={"tool": push}, increments=increments)
        return
    yield pr.Step("press", move={"tool": pr.Motion(y=-depth)}, increments=increments)
    if motion == "press and slide":
        x = float(rng.uniform(0.2, 1.5)) * depth * sign
        yield pr.Step("slide", move={"tool": pr.Motion(x=x)}, increments=increments)
    elif motion == "roll":
        x = float(rng.uniform(0.5, 3.0)) * depth * sign
        yield pr.Step("roll", move={"tool": pr.Motion(x=x, rz=-x / tool.radius)}, increments=increments)
    elif motion == "turn":
        most = 0.5 * depth / width if flat else 0.05
        yield pr.Step("turn", move={"tool": pr.Motion(rz=float(rng.uniform(-most, most)))}, increments=increments)
    elif motion == "release":
        yield pr.Step("release", move={"tool": pr.Motion(y=0.2 * depth)}, increments=increments)


def tool_force(system: Any, inc: Increment) -> float:
    """Size of the force on the tool; in axisymmetry along the axis."""
    f = inc.force("tool")
    return abs(f.y) if system.axisymmetric else float(np.hypot(f.x, f.y))


def unbalanced(system: Any, inc: Increment) -> float:
    """What the forces are out of balance by, as a force."""
    from prensa.verify.balance import imbalance

    return max(imbalance(system, inc)) * tool_force(system, inc)


def check(system: Any, inc: Increment) -> str:
    """What is wrong with an increment besides the balance of forces, in words; '' if nothing is."""
    for s in system.surfaces:
        c = inc.contacts[s.name].points
        h = s.points.depth
        if (c.pressure < 0).any():
            return "negative pressure"
        open_ = (c.pressure == 0) & np.isfinite(c.gap)
        if (c.gap[open_] < -1e-9 * h[open_]).any():
            return "an open point lies inside the tool"
        # the gap of a closed point is zero to round-off in the exact form, within the tolerance in the augmented one
        slack = s.description.enforcement.slack * h
        closed = c.pressure > 0
        if (closed & (c.gap > slack)).any():
            return "pressure across an open gap"
        if s.exact and (closed & (c.gap < -slack)).any():
            return "penetration in spite of exact enforcement"
        law = s.description.friction
        if law is None:
            bound = np.zeros_like(c.pressure)
        elif law.type == "shear":
            # the traction at the points: in plane stress its area has the thickness of the start of the increment. k only
            # grows: that of the state reached bounds that of the start
            k = np.full(len(s.points), law.k) if law.k is not None else system.shear_strength(s, inc.state)
            t, p = np.abs(inc.state.lam[s.rows, 1]), inc.state.lam[s.rows, 0]
            if (t > law.m * k * (p > 0) * (1 + 1e-9)).any():
                return "friction above its bound"
            continue
        else:
            bound = law.bound(c.pressure, c.slip, At())[0]
        if (np.abs(c.shear) > bound + 1e-9 * max(float(bound.max()), 1e-300)).any():
            return "friction above its bound"
    for key in ("plastic", "friction"):
        if inc.energy[key] < -1e-9 * max(abs(inc.energy["external"]), 1e-300):
            return f"{key} dissipation {inc.energy[key]:.2e} is negative"
    for b in (
        inc.bodies.values() if system.problem.kinematics == "finite" else ()
    ):  # in small strain the shape is not updated
        x = b.x[b.cells]
        corners = 3 if x.shape[1] in (3, 6) else 4
        if x.shape[1] > corners:  # round the outline: corner, mid-side node, corner, …
            x = x[:, np.arange(2 * corners).reshape(2, corners).T.ravel()]
        y = np.roll(x, -1, axis=1)
        if ((x[..., 0] * y[..., 1] - x[..., 1] * y[..., 0]).sum(axis=1) <= 0).any():
            return "an element has no volume"
    return ""


def solve_checked(p: pr.Problem) -> tuple[float, int, int, str]:
    """Largest tool force over the history, iterations, cut-backs, and what is wrong ('' if nothing)."""
    system = discretise(p)
    peak, iterations, cutbacks = 0.0, 0, 0
    early: list[tuple[float, float]] = []
    for inc in pr.solve(system):
        iterations += inc.statistics.iterations
        cutbacks += inc.statistics.cutbacks
        peak = max(peak, tool_force(system, inc))
        # after unloading there is little force left to compare with: the peak so far is the reference
        if not (error := unbalanced(system, inc)) <= BALANCE * max(peak, 1e-300):
            early.append((error, inc.time))
        wrong = check(system, inc)
        if wrong:
            return peak, iterations, cutbacks, f"time {inc.time:.4g}: {wrong}"
    # the same holds before contact is established: round-off there is judged against the peak of the whole history
    for error, at in early:
        if not error <= 0.1 * BALANCE * peak:
            return (
                peak,
                iterations,
                cutbacks,
                f"time {at:.4g}: forces out of balance by {error / peak:.1e} of the largest",
            )
    return peak, iterations, cutbacks, ""


def finer(p: pr.Problem, factor: int = 2) -> pr.Problem:
    """The same problem at 1/``factor`` of the step and ten times the penalty (the default one for other enforcements)."""
    steps = tuple(replace(s, increments=factor * (s.increments or 40)) for s in p.steps)
    now = [c.enforcement if isinstance(c.enforcement, pr.Penalty) else pr.Penalty() for c in p.contacts]
    stiff = [pr.Penalty(beta=10 * e.beta, beta_T=10 * e.beta_T) for e in now]
    contacts = tuple(replace(c, enforcement=e) for c, e in zip(p.contacts, stiff))
    return replace(p, steps=steps, contacts=contacts)


ENFORCEMENTS = {"penalty": pr.Penalty(), "augmented": pr.Augmented(), "exact": pr.Exact()}


def enforced(p: pr.Problem, enforcement: str) -> pr.Problem:
    """The problem with all its contacts enforced in one of the forms of `ENFORCEMENTS`."""
    return replace(p, contacts=tuple(replace(c, enforcement=ENFORCEMENTS[enforcement]) for c in p.contacts))


def judge(p: pr.Problem, number: int, compare: bool) -> Outcome:
    """Solve and check one problem; ``compare``: also against half the step and ten times the penalty.

    Steps are too large on purpose, so that the two may differ by the error of the first. Then a third run, at a quarter of
    the step, decides: a sequence that closes in on something is a coarse answer, one that does not is a wrong one.
    """
    start = time.process_time()
    try:
        peak, iterations, cutbacks, wrong = solve_checked(p)
    except PrensaError as error:
        return Outcome(number, p.name, "failed", str(error), seconds=time.process_time() - start)
    status, words = ("wrong" if wrong else "right"), wrong
    if compare and not wrong:
        try:
            again, _, _, worse = solve_checked(finer(p))
            if worse:
                status, words = "wrong", f"at half the step and ten times the penalty: {worse}"
            elif abs(again - peak) > AGREE * max(again, peak):
                last, _, _, _ = solve_checked(finer(p, 4))
                words = f"peak force {peak:.4g}, at half the step and ten times the penalty {again:.4g}, at a quarter {last:.4g}"
                if abs(last - again) > CONVERGING * abs(again - peak):
                    status = "wrong"
        except PrensaError as error:
            words = f"(the finer run used for comparison failed: {error})"
    return Outcome(number, p.name, status, words, iterations, cutbacks, time.process_time() - start)


def commit_seed(folder: Path | None = None) -> tuple[int, str]:
    """The commit that is measured and the seed taken from its hash: nobody chose the problems.

    Raises
    ------
    PrensaError
        Where the package does not run from a git checkout.

    """
    import subprocess

    where = folder or Path(__file__).parent
    try:
        out = subprocess.run(["git", "-C", str(where), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise PrensaError("--seed commit needs prensa to run from a git checkout; give a number instead") from None
    return int(out.stdout[:8], 16), out.stdout.strip()[:12]


def write(path: Path, tallies: list[Tally], commit: str = "") -> None:
    """Write the outcomes of several suites: every one to a ``.csv`` file, the shares and the failures to a Markdown page."""
    if path.suffix == ".md":
        path.write_text(_page(tallies, commit), encoding="utf-8")
        return
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(["suite", "seed", "number", "kind", "status", "iterations", "cutbacks", "seconds", "words"])
        for t in tallies:
            for o in t.outcomes:
                out.writerow(
                    [t.suite, t.seed, o.number, o.kind, o.status, o.iterations, o.cutbacks, f"{o.seconds:.2f}", o.words]
                )


def _page(tallies: list[Tally], commit: str) -> str:
    """The published table: shares, cost, and every problem that was not answered rightly, with its post-mortem."""
    lines = [
        "# Random problems on default settings", "",
        f"Made by `prensa bench robustness --seed {'commit' if commit else tallies[0].seed} --report`"
        + (f" at commit {commit}; the seed is the beginning of its hash." if commit else "."), "",
        "| suite | seed | problems | right | given up | wrong | iterations | cut-backs | seconds each |",
        "|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for t in tallies:
        n = max(len(t.outcomes), 1)
        mean = [sum(getattr(o, k) for o in t.outcomes) / n for k in ("iterations", "cutbacks", "seconds")]
        shares = " | ".join(f"{t.share(s):.1%}" for s in ("right", "failed", "wrong"))
        lines.append(
            f"| {t.suite} | {t.seed} | {len(t.outcomes)} | {shares} | {mean[0]:.0f} | {mean[1]:.1f} | {mean[2]:.1f} |"
        )
    lines += ["", f"Every {RERUN_EVERY}th problem is run again at half the step and ten times the penalty.", ""]
    kinds = Counter((t.suite, _kind(o.words)) for t in tallies for o in t.outcomes if o.status != "right")
    if kinds:
        lines += ["| suite | kind of failure | problems |", "|---|---|---|"]
        lines += [f"| {suite} | {kind} | {count} |" for (suite, kind), count in kinds.most_common()]
        lines.append("")
    for title, status in (("Wrong", "wrong"), ("Given up, with what was said", "failed"), ("Coarse", "right")):
        found = [(t, o) for t in tallies for o in t.outcomes if o.status == status and o.words]
        if found:
            lines += [f"## {title}", "", *(f"- {t.suite} {o.kind}: {o.words}" for t, o in found), ""]
    return "\n".join(lines)


def _kind(words: str) -> str:
    """What a failure has in common with others: its reason without numbers and names."""
    reason = re.sub(r"^step '.*?', time [^:]*: |^time [^:]*: ", "", words).partition(";")[0]
    return re.sub(r" of body|'[^']*' ?", "", re.sub(r" (at|by) \d\S*| ?\([^)]*\)| \d+\b", "", reason))


def run(
    suite: str, count: int, seed: int, report: Callable[[Outcome], None] = lambda _: None, first: int = 0,
    enforcement: str = "penalty",
) -> Tally:  # fmt: skip
    """Draw and judge *count* problems, beginning with number *first*; ``enforcement``: one of `ENFORCEMENTS`."""
    tally = Tally(suite, seed)
    for number in range(first, first + count):
        outcome = judge(enforced(draw(suite, seed, number), enforcement), number, number % RERUN_EVERY == 0)
        tally.outcomes.append(outcome)
        report(outcome)
    return tally
