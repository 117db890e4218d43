"""Equilibria that bodies would leave by themselves are found by their modes; beyond limit points viscous forces carry a body."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError, SolveError
from prensa.linear.reduction import Reduced
from prensa.output import run as running
from prensa.policy import Policy
from prensa.reference.buckling import elastica_clamped
from prensa.result.increment import Increment
from prensa.solver.equilibrium import Equilibrium, Reporter
from prensa.solver.other_equilibria import Drag, is_path_independent
from prensa.solver.softest_modes import softest_modes
from prensa.solver.stabilisation import Viscous, nodal_volumes
from prensa.solver.stability import JUMPED, looked
from prensa.system import failure
from prensa.system.discretise import discretise
from prensa.system.interaction import Request
from prensa.system.outcome import NewtonResult
from prensa.system.planning import plan_step
from prensa.system.state import Stability, State
from prensa.verify.buckling import COLUMN_LENGTH, SHORTENING, arch, column
from prensa_bench.robustness import drawn
from prensa_bench.slender import draw, verdict
from problems import single_block

POLICY = Policy()


def shallow_arch(push: float, stabilise: str | float = "off", move: float | None = None) -> pr.Problem:
    """A shallow arch clamped at its ends under a circle that is pushed, or moved."""
    way = {"move": {"p": pr.Motion(y=move)}} if move is not None else {"push": {"p": pr.Push(y=push)}}
    return replace(arch(pr.Step("push", **way)), stabilise=stabilise)


def test_modes_count_negative_eigenvalues():
    """On the straight path of a column beyond its buckling loads the count is that of the dense matrix, symmetric or not."""
    system = discretise(column(1.0, "q4_enhanced", 0.0, 20))
    plan = plan_step(system, 0, np.zeros(system.ndof))
    height = system.X[:, 1] / COLUMN_LENGTH
    for press, symmetric in itertools.product((0.001, 0.045, 0.09), (True, False)):
        u = np.zeros(system.ndof)
        system.displacement(u)[:, 1] = -press * SHORTENING * height
        c = system.context(system.initial(), plan, press)
        e = system.evaluate(c, u, system.initial().lam)
        reduced = Reduced.of(system, plan.fixed, pr.Numerics(), symmetric)
        matrix = reduced.matrix(e, -e.r)
        assert softest_modes(system, reduced, POLICY) is None  # nothing is factored yet
        reduced.solve(matrix, -e.r)
        structure = reduced.factorisation.structure  # type: ignore[attr-defined]
        from scipy.sparse import csc_matrix

        dense = csc_matrix((matrix, structure.indices, structure.indptr), (structure.n,) * 2).toarray()
        found = softest_modes(system, reduced, POLICY)
        assert found is not None
        exact = np.linalg.eigvalsh(0.5 * (dense + dense.T))
        assert found.negative == (exact < 0).sum() == (press > 0.04) + (press > 0.08), press
        # only symmetric factors tell it by themselves
        assert reduced.factorisation.positive == (symmetric and press < 0.04)


@pytest.mark.parametrize("stiffness", [lambda left: left, lambda left: np.sqrt(left)], ids=["buckling", "limit point"])
@pytest.mark.parametrize("third", [0.0, 0.9], ids=["the softest", "a stiffer one"])
def test_modes_that_rest_are_looked_at_before_one_turns(stiffness, third):
    """However a stiffness falls to zero at time 1, the last look before is near it, and few of the increments have one."""
    state = discretise(column(1.0, "q4", 0.0, 20)).initial()
    looks, dt = [], 0.004
    for number in range(1, round(1 / dt)):
        state = replace(state, dt_last=dt)
        result = NewtonResult(True, None, state.u, None, state.lam, 1)
        if number > 1 and state.stability.since < state.stability.rest:
            result.rested = True
        else:
            looks.append(number * dt)
            falling = stiffness(1.0 - number * dt) * (1.0 + third / (1.0 - third) if third else 1.0)
            result.softest = np.sort([falling, 1.0, 1.1])
        known, softest = looked(Stability(), state, result, POLICY)
        state = replace(state, stability=known, softest=softest)
    assert len(looks) < 0.45 / dt
    assert looks[-1] > 1.0 - 3.0 * dt
    gaps = np.diff(looks)
    assert gaps.max() > 7.0 * dt  # far away they rest
    assert (gaps <= 0.7 * (1.0 - np.array(looks[:-1])) + 1.5 * dt).all()  # and never for most of what is left


def test_a_bent_column_takes_its_own_branch_however_long_the_increments():
    """Increments of a tenth of a step would jump over the buckling load; the force after them is that of the elastica."""
    *_, last = pr.solve(column(1.0, "q8", 0.02, 10))
    reference = elastica_clamped(SHORTENING, E=1e5 / (1 - 0.3**2), length=COLUMN_LENGTH, thickness=1.0)
    assert -last.supports["b.top"].y == pytest.approx(reference, rel=0.03)


def test_a_straight_column_buckles_and_says_so(caplog):
    """Without an imperfection the run leaves the straight path where that is no longer stable, and warns."""
    *_, last = pr.solve(column(1.0, "q8", 0.0, 10))
    reference = elastica_clamped(SHORTENING, E=1e5 / (1 - 0.3**2), length=COLUMN_LENGTH, thickness=1.0)
    assert -last.supports["b.top"].y == pytest.approx(reference, rel=0.03)
    assert "buckle" in caplog.text
    assert last.state.stability.negative == 0


@pytest.mark.parametrize("number", [6, 10])
def test_random_slender_bodies(number):
    """A few of the random columns, arches and rings: right or stopped with a message."""
    assert verdict(draw(5, number), fine=25)[0] != "wrong"


def test_a_pushed_arch_ends_at_its_limit_point():
    """A force beyond the limit load has no equilibrium before the arch has snapped: reported as such, with what to try."""
    with pytest.raises(SolveError, match="limit point") as caught:
        list(pr.solve(shallow_arch(-60.0)))
    assert isinstance(caught.value.reason, failure.LimitPoint)
    assert "stabilise: auto" in str(caught.value)


@pytest.mark.parametrize("increments", [1, 3])
def test_a_push_far_beyond_the_limit_load_does_not_jump_over_it(increments):
    """Newton's iteration finds the arch snapped through in so long an increment: stable, in balance, nothing told."""
    problem = shallow_arch(-100.0)
    asked = replace(problem, steps=(replace(problem.steps[0], increments=increments),))
    with pytest.raises(SolveError, match="limit point") as caught:
        list(pr.solve(asked))
    assert isinstance(caught.value.reason, failure.LimitPoint)
    assert isinstance(caught.value.last, Increment)
    assert 100.0 * caught.value.last.time == pytest.approx(18.603, abs=1e-3)  # the largest force of the arch when it is moved


