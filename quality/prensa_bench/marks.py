"""Random problems of kinds that were once wrong without a word, held against finer meshes, exact contact, or statics.

*Bending*: clamped strips of one to eight elements across, and plates between planes down to half their height, against elements
a quarter or half as long. *Confined*: bonded layers of rubber under a plate, whose force is that of exact contact. *Moved*:
bodies whose support a later step moves, by a way, to a place, along a table, as a feed, straight or turned; the load does not
change, so nor does what the support carries. *Free*: idle pulleys, boxes between forces, pushed tools, bodies between tools, bars
on supports, with and without one that they need; what they carry or how they shorten is known, where they are held. Right is a
force within a share of the reference; else the run has to name the cause. A finer mesh that is itself warned of is no reference,
if there is one that is finer yet. A right answer that is warned of is a false alarm, unless all that is said is the share of the
force that penalties take, and exact contact on the same mesh shows that they take more than the default may: that warning is due
whatever the error of the mesh, which may be of the other sign.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import prensa as pr
from prensa.checks.after.quality import GIVE_WAY
from prensa.checks.before.preflight import preflight
from prensa.errors import PrensaError
from prensa.result.increment import Increment
from prensa.verify.table import heard
from prensa_bench.robustness.increments import enforced

Measure = Callable[[Increment], float]

EXACT_SHARE = 0.01
"""Share of the force of exact contact on the same mesh that the default may lack without a warning."""


class Mark(NamedTuple):
    """A ``problem``, ``better`` ones, each better than the last, or none where the answer is ``known``, and what to ``measure``.

    ``share``: the one allowed.
    """

    problem: pr.Problem
    better: tuple[pr.Problem, ...]
    measure: Measure
    share: float
    known: float = np.nan


def draw(kind: str, seed: int, number: int) -> Mark:
    """Problem *number* of a kind (a key of `MARKS`): the same for the same arguments."""
    return MARKS[kind](np.random.default_rng([seed, number]))


def _strip(rng: np.random.Generator) -> Mark:
    """A clamped strip, moved at a corner of its end: a side held straight would be clamped by what its nodes are apart."""
    layers, length = int(rng.integers(1, 9)), float(rng.uniform(10.0, 60.0))
    aspect, way = float(rng.uniform(1.0, 4.0)), float(rng.uniform(0.005, 0.05)) * length
    along = max(round(length * layers / aspect), 4)
    space = str(rng.choice(["plane strain", "plane stress"]))
    plastic = bool(rng.random() < 0.3)
    solid = pr.J2(2e5, 0.3, pr.Linear(300.0, 1000.0)) if plastic else pr.Elastic(2e5, float(rng.uniform(0.0, 0.45)))

    def problem(finer: int) -> pr.Problem:
        mesh = pr.Rectangle((length, 1.0), n=(along * finer, layers * finer))
        steps = [pr.Step("bend", fixed={"strip.bottom-right": pr.Fixed(y=-way)}, increments=8)]
        return pr.Problem("strip", bodies={"strip": pr.Body(mesh, solid)}, fixed={"strip.left": "xy"}, steps=steps, space=space)

    return Mark(problem(1), (problem(4),), lambda inc: float(inc.supports["strip.bottom-right"].y), 0.05)


def _plate(rng: np.random.Generator) -> Mark:
    """A plate between two planes, down to half its height."""
    high, wide, mu = int(rng.integers(1, 9)), float(rng.uniform(4.0, 12.0)), float(rng.choice([0.0, 0.1, 0.3]))
    along = max(round(wide * high / float(rng.uniform(1.0, 3.0))), 4)
    plastic = bool(rng.random() < 0.5)
    solid = pr.J2(7e4, 0.33, pr.Linear(100.0, 200.0)) if plastic else pr.NeoHooke(10.0, float(rng.uniform(0.0, 0.45)))

    def problem(finer: int) -> pr.Problem:
        mesh = pr.Rectangle((wide, 1.0), n=(along * finer, high * finer))
        return pr.Problem(
            "plate", bodies={"plate": pr.Body(mesh, solid)}, tools={"top": pr.Plane(touching="plate.top")},
            friction=pr.Coulomb(mu), fixed={"plate.bottom": "y", "plate.left": "x"},
            steps=[pr.Step("press", move={"top": pr.Motion(y=-0.5)})],
        )  # fmt: skip

    return Mark(problem(1), (problem(2),), lambda inc: float(inc.force("top").y), 0.05)


def _bending(rng: np.random.Generator) -> Mark:
    return _strip(rng) if rng.random() < 0.7 else _plate(rng)


def _confined(rng: np.random.Generator) -> Mark:
    """A layer bonded below under a plate that grips it."""
    nu, aspect = 0.5 - float(np.exp(rng.uniform(np.log(1e-4), np.log(0.2)))), float(np.exp(rng.uniform(0.0, np.log(50.0))))
    layers, depth = int(rng.integers(2, 7)), float(rng.uniform(0.002, 0.02))
    along = max(round(aspect * layers / float(rng.uniform(1.0, 4.0))), 2)
    solid = pr.NeoHooke(3.0, nu) if rng.random() < 0.5 else pr.Elastic(3.0, nu)

    def problem(enforcement: pr.Penalty | pr.Exact) -> pr.Problem:
        mesh = pr.Rectangle((aspect, 1.0), n=(along, layers))
        return pr.Problem(
            "layer", bodies={"layer": pr.Body(mesh, solid, "q4_fbar")}, tools={"plate": pr.Plane(touching="layer.top")},
            contacts=(pr.Contact("layer.top", "plate", pr.Coulomb(2.0), enforcement),),
            fixed={"layer.bottom": "xy", "layer.left": "x"},
            steps=[pr.Step("press", move={"plate": pr.Motion(y=-depth)}, increments=2)],
        )  # fmt: skip

    return Mark(problem(pr.Penalty()), (problem(pr.Exact()),), lambda inc: float(inc.force("plate").y), 0.01)


def _moved(rng: np.random.Generator) -> Mark:
    """A bar loaded at one end, while the other is held, and then drawn away."""
    turn = float(rng.choice([0.0, rng.uniform(-0.7, 0.7)]))
    c, s = np.cos(turn), np.sin(turn)
    corners = tuple((float(c * x - s * y), float(s * x + c * y)) for x, y in ((0, 0), (40, 0), (40, 10), (0, 10)))
    mesh = pr.Patch(corners=corners, n=(int(rng.integers(4, 21)), int(rng.integers(2, 5))))
    pull, way = float(rng.uniform(1.0, 20.0)), float(rng.uniform(-5.0, 5.0))
    element = str(rng.choice(["q4", "q4_fbar", "q4_enhanced", "t6"]))
    kind = str(rng.choice(["by", "to", "table", "feed"])) if turn == 0.0 else str(rng.choice(["by", "to", "table"]))
    x, y = (way * float(c), way * float(s)) if turn else (way, None)
    tables = (((1.0, 0.0), (1.4, x), (2.0, x)), None if y is None else ((1.0, 0.0), (2.0, y)))
    motion: dict[str, Any] = {
        "by": {"by": {"bar.left": pr.Motion(x=x, y=y)}},
        "to": {"fixed": {"bar.left": pr.Fixed(x=x, y=y)}},
        "table": {"fixed": {"bar.left": pr.Fixed(x=tables[0], y=tables[1])}},
        "feed": {"feed": {"bar.left": pr.Feed(x=x)}},
    }[kind]
    steps = [
        pr.Step("load", loads={"bar.right": pr.Load(traction=(pull * float(c), pull * float(s)))}, increments=2),
        pr.Step("draw", increments=3, **motion),
    ]
    held = {"bar.left": "xy"} if turn else {"bar.left": "x", "bar.bottom-left": "y"}
    problem = pr.Problem("bar", bodies={"bar": pr.Body(mesh, pr.Elastic(2000.0, 0.3), element)}, fixed=held, steps=steps)

    def carried(inc: Increment) -> float:
        """Against the load."""
        force = inc.supports["bar.left"]
        return -float(c * force.x + s * force.y) if turn else -float(force.x)

    return Mark(problem, (), carried, 0.01, 10.0 * pull)


INTO_BOX = {"left": ("x", 1.0), "right": ("x", -1.0), "bottom": ("y", 1.0), "top": ("y", -1.0)}
"""Axis and sign of the way into a box from each of its sides."""
ACROSS_FROM = {"left": "right", "right": "left", "bottom": "top", "top": "bottom"}


def _free(rng: np.random.Generator) -> Mark:
    kinds = (_pulley, _box_between_forces, _pushed_tool, _between_tools, _bar_on_supports)
    return kinds[int(rng.integers(len(kinds)))](rng)


def _pulley(rng: np.random.Generator) -> Mark:
    """A belt over an idle pulley, tightened and drawn; or pulled at both ends alike: nothing keeps it from going round."""
    n, mu, pull = int(rng.integers(20, 101)), float(rng.uniform(0.05, 1.0)), float(rng.uniform(0.2, 5.0))
    radius, held = float(rng.uniform(20.0, 200.0)), bool(rng.random() < 0.7)
    mesh = pr.Annulus(radius, radius + 1.0, (n, int(rng.integers(1, 3))), angles=(0.0, 0.5 * np.pi))
    idle, loads = {"drum": pr.Push(m=0.0)}, {"belt.start": pr.Load(traction=(0.0, -pull))}
    steps = [pr.Step("tighten", push=idle, loads=loads if held else loads | {"belt.end": pr.Load(traction=(-pull, 0.0))})]
    if held:
        steps.append(pr.Step("draw", push=idle, fixed={"belt.end": pr.Fixed(x=-0.002 * radius)}, increments=4))
    problem = pr.Problem(
        "belt", bodies={"belt": pr.Body(mesh, pr.Elastic(500.0, 0.3), "q4_enhanced")},
        tools={"drum": pr.Circle(radius=radius, at=(0.0, 0.0))}, contacts=(pr.Contact("belt.inner", "drum"),),
        friction=pr.Coulomb(mu), fixed={"belt.end": "x"} if held else {}, steps=steps,
    )  # fmt: skip
    # both ends pull alike, where nothing turns the drum; of so soft a belt the held end turns with less than 1 % of the moment
    return Mark(problem, (), lambda inc: -float(inc.force("drum").x), 0.01, pull)


def _box(rng: np.random.Generator, tools: tuple[str, ...], mu: float | None, nu: float = 0.3, **keys: Any) -> pr.Problem:
    """A box of 4 × 3 with planes on some of its sides, each touching it."""
    mesh = pr.Rectangle((4.0, 3.0), n=(int(rng.integers(2, 7)), int(rng.integers(2, 6))))
    element = str(rng.choice(["q4", "q4_fbar", "q4_enhanced", "t6"]))
    return pr.Problem(
        "box", bodies={"box": pr.Body(mesh, pr.Elastic(1000.0, nu), element)},
        tools={side: pr.Plane(touching=f"box.{side}") for side in tools},
        friction=None if mu is None else pr.Coulomb(mu), **keys,
    )  # fmt: skip


def _box_between_forces(rng: np.random.Generator) -> Mark:
    """Two planes pushed at each other, in the middle a line that is held along them or not; how near they come."""
    side = str(rng.choice(list(INTO_BOX)))
    (axis, sign), other, force = INTO_BOX[side], ACROSS_FROM[side], float(rng.uniform(0.3, 3.0))
    across, held = ("y", "x")[axis == "y"], bool(rng.random() < 0.5)
    long, wide = (4.0, 3.0) if axis == "x" else (3.0, 4.0)
    fixed = {"box.bottom" if across == "y" else "box.left": across} | ({"box.bottom-left": "xy"} if held else {})
    step = pr.Step("press", push={side: {axis: sign * force}, other: {axis: -sign * force}}, increments=2)
    problem = _box(rng, (side, other), None, fixed=fixed, steps=[step])

    def nearer(inc: Increment) -> float:
        a, b = (getattr(inc.tools[tool].place, axis) for tool in (side, other))
        return sign * float(a - b)

    # plane strain
    return Mark(problem, (), nearer, 0.01, force / wide * long * (1.0 - 0.3**2) / 1000.0)


def _pushed_tool(rng: np.random.Generator) -> Mark:
    """A plane pushed at a box that stands on a support, on another tool, or on nothing; with a gap or without."""
    side, force = str(rng.choice(list(INTO_BOX))), float(rng.uniform(0.3, 3.0))
    (axis, sign), other = INTO_BOX[side], ACROSS_FROM[side]
    across, behind = ("y", "x")[axis == "y"], str(rng.choice(["support", "tool", "nothing"]))
    fixed = {"box.bottom" if across == "y" else "box.left": across}
    fixed |= {f"box.{other}": axis} if behind == "support" else {}
    tools = (side, other) if behind == "tool" else (side,)
    kept = {other: {axis: 0.0}} if behind == "tool" else {}
    step = pr.Step("press", push={side: {axis: sign * force}}, move=kept, increments=2)
    problem = _box(rng, tools, None, fixed=fixed, steps=[step])

    def carried(inc: Increment) -> float:
        """By what stands behind."""
        force = inc.force(other) if behind == "tool" else inc.supports.get(f"box.{other}")
        return abs(float(getattr(force, axis))) if force is not None else np.nan

    return Mark(problem, (), carried, 0.01, force)


def _between_tools(rng: np.random.Generator) -> Mark:
    """A box between two planes, one of which goes towards the other; across, supports, friction or nothing holds it."""
    side, by = str(rng.choice(list(INTO_BOX))), str(rng.choice(["support", "friction", "nothing"]))
    (axis, sign), other, way = INTO_BOX[side], ACROSS_FROM[side], float(rng.uniform(0.001, 0.005))
    across = ("y", "x")[axis == "y"]
    long, wide = (4.0, 3.0) if axis == "x" else (3.0, 4.0)
    fixed = {"box.bottom" if across == "y" else "box.left": across} if by == "support" else {}
    step = pr.Step("press", move={side: {axis: sign * way}, other: {axis: 0.0}}, increments=2)
    mu = float(rng.uniform(0.1, 0.5)) if by == "friction" else None
    problem = _box(rng, (side, other), mu, 0.0, fixed=fixed, steps=[step])
    return Mark(problem, (), lambda inc: abs(float(getattr(inc.force(other), axis))), 0.01, 1000.0 * way / long * wide)


def _bar_on_supports(rng: np.random.Generator) -> Mark:
    """A bar pulled at one end, on some of the supports that it needs, straight or turned; what all of them carry."""
    turn, pull = float(rng.choice([0.0, rng.uniform(-0.7, 0.7)])), float(rng.uniform(1.0, 20.0))
    c, s = float(np.cos(turn)), float(np.sin(turn))
    corners = tuple((c * x - s * y, s * x + c * y) for x, y in ((0, 0), (40, 0), (40, 10), (0, 10)))
    mesh = pr.Patch(corners=corners, n=(int(rng.integers(4, 21)), int(rng.integers(2, 5))))
    offered = [("bar.left", "x"), ("bar.left", "y"), ("bar.bottom-left", "x"), ("bar.bottom-left", "y"), ("bar.top-left", "x"),
               ("bar.bottom-right", "y")]  # fmt: skip
    taken: dict[str, Any] = {}
    for k in rng.permutation(len(offered))[: int(rng.integers(1, 4))].tolist():
        name, axis = offered[k]
        taken[name] = "xy" if name in taken else axis
    load = {"bar.right": pr.Load(traction=(pull * c, pull * s))}
    problem = pr.Problem(
        "bar", bodies={"bar": pr.Body(mesh, pr.Elastic(1e5, 0.3))}, fixed=taken, steps=[pr.Step("pull", loads=load, increments=2)]
    )

    def carried(inc: Increment) -> float:
        """Against the load."""
        return -sum(c * float(force.x) + s * float(force.y) for force in inc.supports.values())

    return Mark(problem, (), carried, 0.01, 10.0 * pull)


MARKS: dict[str, Callable[[np.random.Generator], Mark]] = {
    "bending": _bending, "confined": _confined, "moved": _moved, "free": _free,
}  # fmt: skip


def answer(problem: pr.Problem, measure: Measure) -> tuple[float, list[str]]:
    """The measure at the end of a run, none where it failed, and what was said of it, in ``check`` too."""
    value = np.nan
    with heard() as said:
        try:
            said += [str(finding) for finding in preflight(pr.discretise(problem)) if not finding.seen_in_run]
            *_, last = pr.solve(problem)
            value = measure(last)
        except PrensaError as error:
            said.append(str(error))
    return value, said


def verdict(mark: Mark) -> tuple[str, float, list[str]]:
    """Of what stands in `MARK_VERDICTS`, the error, what was said; 'none' without a reference."""
    value, said = answer(mark.problem, mark.measure)
    reference = _reference(mark)
    if np.isnan(reference):
        return "none", np.nan, said
    error = value / reference - 1.0
    if not abs(error) <= mark.share:
        return ("reported" if said else "silent"), error, said
    if not said:
        return "right", error, said
    return ("share" if all(GIVE_WAY in words for words in said) and penalties_show(mark, value) else "alarm"), error, said


def _reference(mark: Mark) -> float:
    """The answer that is right: of the first better problem of which nothing is said, or of the last one that has an answer."""
    reference = mark.known
    for problem in mark.better:
        value, said = answer(problem, mark.measure)
        reference = reference if np.isnan(value) else value
        if not said:
            break
    return reference


MARK_VERDICTS = {
    "right": "within the share allowed, and silent",
    "share": "right, and warned only of a share that the penalties take, which exact contact on the same mesh confirms",
    "alarm": "right, and warned of: by mistake",
    "reported": "not right, and warned of or refused",
    "silent": "not right, in silence",
}


def penalties_show(mark: Mark, value: float) -> bool:
    """Whether a ``value`` is too low for exact contact on the same mesh, by more than that of the default may be."""
    exact = answer(enforced(mark.problem, "exact"), mark.measure)[0]
    return bool(value / exact < 1.0 - EXACT_SHARE)
