"""A run that cannot go on ends when that is known, and says on which element, side, contact or tool."""

from __future__ import annotations

import numpy as np
import pytest

import prensa as pr
from prensa.checks.during.distortion import Distortion
from prensa.checks.during.self_intersection import fold, hanging
from prensa.elements.element import Why
from prensa.errors import PreflightError, SolveError
from prensa.policy import DEFAULT
from prensa.result.folding import Outlined
from prensa.solver.diagnosis import hint
from prensa.system.failure import (
    Distorted,
    ElementFailed,
    Fold,
    Folded,
    FreeToMove,
    MetalInside,
    PastSupport,
    StartsInside,
    Unevaluable,
    sentence,
)
from prensa.system.planning import plan_step
from problems import pressed_block, single_block, squeezed_block, stroke, upset_block

METAL = pr.J2(E=70e3, nu=0.3, flow=pr.Voce(s0=60, Q=120, b=8))
SOFT = pr.Elastic(E=1000.0, nu=0.3)


def failure_of(problem, numerics=None):
    """The increments that a run had, and the error that ended it."""
    done, run = [], pr.solve(problem, numerics)
    with pytest.raises(SolveError) as caught:
        while True:
            done.append(next(run))
    return done, caught.value


def worn(places, dt=1e-6, times=DEFAULT.worn_out_attempts, longest=0.1):
    """What comes of attempts that fail on element 2 of a strip of 3 × 1 whose nodes are at ``places(x, y)``."""
    problem = upset_block(stroke(-0.1, tool="die"), material=METAL, size=(3, 1), n=(3, 1), plane="die")
    system = pr.discretise(problem)
    state = system.initial()
    system.displacement(state.u)[:] = np.column_stack(places(*system.X.T)) - system.X
    c = system.context(state, plan_step(system, 0, state.step_start), dt)
    failed = Unevaluable(ElementFailed(2, "b", 2.5, 0.5, Why.INVERTED))
    distortion = Distortion(system, DEFAULT)
    return [distortion.rejected(c, failed, longest) for _ in range(times)][-1]


def flat(x, y):
    """The corner at (3, 0) goes up beyond the diagonal of its element."""
    corner = (x == 3) & (y == 0)
    return x - 0.7 * corner, y + 0.8 * corner


def under(x, y):
    """The free corner at (3, 1) goes under the support of the bottom."""
    corner = (x == 3) & (y == 1)
    return x, y - 1.1 * corner


def test_an_element_on_which_attempts_fail_again_and_again_ends_the_run():
    """All three are needed: many failures, short increments, a bad shape; the words name element, sides and contact."""
    reason = worn(flat)
    assert isinstance(reason, Distorted) and reason.shape < 0.2 and reason.attempts == DEFAULT.worn_out_attempts
    assert (
        set(reason.sides) == {"b.top", "b.right", "b.bottom"}
        and reason.contacts == ("b.top-die",)
        and reason.past is None
    )
    assert "element 2 of b" in sentence(reason) and "in contact b.top-die" in sentence(reason)
    assert "finer there" in hint(reason)
    assert worn(flat, times=DEFAULT.worn_out_attempts - 1) is None
    assert worn(flat, dt=1e-3) is None
    assert worn(lambda x, y: (x, y)) is None


def test_a_side_that_has_slid_past_its_support_is_named():
    """A free side under the support beside it: reported with both, and with the tool that should be there."""
    reason = worn(under)
    assert isinstance(reason, Distorted)
    assert reason.past == ("b.right", "b.bottom", pytest.approx(0.1), pytest.approx(0.1))
    assert "'b.right' has slid past the support 'b.bottom'" in sentence(reason)
    assert "in place of the support 'b.bottom', with 'b.right' in its contact" in hint(reason)