def test_a_stabilised_arch_snaps_through(caplog):
    """With viscous forces the pushed arch goes on to the far side, where it carries the force; their work is in the
    energy balance.
    """
    increments = list(pr.solve(shallow_arch(-60.0, "auto")))
    last = increments[-1]
    assert last.time == 1.0
    assert last.tools["p"].force.y == pytest.approx(60.0, rel=1e-6)
    assert last.tools["p"].place.y < -4.0  # twice the rise is 4.8
    viscous = [i.energy["viscous"] for i in increments]
    assert all(b >= a for a, b in itertools.pairwise(viscous))
    assert viscous[-1] > 0.01 * last.energy["external"]
    assert "viscous forces" in caplog.text


def test_stabilisation_changes_little_where_nothing_snaps(caplog):
    """Moved by little, the arch has the force that it has without, to the share that is allowed; nothing is reported."""
    plain, damped = ([*pr.solve(shallow_arch(0.0, s, move=-0.4))][-1] for s in ("off", "auto"))
    assert damped.tools["p"].force.y == pytest.approx(plain.tools["p"].force.y, rel=2e-3)
    assert 0 < damped.energy["viscous"] < 1e-3 * damped.energy["external"]
    assert "viscous" not in caplog.text


@pytest.mark.parametrize("space", ["plane strain", "plane stress", "axisymmetric"])
def test_viscous_tangent_is_exact(space):
    """Forces are linear in the displacements, and their matrices are what differences give; volumes add up."""
    problem = single_block(
        pr.Step("s"), material=pr.Elastic(E=1.0, nu=0.3), size=(2, 1), n=(2, 2), origin=(1, 0), element="q8",
        fixed={"b.bottom": "xy"}, space=space, stabilise="auto",
    )  # fmt: skip
    system = discretise(problem)
    volumes = nodal_volumes(system)
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(system.blocks[0].volume.sum())
    c = system.context(system.initial(), plan_step(system, 0, np.zeros(system.ndof)), 0.25)
    c = replace(c, interactions=[Viscous(system, 3.0, volumes)])
    rng = np.random.default_rng(0)
    u, du = rng.standard_normal((2, system.ndof)) * 1e-3
    lam = system.initial().lam
    at = [system.evaluate(c, v, lam) for v in (u + 1e-6 * du, u - 1e-6 * du, u)]
    from scipy.sparse import csc_matrix

    K = csc_matrix((at[2].data, system.pattern.indices, system.pattern.indptr), (system.ndof,) * 2)
    assert np.abs((at[0].r - at[1].r) / 2e-6 - K @ du).max() <= 1e-7 * np.abs(K @ du).max()
    (part,) = Viscous(system, 3.0, volumes).respond(c, Request(u, lam)).parts
    assert part.r is not None
    assert np.vdot(part.r, system.displacement(u)) == pytest.approx(
        3.0 * volumes @ (system.displacement(u) ** 2).sum(axis=1) / 0.25
    )


