"""Random problems on default settings: none may be answered wrongly, and nearly all must be answered."""

from __future__ import annotations

import pytest

import prensa as pr
from prensa.system.discretise import discretise
from prensa_bench import robustness
from problems import pressed_block, stroke


@pytest.mark.parametrize(("suite", "least"), [("elastic", 0.96), pytest.param("plastic", 0.86, marks=pytest.mark.slow)])
def test_random_problems(suite, least):
    """Of 30 random problems no answer is wrong, and at most one elastic (four plastic) are given up, with a reason."""
    tally = robustness.run(suite, 30, seed=2, first=5)
    assert [o for o in tally.outcomes if o.status == "wrong"] == []
    assert tally.share("right") >= least, [o.words for o in tally.outcomes if o.status == "reported"]
    assert all(o.words for o in tally.outcomes if o.status == "reported")


def test_random_problems_with_exact_enforcement():
    """Multipliers are no less robust than penalties: nine elastic problems and two plastic ones are all right."""
    for suite, count in (("elastic", 9), ("plastic", 2)):
        tally = robustness.run(suite, count, seed=5, first=1, enforcement="exact")
        assert [o.words for o in tally.outcomes if o.status != "right"] == []


def test_a_problem_is_the_same_for_the_same_seed():
    """The suite is reproducible: number and seed say everything."""
    assert robustness.draw("plastic", 3, 7) == robustness.draw("plastic", 3, 7)
    assert robustness.draw("plastic", 3, 7) != robustness.draw("plastic", 4, 7)


def test_the_checks_can_fail():
    """Moving a contact force after the solution makes the check of equilibrium speak."""
    import dataclasses

    from prensa.analysis import solve

    p = robustness.draw("elastic", 1, 4)
    system = discretise(p)
    *_, inc = solve(system)
    tool = inc.tools["tool"]
    spoilt = dataclasses.replace(tool, force=tool.force._replace(y=tool.force.y * 1.001 + 1e-3))
    allowed = robustness.BALANCE * abs(tool.force.y)
    assert robustness.check(system, inc) == ""
    assert robustness.unbalanced(system, inc) < allowed
    assert robustness.unbalanced(system, dataclasses.replace(inc, tools={"tool": spoilt})) > allowed


def test_the_published_page_counts_failures_by_kind(tmp_path):
    """Two reasons that differ in numbers and places are one kind; each is reported in full below."""
    words = [
        "step 'press', time 0.7: element 153 of body (initially near 0.4673, 0.4191) turned inside out; more 'increments'",
        "step 'push', time 0.2: element 7 of body (initially near 1, 2) turned inside out; more 'increments'",
        "step 'push', time 0.2: the residual stagnates at 1.4e-09 of the forces; it is at node 7",
    ]
    outcomes = [robustness.Outcome(k, f"{k}: plane", "reported", w, reason="Stagnated") for k, w in enumerate(words)]
    robustness.write(tmp_path / "page.md", [robustness.Tally("plastic", 3, outcomes)], "abc")
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "| plastic | reported | Stagnated | element turned inside out | 2 |" in page
    assert "| plastic | reported | Stagnated | the residual stagnates of the forces | 1 |" in page
    assert all(f"- plastic {k}: plane: {w}" in page for k, w in enumerate(words))
    assert "commit abc" in page