def sticking(increments=None, travel=-1.2, table=False):
    """A block that sticks to what it stands on, flattened: its free side comes down past the end of its support."""
    tools = {"die": pr.Plane(touching="b.top")} | ({"table": pr.Plane(touching="b.bottom", normal=(0, 1))} if table else {})
    contacts = [pr.Contact(("b.top", "b.right"), "die", friction=pr.Coulomb(0.5))]
    return pr.Problem(
        "sticking", bodies={"b": pr.Body(pr.Rectangle(size=(4, 2), n=(8, 4)), METAL)}, tools=tools,
        contacts=contacts + [pr.Contact("b.right", "table", friction=pr.Coulomb(1.0))] * table,
        fixed={"b.bottom": "xy", "b.left": "x"},
        steps=(pr.Step("press", move={"die": pr.Motion(y=travel)}, increments=increments),),
    )  # fmt: skip


def test_a_side_that_stays_past_its_support_ends_the_run(caplog):
    """Reported when its element folds, ended twenty increments later: it went on for 406, and stopped at a 'limit point'."""
    done, error = failure_of(sticking())
    reason = error.reason
    assert isinstance(reason, PastSupport) and reason.past[:2] == ("b.right",
        "b.bottom") and reason.increments == DEFAULT.max_folded_increments
    assert len(done) < 100 and done[-1].time < 0.55
    assert "side 'b.right' lies" in str(error) and "in place of the support 'b.bottom'" in str(error)
    assert sum("slides past the support 'b.bottom'" in words for words in caplog.messages) == 1


def test_a_step_that_ends_soon_after_a_side_is_past_its_support_is_reported_alone(caplog):
    """What was asked for is computed: half of the travel, few increments past the support."""
    last = list(pr.solve(sticking(10, -0.55)))[-1]
    assert last.time == 1.0 and any("slides past the support" in words for words in caplog.messages)


def test_a_tool_in_place_of_the_support_lets_the_run_go_on():
    """The remedy of the message: the same side in contact with a table goes on, and its force is more than a tenth above."""
    done = {table: dict() for table in (False, True)}
    for table, forces in done.items():
        run = pr.solve(sticking(24, -0.6, table))
        forces.update((round(inc.time, 9), inc.force("die").y) for inc in run)
    assert done[True][1.0] > 1.1 * done[False][1.0]


def test_a_free_side_that_creases_where_it_enters_a_tool_is_reported_at_once():
    """A quarter of what a node may lie inside a tool by itself is enough where its element folds over itself."""
    problem = squeezed_block(
        stroke(-0.9), material=METAL, size=(3, 1.5), n=(9, 4), friction=pr.Coulomb(0.4), fixed={"b.left": "x"}
    )
    done, error = failure_of(problem)
    assert isinstance(error.reason, MetalInside) and error.reason.node.side == "b.right"
    assert 0.01 < error.reason.node.depth / (1 / 3) < 0.05 and len(done) < 300


def test_a_body_that_passes_through_itself_is_reported():
    """An open ring is closed further than its ends can be: they would pass through each other without a force."""
    ring = pr.Annulus(inner=0.9, outer=1.1, n=(32, 2), angles=(0.13, 2 * np.pi - 0.13))
    problem = pr.Problem(
        "ring", bodies={"b": pr.Body(ring, SOFT)}, fixed={"b.start": "xy"},
        steps=(pr.Step("close", fixed={"b.end": pr.Fixed(x=0.05, y=0.4)}, increments=8),),
    )  # fmt: skip
    done, error = failure_of(problem)
    assert isinstance(error.reason, Folded)
    # in the increment in which they meet, not at the end of the step
    assert not any(inc.statistics.cutbacks for inc in done) and done[-1].time < 0.8
    assert "side 'b.inner' crosses side 'b.start'" in str(error) and "no contact with themselves" in str(error)