def test_a_stabilised_run_resumes_exactly():
    """The viscosity is part of the committed state: continued in the middle, everything ends with the same bits."""
    problem = shallow_arch(0.0, 1e-3, move=-1.0)
    whole = list(pr.solve(problem))
    half = State.from_arrays(whole[len(whole) // 2].state.arrays())
    assert half.stability.viscosity > 0
    *_, last = pr.solve(problem, start=half)
    for name, value in whole[-1].state.arrays().items():
        assert np.array_equal(last.state.arrays()[name], value), name


def test_stabilisation_is_refused_where_bodies_are_condensed():
    """Condensed bodies have no velocities of their nodes: asked for both, the run says so; 'auto' solves the whole system."""
    problem = replace(shallow_arch(0.0, "auto", move=-0.2), kinematics="small")
    with pytest.raises(PrensaError, match="stabilise"):
        list(pr.solve(problem, pr.Numerics(condense=True)))
    assert list(pr.solve(problem))


@pytest.mark.parametrize("value", [0, -1e-3, 0.5, "on"])
def test_values_that_mean_nothing_are_refused(value):
    """A share of the work is above 0 and at most a tenth."""
    with pytest.raises(ValueError, match="stabilise"):
        shallow_arch(-1.0, value)


def _slender(seed: int, number: int, until: float, policy: Policy = POLICY) -> list[Increment]:
    """The increments of a random slender part up to a time."""
    problem = drawn("slender", seed, number).problem
    return list(itertools.takewhile(lambda i: i.time < until, pr.solve(problem, policy=policy)))


def test_modes_are_looked_at_after_contact_steps_too():
    """A step by contact leaves no factors; a bowed column that it leads to the far side of its bow is not let through."""
    increments = _slender(1995838795, 6, 0.1)
    heads = [float(i.contacts["part.top-tool"].x[-1, 0]) for i in increments]
    assert increments[-1].time > 0.09
    assert max(heads) < 1e-6  # the bow is to the right, the head goes to the left
    assert all(i.state.stability.negative == 0 for i in increments)


def test_a_jump_that_is_short_is_taken_and_reported(caplog):
    """Where a node of a column's head comes off it jumps by a thousandth of the height, to where a support would lead it too.

    Followed up to the limit point: nothing is looked for beside the unstable state that long increments come upon before it.
    """
    taken = _slender(3980521661, 1, 0.119, replace(POLICY, branch_from_share=1e-6))
    assert "jump to another equilibrium" in caplog.text
    assert "buckle" not in caplog.text
    forces = [i.tools["tool"].force.y for i in taken]
    assert forces[-1] < 0.99 * max(forces)
    last = taken[-1]
    head, share = last.contacts["part.top-tool"], last.time
    aside = float(head.x[-1, 0] - head.X[-1, 0])
    problem = drawn("slender", 3980521661, 1).problem
    travel = problem.steps[0].move["tool"].y
    led = (
        pr.Step("before", move={"tool": pr.Motion(y=0.11 * travel)}, increments=2),
        pr.Step("led", move={"tool": pr.Motion(y=share * travel)}, fixed={"part.top-left": pr.Fixed(x=aside)}, increments=4),
    )
    *_, there = pr.solve(replace(problem, steps=led))
    assert abs(there.supports["part.top-left"].x) < 1e-6 * forces[-1]  # the support has nothing to do there
    assert there.tools["tool"].force.y == pytest.approx(forces[-1], rel=1e-6)


def _crown(friction: pr.Coulomb | None = None, stabilise: str | float = "off", metal: bool = False) -> pr.Problem:
    """Half an arch under a plane: its crown comes off the plane and gives way, at about 0.9 of the travel."""
    R, half, solid = 20.0, 1.4, pr.Elastic(1000.0, 0.3)
    mesh = pr.Annulus(R - 0.5, R + 0.5, (10, 1), angles=(np.pi / 2 - half, np.pi / 2))
    material = pr.J2(1000.0, 0.3, pr.Perfect(1e4)) if metal else solid
    return pr.Problem(
        "arch", {"part": pr.Body(mesh, material, "q4_enhanced")},
        (pr.Step("press", move={"tool": pr.Motion(y=-0.4 * R * (1 - np.cos(half)))}, increments=4),),
        {"tool": pr.Plane(normal=(0, -1), at=(0, R + 0.5))}, (pr.Contact("part.outer", "tool", friction),),
        fixed={"part.start": "xy", "part.end": "x"}, stabilise=stabilise,
    )  # fmt: skip


def test_elastic_bodies_without_friction_jump_by_themselves(caplog):
    """To where viscous forces lead them too, and to less energy; tools and supports are in balance in every increment."""
    taken = list(pr.solve(_crown()))
    assert caplog.text.count(JUMPED) == 1
    assert taken[-1].time == 1.0
    energy = np.array([i.energy["elastic"] for i in taken])
    at = int(np.argmin(np.diff(energy)))  # where work is done on the part it grows
    assert taken[at + 1].time - taken[at].time < 1e-5
    way = taken[at + 1].bodies["part"].x - taken[at].bodies["part"].x
    assert np.abs(way).max() > 1.5 * POLICY.branch_distances[-1] * 20.0  # farther than what is looked at beside every limit point
    for i in taken:
        up = i.supports["part.start"].y + i.supports["part.end"].y
        assert i.force("tool").y == pytest.approx(up, rel=1e-6, abs=1e-9)
        assert i.state.stability.negative == 0
    *_, led = pr.solve(_crown(stabilise=2e-6))
    assert energy[-1] == pytest.approx(led.energy["elastic"], rel=1e-8)
    assert taken[-1].force("tool").y == pytest.approx(led.force("tool").y, rel=1e-4)
    # what the jump sets free is what the viscous forces take there
    assert led.energy["viscous"] == pytest.approx(energy[at] - energy[at + 1], rel=0.03)


@pytest.mark.parametrize(("way", "may"), [
    ({}, True), ({"friction": pr.Coulomb(0.0)}, True), ({"friction": pr.Coulomb(0.01)}, False), ({"metal": True}, False),
])  # fmt: skip
def test_what_has_a_memory_does_not_jump_by_itself(way, may):
    """Friction and plasticity ask for the way; forces (see the pushed arch above) for what bears them."""

    def equations(problem: pr.Problem) -> Equilibrium:
        system = discretise(problem)
        plan = plan_step(system, 0, np.zeros(system.ndof))
        reduced = Reduced.of(system, plan.fixed, pr.Numerics())
        c = system.context(system.initial(), plan, 0.25)
        return Equilibrium(system, c, reduced, pr.Numerics(), POLICY, Reporter(print, print))

    problem = _crown(**way)
    assert is_path_independent(equations(problem)) == may
    pushed = replace(problem, steps=(pr.Step("press", push={"tool": pr.Push(y=-1.0)}),))
    assert not is_path_independent(equations(pushed))


def test_the_matrix_of_the_drag_is_exact():
    """Its forces are linear in the displacements from where it begins."""
    system = discretise(_crown())
    rng = np.random.default_rng(0)
    u, start = rng.standard_normal((2, system.ndof))
    stiffness = rng.uniform(1.0, 2.0, system.nodes)
    c = system.context(system.initial(), plan_step(system, 0, np.zeros(system.ndof)), 0.25)
    (part,) = Drag(system, stiffness, start).respond(c, Request(u, np.zeros(0))).parts
    assert part.r is not None and part.K is not None
    assert np.allclose(part.r, np.einsum("kij,kj->ki", part.K, system.displacement(u - start)))


def test_an_energy_balance_off_by_a_jump_asks_for_no_smaller_increments(monkeypatch, tmp_path):
    """They could not follow it, as the warning of the jump says; before the jump they do reduce what is missing."""
    monkeypatch.setattr(running, "IMBALANCE", 1e-9)  # so that any shows
    whole = _crown()
    half = replace(whole, steps=(replace(whole.steps[0], move={"tool": pr.Motion(y=0.5 * whole.steps[0].move["tool"].y)}),))
    said = {}
    for name, problem in (("jumps", whole), ("does not", half)):
        found = pr.run(problem, out=tmp_path / name).summary["warnings"]
        (said[name],) = [text for text in found if text.startswith("energy balance")]
        assert any(JUMPED in text for text in found) == (name == "jumps")
    assert "set free" in said["jumps"] and "smaller" not in said["jumps"]
    assert "smaller increments" in said["does not"]