@pytest.mark.parametrize("suite", ["elastic", "plastic"])
def test_drawn_problems_are_posed_by_their_drawing(suite):
    """What a tool can reach is in its contact, and no tool wedges itself between a body and the mandrel in its bore."""
    problems = [robustness.draw(suite, 3980521661, number) for number in range(150)]
    walls, bores = 0, 0
    for p in problems:
        tool, mesh = p.tools["tool"], p.bodies["body"].mesh
        points = mesh.points if mesh.type == "points" else None
        x, y = (tuple(zip(*points))) if points else ([mesh.origin[0], mesh.origin[0] + mesh.size[0]], [0.0, mesh.size[1]])
        bore, side, height = min(x), max(x), max(y)
        down = sum(-s.move["tool"].y for s in p.steps[:1] if "tool" in s.move)
        if tool.type == "circle" and tool.concave:
            # the wall of the cavity, from the corner that touches first: how far it is from the middle of the side
            centre = height - (tool.radius**2 - side**2) ** 0.5 - down
            gap = (tool.radius**2 - (0.5 * height - centre) ** 2) ** 0.5 - side
            walls += gap < 0.5 * side
            assert gap > 0.5 * side or "body.right" in p.contacts[0].surface, p.name
            assert p.contact_geometry == "current", p.name
        elif p.contact_geometry == "reference":  # a corner of two sides has no normal before it deforms
            assert p.contacts[0].surface == ("body.top",), p.name
        elif tool.type == "plane":
            walls += 1
            assert "body.right" in p.contacts[0].surface, p.name
        elif tool.type == "circle" and bore > 0:
            bores += 1
            above = (tool.radius**2 - bore**2) ** 0.5 - down
            assert above > 0.999 * bore, p.name  # the normal at the edge of the bore is within 45° of the axis
    assert walls > 10
    assert bores > 3


@pytest.mark.parametrize("offset", [-1.0, 0.0, 100.0])
def test_what_places_resolve_bounds_the_balance_of_stiff_contacts(offset):
    """A block under a stiff penalty is out of balance by what its distance from the origin says, and not by more."""
    problem = pressed_block(
        stroke(-0.01, increments=2, tool="tool"), size=(1, 1), n=(4, 3), origin=(0.1, offset),
        enforcement=pr.Penalty(beta=1e6), plane="tool", fixed={"b.bottom": "y"}, space="axisymmetric",
    )  # fmt: skip
    system = discretise(problem)
    *_, inc = pr.solve(system)
    force, resolved = abs(inc.force("tool").y), robustness.resolution(system, inc)
    assert robustness.unbalanced(system, inc) < 3 * resolved + 1e-11 * force
    assert {-1.0: 1e-9, 0.0: 1e-7, 100.0: 1e-4}[offset] * force > resolved > 0
    assert offset < 100 or resolved > 1e-8 * force


def test_round_off_of_places_is_that_of_three_roundings():
    """Against fractions, which are exact: never more than half a unit of each, and nearly that; more than a unit of the node."""
    from fractions import Fraction as Exact

    import numpy as np

    from prensa_bench.robustness.increments import rounded

    rng = np.random.default_rng(5)
    X, at, of_bound, over_node = 0.0052, 0.0248, [], []
    for u, U in rng.uniform(-1e-5, 1e-5, (4000, 2)):
        x, centre = np.array([[X + u, 0.0]]), np.array([at + U, 0.0])
        exact = Exact(X) + Exact(u) - Exact(at) - Exact(U)
        off = abs(float(Exact(float((x - centre)[0, 0])) - exact))
        of_bound.append(off / rounded(x, centre)[0, 0])
        over_node.append(off / np.spacing(x[0, 0]))
    assert 0.8 < max(of_bound) <= 1.0
    assert max(over_node) > 3.0


@pytest.mark.parametrize(("peaks", "verdict"), [
    ((300.0, 325.0, 353.0, 354.0), "right"),  # begins far from where it closes in
    ((300.0, 325.0, 330.0), "right"),
    ((300.0, 325.0, 350.0, 375.0), "wrong"),
    ((300.0, 325.0, 353.0, 380.0), "wrong"),
    ((300.0, 301.0), "right"),
])  # fmt: skip
def test_peaks_that_close_in_are_coarse_answers_and_others_wrong(peaks, verdict, monkeypatch):
    """The step is halved until peak forces close in, three times at most."""
    from prensa_bench.robustness import increments

    given = iter(peaks)
    monkeypatch.setattr(increments, "solve_checked", lambda p: (next(given), 1, 0, ""))
    assert increments.judge(robustness.draw("plastic", 3, 7), 7, compare=True).status == verdict
    assert list(given) == []