@pytest.mark.parametrize("drawn", [1.0, 0.4])
def test_an_edge_that_hangs_on_a_corner_of_a_tool_is_reported(drawn):
    """Its ends lie on the side and on the end of a stamp: drawn out, it passes through the stamp; short, it only touches it."""
    stamp = pr.Profile(points=((-0.6, 1.0), (-0.6, 0.0), (0.6, 0.0), (0.6, 1.0)), fillet=0.0, at=(0.0, 1.0))
    problem = pressed_block(
        pr.Step("rest"), tools={"die": stamp}, material=SOFT, size=(4, 1), n=(8, 2), origin=(-2.0, 0.0)
    )
    system = pr.discretise(problem)
    u = system.initial().u.copy()
    ends = [int(np.argmin(np.hypot(*(system.X - place).T))) for place in ((-0.5, 1.0), (0.0, 1.0))]
    behind, under = np.array([0.6, 1.3]), np.array([0.6 - drawn, 1.0])
    system.displacement(u)[ends] = [under, behind] - system.X[ends]
    hang = hanging(system, u)
    if drawn < 0.5:
        assert hang is None
        return
    assert hang.side == "b.top" and hang.tool == "die"
    assert hang.depth == pytest.approx(0.15) and hang.stretch == pytest.approx(np.hypot(1.0, 0.3) / 0.5)
    reason = Folded(Fold("b.top", "b.top", 0.0, 1.0, 0.1), hang)
    assert "caught on a corner" in sentence(reason) and "t6" in hint(reason)


@pytest.mark.parametrize("element", ["q4", "q8", "t6"])
def test_outlines_that_only_bend_are_no_folds(element):
    """A strip turned, sheared or bent to three quarters of a ring folds nowhere; bent further it does, where its ends meet."""
    system = pr.discretise(single_block(
        pr.Step("rest"), material=SOFT, size=(4, 1), n=(16, 2), element=element, fixed={"b.left": "xy"}
    ))
    x, y = system.X.T
    u = system.initial().u

    def folded(*places):
        system.displacement(u)[:] = np.column_stack(places) - system.X
        return fold(Outlined(system, u, u))

    assert folded(x, y) is folded(-y, x) is folded(x + 3 * y, y) is folded(x, y + 0.3 * x**2) is None
    r = 2 - y - 0.1 * x
    assert folded(r * np.sin(1.2 * x), r * np.cos(1.2 * x)) is None
    met = folded(r * np.sin(1.63 * x), r * np.cos(1.63 * x))
    assert met is not None and {"b.left", "b.right"} & {met.first, met.second}


# ------------------------------------------------------------------------------------------------ overlaps at the start
def pressed(tool, travel, mu=0.0, increments=5):
    """A soft block, held below, under a tool."""
    return pressed_block(
        stroke(travel, increments=increments), tools={"t": tool}, material=SOFT, n=(16, 8),
        friction=pr.Coulomb(mu) if mu else None,
    )  # fmt: skip


def test_a_tool_three_elements_inside_an_elastic_body_is_pressed_out_at_once():
    """The answer is that of a tool that touches and is moved in; it was given up after seven cuts, with an element inside out."""
    inside = list(pr.solve(pressed(pr.Circle(radius=0.8, at=(2.0, 2.05)), -0.05)))
    moved = list(pr.solve(pressed(pr.Circle(radius=0.8, at=(2.0, 2.8)), -0.8, increments=16)))
    assert len(inside) == 5 and sum(i.statistics.cutbacks for i in inside) == 0
    # contact stiffnesses belong to the areas that points have at the beginning of the increment
    assert inside[-1].force("t").y == pytest.approx(moved[-1].force("t").y, rel=1e-3)


def test_a_tool_that_no_body_gives_way_to_is_reported_soon():
    """Half the height of the block is beyond its limit point: seven or more cuts said nothing of the overlap."""
    done, error = failure_of(pressed(pr.Plane(at=(0.0, 1.0)), -0.05))
    assert not done and isinstance(error.reason, StartsInside)
    assert error.reason.depth == pytest.approx(1.0) and error.reason.elements == pytest.approx(4.0)
    assert "'t' starts 1 inside 'b.top', 4 of an element" in str(error) and "same overlap" in str(error)


def test_a_tool_beyond_whose_centre_nodes_lie_is_refused():
    """They would be pulled through it: the run completed, the tool was pulled in by 356 N."""
    with pytest.raises(PreflightError, match="nearer to its far side"):
        pr.solve(pressed(pr.Circle(radius=0.8, at=(2.0, 1.8)), -0.05))


