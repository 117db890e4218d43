"""Linear elastic bodies are factored once: the condensed history is that of the whole system, in every bit reproducible."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import prensa as pr
from prensa.errors import CaseError, PrensaError
from prensa.linear import condensation, factorisations
from prensa.linear.reduction import Reduced
from prensa.model.schema import loads
from prensa.output.checkpoint import read_checkpoint, write_checkpoint
from prensa.policy import DEFAULT, Policy
from prensa.system.discretise import discretise
from prensa.system.planning import plan_step
from states import same

ELASTIC = pr.Elastic(E=1000.0, nu=0.3)
WHOLE, CONDENSED = pr.Numerics(condense=False), pr.Numerics(condense=True)
SAME = 1e-9
# contact of these small bodies grows out of the columns made at once, and what convergence leaves does not count at SAME
NARROW = Policy(columns_at_once=8, fine_residual=1e-13)


def block(n=(12, 6), size=(2.0, 1.0), origin=(0.0, 0.0), **more) -> pr.Body:
    return pr.Body(pr.Rectangle(size=size, n=n, origin=origin), ELASTIC, **more)


def pressed(space="plane strain", *, steps=None, **more) -> pr.Problem:
    """A cylinder pressed into a block and then moved along it (axisymmetric: lifted)."""
    along = pr.Motion(y=-0.03) if space == "axisymmetric" else pr.Motion(x=0.03)
    steps = steps or (
        pr.Step("press", move={"t": pr.Motion(y=-0.06)}, increments=4),
        pr.Step("slide", move={"t": along}, increments=3),
    )
    given = {
        "space": space, "kinematics": "small", "bodies": {"b": block()}, "steps": steps, "fixed": {"b.bottom": "xy"},
        "tools": {"t": pr.Circle(radius=2.0, touching="b.top")},
        "contacts": (pr.Contact("b.top", "t", friction=pr.Coulomb(0.3)),),
        "allow_large_strain": more.get("kinematics") != "finite",
    }  # fmt: skip
    return pr.Problem("pressed", **given | more)


def solved(problem, numerics, start=None) -> list:
    return list(pr.solve(discretise(problem), numerics, start=start, policy=NARROW))


def differences(problem: pr.Problem) -> dict[str, float]:
    """The largest difference of every kind of result between the whole and the condensed system, over its largest value."""
    whole, small = (solved(problem, n) for n in (WHOLE, CONDENSED))
    assert [i.time for i in whole] == [i.time for i in small]
    seen: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}

    def pair(kind: str, a, b) -> None:
        seen.setdefault(kind, []).append((np.asarray(a, dtype=float), np.asarray(b, dtype=float)))

    for a, b in zip(whole, small):
        for name in a.tools:
            pair("force", a.tools[name].force, b.tools[name].force)
            pair("place", a.tools[name].place, b.tools[name].place)
            if a.tools[name].spring is not None:
                pair("force", a.tools[name].spring, b.tools[name].spring)
        for name in a.supports:
            pair("force", a.supports[name], b.supports[name])
        pair("energy", list(a.energy.values()), list(b.energy.values()))
        pair("unknowns", a.state.u, b.state.u)
        pair("work", a.state.work, b.state.work)
        for k, (x, y) in enumerate(zip(a.state.history, b.state.history, strict=True)):
            pair(f"history {k}", x, y)
        for name in a.contacts:
            for what in ("pressure", "shear", "pressure_from_stress", "force"):
                pair(f"{what} of {name}", getattr(a.contacts[name], what), getattr(b.contacts[name], what))
            pair(f"slip of {name}", a.contacts[name].slip, b.contacts[name].slip)
            assert np.array_equal(a.contacts[name].status, b.contacts[name].status)
        for name in a.bodies:
            pair("stress", a.bodies[name].stress, b.bodies[name].stress)
            pair("reaction", a.bodies[name].reaction, b.bodies[name].reaction)
    size = {k: max(np.abs(a).max(initial=0.0) for a, _ in v) for k, v in seen.items()}
    for k in size:
        if k.startswith("shear"):  # a traction beside the pressure that it belongs to
            size[k] = max(size[k], size["pressure" + k[5:]])
        if k.startswith("slip"):
            size[k] = size["unknowns"]
    return {k: max(float(np.abs(a - b).max(initial=0.0)) for a, b in v) / max(size[k], 1e-300) for k, v in seen.items()}


def assert_same(problem: pr.Problem) -> None:
    found = differences(problem)
    assert max(found.values()) <= SAME, {k: v for k, v in found.items() if v > SAME}


# ---------------------------------------------------------------------------------------------------------- same results
SPACES = ("plane strain", "plane stress", "axisymmetric")
ENFORCEMENT = (pr.Penalty(), pr.Augmented(), pr.Exact())
FRICTION = (None, pr.Coulomb(0.3), pr.Coulomb(pr.MuExponential(0.4, 0.2, 0.05)), pr.Shear(0.4, k=20.0))


@pytest.mark.parametrize("geometry", ["reference", "current"])
@pytest.mark.parametrize(
    ("space", "enforcement", "friction"),
    [*product(SPACES, ENFORCEMENT, FRICTION[:2]), *product(SPACES[:1], ENFORCEMENT[:1], FRICTION[2:])],
)
def test_the_condensed_history_is_the_whole_one(space, geometry, enforcement, friction):
    """Forces, energies, contact, displacements, stresses and reactions agree to 1e-9 in every increment."""
    contact = pr.Contact("b.top", "t", friction=friction, enforcement=enforcement)
    assert_same(pressed(space, contact_geometry=geometry, contacts=(contact,)))


CONTROLS = {
    "force": {"steps": (
        pr.Step("press", push={"t": pr.Push(y=-30.0)}, increments=4),
        pr.Step("slide", move={"t": pr.Motion(x=0.03)}, increments=3),
    )},
    "spring": {
        "tools": {"t": pr.Circle(radius=2.0, touching="b.top", spring=pr.Springs(x=300.0, y=500.0))},
        "steps": (
            pr.Step("press", move={"t": pr.Motion(y=-0.1)}, increments=4),
            pr.Step("slide", move={"t": pr.Motion(x=0.05)}, increments=3),
        ),
    },
    "moment": {
        "tools": {"t": pr.Stamp(width=1.0, fillet=0.2, touching="b.top", at=(1.0, 1.0))},
        "steps": (
            pr.Step("press", push={"t": pr.Push(y=-20.0)}, increments=3),
            pr.Step("turn", push={"t": pr.Push(y=-20.0, m=1.0)}, increments=3),
        ),
    },
    "flush": {"tools": {"t": pr.Plane(touching="b.top")}},
}  # fmt: skip


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()])
def test_tools_may_be_led_pushed_turned_or_mounted(control, enforcement):
    """Unknowns of tools stay in the small system."""
    contact = pr.Contact("b.top", "t", friction=pr.Coulomb(0.3), enforcement=enforcement)
    assert_same(pressed(**{"contacts": (contact,)} | CONTROLS[control]))


@pytest.mark.parametrize(
    ("element", "rule"),
    [
        *((e, "nodal") for e in ("q4", "q4_fbar", "q4_bbar", "q4_enhanced", "q4_sheet", "q8", "q8_full", "t3", "t6")),
        *(("q4", r) for r in ("gauss1", "gauss2", "simpson", "kikuchi")),
    ],
)
def test_every_element_and_rule(element, rule):
    """Bodies are linear whatever they are made of, internal modes included; points may depend on several nodes."""
    body = block((8, 4) if element.startswith(("t", "q8")) else (12, 6), element=element)
    contact = pr.Contact("b.top", "t", friction=pr.Coulomb(0.3), integration=rule)
    assert_same(pressed(bodies={"b": body}, contacts=(contact,)))


@pytest.mark.parametrize("n", [(12, 4), (9, 4)])
def test_tied_bodies(n):
    """Ties, with matching meshes and without, whose ends lie on the contact surface."""
    bodies = {
        "b": block((6, 6), size=(1.0, 1.0)),
        "c": block((6, 6) if n[0] == 12 else (5, 5), size=(1.0, 1.0), origin=(1.0, 0.0)),
    }
    contacts = tuple(pr.Contact(f"{k}.top", "t", friction=pr.Coulomb(0.3)) for k in "bc")
    assert_same(
        pressed(
            bodies=bodies,
            ties=(pr.Tie("c.left", "b.right"),),
            contacts=contacts,
            fixed={"b.bottom": "xy", "c.bottom": "xy"},
            tools={"t": pr.Circle(radius=2.0, touching="b.top", at=(0.9, 3.0))},
            steps=(
                pr.Step("press", move={"t": pr.Motion(y=-0.08)}, increments=4),
                pr.Step("slide", move={"t": pr.Motion(x=0.1)}, increments=4),
            ),
        )
    )


def test_several_bodies_tools_and_changing_supports():
    """Each step has its own supports; a tool pressed against a side, another from above, a body that is released from a wall."""
    bodies = {"b": block(), "c": block(origin=(0.0, 3.0))}
    tools = {
        "t": pr.Circle(radius=2.0, touching="b.top"),
        "s": pr.Plane(touching="b.right"),
        "d": pr.Plane(touching="c.top"),
    }
    contacts = (
        pr.Contact(("b.top", "b.right"), "t", friction=pr.Coulomb(0.2)),
        pr.Contact("b.right", "s"),
        pr.Contact("c.top", "d", friction=pr.Coulomb(0.5)),
    )
    steps = (
        pr.Step("one", move={"t": pr.Motion(y=-0.05), "d": pr.Motion(y=-0.02)}, increments=3),
        pr.Step("two", move={"s": pr.Motion(x=-0.03)}, fixed={"b.left": "free", "b.bottom-left": "x"}, increments=3),
    )
    fixed = {"b.bottom": "y", "b.left": "x", "c.bottom": "xy"}
    apart = (pr.NoContact("c", "t"), pr.NoContact("c", "s"))  # the upper body is a world of its own
    assert_same(pressed(bodies=bodies, tools=tools, contacts=contacts, no_contact=apart, steps=steps, fixed=fixed))


def test_loads_weights_and_moving_supports():
    """What acts away from the contact reaches it, does work and is in the reactions."""
    assert_same(
        pressed(
            loads={"b.right": pr.Load(pressure=5.0)},
            body_force={"b": (2.0, -3.0)},
            steps=(
                pr.Step("press", move={"t": pr.Motion(y=-0.06)}, increments=3),
                pr.Step(
                    "pull",
                    fixed={"b.bottom": pr.Fixed(x=0.04, y=0.01)},
                    loads={"b.right": pr.Load(traction=(3.0, 1.0))},
                    increments=3,
                ),
            ),
        )
    )


@pytest.mark.parametrize("enforcement", ENFORCEMENT)
def test_contact_that_opens_again(enforcement):
    """Points that leave the contact take their multipliers and their columns with them, and come back."""
    steps = (
        pr.Step("press", move={"t": pr.Motion(y=-0.06)}, increments=3),
        pr.Step("lift", move={"t": pr.Motion(y=-0.005)}, increments=4),
        pr.Step("again", move={"t": pr.Motion(y=-0.05, x=0.4)}, increments=4),
    )
    contact = pr.Contact("b.top", "t", friction=pr.Coulomb(0.3), enforcement=enforcement)
    assert_same(pressed(bodies={"b": block((24, 6))}, contacts=(contact,), steps=steps))


def test_without_contact_there_is_nothing_to_iterate_on():
    """Loads alone: one factorisation, one substitution an increment."""
    steps = (pr.Step("load", loads={"b.top": pr.Load(pressure=5.0)}, increments=5),)
    assert_same(pressed(tools={}, contacts=(), steps=steps))


# ------------------------------------------------------------------------------------------------------------- exactness
def test_a_step_of_the_small_system_is_one_of_the_whole():
    """At a state in equilibrium away from contact both matrices give the same step, at contact and, recovered, inside."""
    problem = pressed()
    system = discretise(problem)
    *_, inc = solved(problem, CONDENSED)
    plan = plan_step(system, 1, inc.state.step_start)
    c = system.context(inc.state, plan, 2.0)
    whole = condensation.Condensation(system, plan, CONDENSED, NARROW)
    small = whole.on(frozenset(range(whole.needs.shape[1]))).reduced()
    e, full = small.assembly.evaluate(c, inc.state.u, inc.state.lam), system.evaluate(c, inc.state.u, inc.state.lam)
    reduced = Reduced.of(system, plan.fixed, WHOLE)
    b = np.zeros(system.ndof)
    b[whole.touched] = np.sin(np.arange(len(whole.touched)))
    a, x = small.solve(small.matrix(e, b), b), reduced.solve(reduced.matrix(full, b), b)
    assert np.abs((a - x)[whole.touched]).max() <= 1e-11 * np.abs(x).max()
    assert np.abs(e.r - full.r)[small.free].max() <= 1e-11 * e.scale
    applied = small.assembly.apply(e.data, x) - reduced.assembly.apply(full.data, x)
    assert np.abs(applied[small.free]).max() <= 1e-10 * np.abs(b).max()


class Counted:
    """Factorisations and columns of right-hand sides that a run asks of the solver."""

    def __init__(self, monkeypatch) -> None:
        self.factors = self.columns = 0
        for name, analyze in factorisations.BACKENDS.items():
            monkeypatch.setitem(factorisations.BACKENDS, name, self._wrapped(analyze))

    def _wrapped(self, analyze):
        def begin(structure):
            factor = analyze(structure)

            def factored(values):
                self.factors += 1
                solve = factor(values)

                def counted(b):
                    self.columns += b.shape[1] if b.ndim > 1 else 0
                    return solve(b)

                return counted

            return factored

        return begin


def test_one_factorisation_and_no_column_that_contact_does_not_reach(monkeypatch):
    """A history of many increments factors once; a narrow contact has few columns."""
    counted = Counted(monkeypatch)
    problem = pressed(steps=(pr.Step("press", move={"t": pr.Motion(y=-0.01)}, increments=6),))
    closed = max((i.contacts["b.top-t"].status > 0).sum() for i in solved(problem, CONDENSED))
    assert counted.factors == 1
    assert 0 < closed < 6 and 2 * closed <= counted.columns <= 2 * closed + 2 * 8 < 26


def test_displacements_are_recovered_only_where_somebody_looks(monkeypatch):
    """Once at the end of a step, though a tool goes deep beside a line of symmetry; once more for each increment looked at."""
    counted = []
    original = condensation.Bodies.solved

    def counting(self, b):
        counted.append(b.ndim)
        return original(self, b)

    monkeypatch.setattr(condensation.Bodies, "solved", counting)
    side = {"b.bottom": "y", "b.left": "x"}
    tool = {"t": pr.Circle(radius=2.0, at=(0.0, 3.0))}
    steps = (pr.Step("press", move={"t": pr.Motion(y=-0.2)}, increments=8),)
    problem = pressed(steps=steps, fixed=side, tools=tool, bodies={"b": block((24, 12))})
    increments = solved(problem, CONDENSED)
    assert counted.count(1) == 1
    element = 1.0 / 12
    assert -increments[-1].tools["t"].place.y > element
    increments[3].bodies, increments[3].bodies
    assert counted.count(1) == 2


def test_a_side_that_no_contact_names_is_found_within_a_step():
    """A pin comes from the side to nodes that contact does not touch: both ways tell the same node at the same time."""
    tools = {"t": pr.Circle(radius=2.0, touching="b.top"), "pin": pr.Circle(radius=0.2, at=(2.22, 0.5))}
    steps = (pr.Step("press", move={"t": pr.Motion(y=-0.05), "pin": pr.Motion(x=-0.12)}, increments=6),)
    messages = []
    for numerics in (WHOLE, CONDENSED):
        with pytest.raises(PrensaError, match=r"of 'b.right' .* inside tool 'pin'") as caught:
            solved(pressed(steps=steps, tools=tools), numerics)
        messages.append(str(caught.value))
    assert messages[0] == messages[1] and "time 0.333333" in messages[0]


@pytest.mark.parametrize("enforcement", ENFORCEMENT)
@pytest.mark.parametrize("drive", ["move", "push"])
def test_every_continuation_has_the_same_bits(enforcement, drive, tmp_path):
    """From any committed state, at hand or from a checkpoint, the rest of the run is the same although columns are not."""
    given = {"move": {"t": pr.Motion(y=-0.06)}} if drive == "move" else {"push": {"t": pr.Push(y=-30.0)}}
    problem = pressed(
        contacts=(pr.Contact("b.top", "t", friction=pr.Coulomb(0.3), enforcement=enforcement),),
        body_force={"b": (0.0, -2.0)},
        steps=(pr.Step("press", increments=4, **given), pr.Step("back", move={"t": pr.Motion(x=0.05, y=-0.01)}, increments=4)),
    )  # fmt: skip
    states = [i.state for i in solved(problem, CONDENSED)]
    for k in range(len(states) - 1):
        path = write_checkpoint(tmp_path / "checkpoint.h5", pr.Case(problem, CONDENSED), states[k])
        _, state = read_checkpoint(path)
        later = [i.state for i in solved(problem, CONDENSED, state)]
        assert len(later) == len(states) - k - 1 and all(map(same, later, states[k + 1 :]))


# -------------------------------------------------------------------------------------------------------------- when it is
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kinematics": "finite"}, "small strain"),
        (
            {"bodies": {"b": pr.Body(block().mesh, pr.J2(1000.0, 0.3, pr.Perfect(20.0)))}},
            "body 'b' is not linear elastic",
        ),
        ({"fixed": {"b.bottom": "y"}}, "leave body 'b' free to move along x in step 'press'"),
    ],
)
def test_what_cannot_be_condensed_is_refused_when_asked_for(change, words):
    """With the reason; left to itself the whole system is solved."""
    problem = pressed(**change)
    with pytest.raises(PrensaError, match=r"numerics\.condense: ") as error:
        solved(problem, CONDENSED)
    assert words in str(error.value)
    assert not condensation.to_be_condensed(discretise(problem), pr.Numerics())


def test_small_systems_and_single_increments_are_left_alone():
    """Condensation pays where factorisations cost much and are many."""
    large = pressed(bodies={"b": block((72, 40))})
    once = replace(large, steps=(pr.Step("press", move={"t": pr.Motion(y=-0.01)}, increments=1),))
    decided = [condensation.to_be_condensed(discretise(p), pr.Numerics()) for p in (pressed(), large, once)]
    assert decided == [False, True, False]


def test_what_contact_reaches_is_counted_and_not_all_that_could():
    """A short touch is condensed on a body whose surface has many nodes beyond; under a pushed tool all of them count."""
    touch = pr.Step("press", move={"t": pr.Motion(y=-0.02)}, increments=2)
    wide = pressed(bodies={"b": block((250, 10))}, steps=(touch,))
    system = discretise(wide)
    near = condensation.reached(system, DEFAULT)
    *_, last = pr.solve(system, WHOLE)
    closed = sum(int((c.pressure > 0).sum()) for c in last.contacts.values())
    assert closed <= near < 0.3 * len(system.surfaces[0].points.nodes)
    assert condensation.to_be_condensed(system, pr.Numerics())
    pushed = discretise(replace(wide, steps=(pr.Step("press", push={"t": pr.Push(y=-1.0)}, increments=2),)))
    assert condensation.reached(pushed, DEFAULT) == len(pushed.surfaces[0].points.nodes)


def test_the_words_of_the_option():
    """``condense`` is auto, true or false in a file; anything else is reported with its place."""
    text = (
        "name: t\nkinematics: small\nbodies: {b: {mesh: {type: rectangle, size: [2, 1], n: [2, 2]}, "
        "material: {type: elastic, E: 1, nu: 0}}}\nfixed: {b.bottom: xy}\nsteps: [{name: s}]\nnumerics: {condense: WORD}\n"
    )
    read = [loads(text.replace("WORD", w)).numerics.condense for w in ("auto", "true", "false")]
    assert read == ["auto", True, False]
    with pytest.raises(CaseError, match=r":6:22: unknown condense 'maybe'; write 'auto' or 'true' or 'false'"):
        loads(text.replace("WORD", "maybe"))