# -------------------------------------------------------------------------------- what is at its limit, and what it cost
def test_friction_at_its_bound_is_named():
    """A block that is pulled out of a vice by more than friction holds: the message says which contacts release it."""
    problem = squeezed_block(
        stroke(-0.01, increments=2), pr.Step("pull", loads={"b.right": pr.Load(pressure=-20.0)}, increments=4), material=SOFT,
        size=(2, 1), n=(6, 3), friction=pr.Coulomb(0.2),
    )  # fmt: skip
    _, error = failure_of(problem)
    assert isinstance(error.reason, FreeToMove)
    assert "friction of b.top-t is at its limit at all 7 points in contact" in str(error)
    assert "friction of b.bottom-table is at its limit at all 7 points in contact" in str(error)


METALS = {
    "mises": pr.J2(1000.0, 0.3, pr.Perfect(5.0)),
    "hill, weak in shear": pr.Hill(1000.0, 0.3, pr.Perfect(5.0), F=0.5, G=0.5, H=0.5, N=2.5),
    "hill, strong in shear": pr.Hill(1000.0, 0.3, pr.Perfect(5.0), F=0.5, G=0.5, H=0.5, N=1.0),
}


@pytest.mark.parametrize("name", METALS)
def test_friction_as_strong_as_the_metal_is_named(name):
    """A tool is pushed along by more than the skin bears in shear, which a factor of 1 lets it ask for; of Hill's metals too."""
    problem = pressed_block(
        stroke(-0.02, increments=2), pr.Step("slide", push={"t": pr.Push(x=10.0)}, increments=4),
        material=METALS[name], size=(2, 1), n=(6, 3), friction=pr.Shear(m=1.0),
    )  # fmt: skip
    _, error = failure_of(problem)
    assert "friction of b.top-t reaches the shear strength of the metal at" in str(error)


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "heard"), [(1.9, True), (0.1, False)])
def test_friction_that_the_metal_does_not_bear_is_what_to_change(mu, heard):
    """A cylinder that sticks to the metal shears it as it turns; where no increment converges, less friction would help."""
    ways = (pr.Motion(y=-0.1), pr.Motion(rz=0.1), pr.Motion(rz=0.4))
    steps = tuple(pr.Step(str(i), move={"t": way}, increments=4) for i, way in enumerate(ways))
    problem = pressed_block(
        *steps, tools={"t": pr.Circle(radius=1.0, touching="b.top")}, material=pr.J2(70e3, 0.3, pr.Perfect(100.0)),
        n=(16, 8), friction=pr.Coulomb(mu),
    )  # fmt: skip
    *_, turned = (inc for inc in pr.solve(problem) if inc.time <= 2.0)
    with pytest.raises(SolveError) as caught:
        list(pr.solve(problem, pr.Numerics(max_iterations=2, max_cutbacks=0), start=turned.state))
    assert ("What to try: friction below the metal's shear strength ('shear' with m below 1" in str(caught.value)) is heard


@pytest.mark.parametrize("rule", ["simpson", "gauss3"])
def test_stiff_penalties_at_more_points_than_nodes_are_solved_in_one_increment(rule):
    """More closed points than displacements of a stiff penalty: hundreds of iterations before, in a hundred increments."""

    def run(rule):
        (increment,) = pr.solve(pressed_block(
            stroke(-0.05, increments=1), tools={"t": pr.Circle(radius=5, touching="b.top")}, material=SOFT, n=(16, 8),
            enforcement=pr.Penalty(beta=1e4), integration=rule, kinematics="small",
        ))  # fmt: skip
        return increment

    increment = run(rule)
    assert increment.statistics.cutbacks == 0 and increment.statistics.iterations <= 12
    assert increment.force("t").y == pytest.approx(run("nodal").force("t").y, rel=0.08)


def test_an_increment_reports_all_its_iterations():
    """What is said of an accepted increment counts the attempts that were cut, as its statistics do."""
    said = []
    problem = upset_block(stroke(-0.8, increments=1), material=METAL, size=(2, 1), n=(6, 3))
    increment = next(pr.solve(problem, monitor=said.append))  # a strain of more than 1 at once is refused
    tried = sum(p.iteration for p in said if p.event == "rejected")
    accepted = next(p for p in said if p.event == "accepted")
    assert increment.statistics.cutbacks > 0 and tried > 0
    assert accepted.iteration == increment.statistics.iterations > tried
