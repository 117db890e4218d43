"""A case that starts from an earlier run goes on exactly where that run ended, with other tools and steps if wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.model.schema import loads
from prensa.output.history import read_history
from problems import pressed_block

STEEL = pr.J2(E=70e3, nu=0.33, flow=pr.Voce(60.0, 120.0, 8.0))
PRESS = pr.Step("press", move={"punch": pr.Motion(y=-0.1)}, increments=4)
RELEASE = pr.Step("release", move={"punch": pr.Motion(y=0.02)}, increments=3)


def case(*steps: pr.Step, **more) -> pr.Case:
    """A block pressed by a cylinder with friction, in plane strain."""
    block = {
        "mesh": pr.Rectangle(size=(4, 3), n=(8, 6), grade="top-left"), "material": STEEL, "friction": pr.Coulomb(0.2),
        "tools": {"punch": pr.Circle(radius=2.0, touching="block.top")}, "fixed": {"block.bottom": "xy", "block.left": "x"},
    }  # fmt: skip
    problem = pressed_block(*steps, body="block", **{"name": "indent"} | block | more)
    return pr.Case(problem, output=pr.Output(fields=0, pictures=False, report=False))


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Augmented(), pr.Exact()], ids=lambda e: e.type)
def test_press_and_release_in_two_cases_are_those_of_one(tmp_path, enforcement):
    """Forces, shapes, stresses, energies: the same to the last digits as in one run of both steps."""
    whole = pr.run(case(PRESS, RELEASE, enforcement=enforcement), tmp_path / "whole", quiet=True)
    pr.run(case(PRESS, enforcement=enforcement), tmp_path / "press", quiet=True)
    second = case(RELEASE, enforcement=enforcement, start=pr.Start(str(tmp_path / "press")))
    assert pr.discretise(second.problem).release is None, "nothing has to be released"
    after = pr.run(second, tmp_path / "release", quiet=True)
    a, b = whole.increment, after.increment
    parts = {key: (getattr(a.state, key), getattr(b.state, key)) for key in ("u", "lam", "energy")}
    record = a.state.contact, b.state.contact
    parts |= {key: tuple(getattr(r, key) for r in record) for key in ("traction", "slip", "coordinate")}
    assert np.array_equal(record[0].closed, record[1].closed)
    for key, pair in parts.items():
        x, y = map(np.array, pair)
        assert np.abs(x - y).max() <= 1e-10 * np.abs(x).max(), key
    for x, y in zip(a.state.history, b.state.history, strict=True):
        assert np.abs(x - y).max() <= 1e-10 * np.abs(x).max()
    forces = whole.history["punch.fy"][whole.history["step"] == "release"], after.history["punch.fy"]
    assert np.allclose(*forces, rtol=1e-9, atol=1e-9 * abs(whole.history["punch.fy"]).max())
    wear = whole.increment.measure("punch.wear")
    assert after.increment.measure("punch.wear") == pytest.approx(wear, rel=1e-9) and wear > 0.0
    assert pr.results(after.directory).increments[-1].measure("punch.wear") == pytest.approx(wear, rel=1e-6)


def test_tools_that_are_gone_are_released_during_the_first_step(tmp_path):
    """Springback without the punch ends in the shape that lifting the punch leaves; the energy balance closes."""
    whole = pr.run(case(PRESS, RELEASE, friction=None), tmp_path / "whole", quiet=True).increment
    pr.run(case(PRESS, friction=None), tmp_path / "press", quiet=True)
    free = case(pr.Step("springback", increments=3), tools={}, friction=None, start=pr.Start(str(tmp_path / "press")))
    system = pr.discretise(free.problem)
    pressed = pr.discretise(case(PRESS).problem)
    assert system.release is not None and pressed.release is None
    after = pr.run(free, tmp_path / "free", quiet=True).increment
    spring = np.abs(system.initial().u[: 2 * system.nodes] - after.state.u).max()
    assert spring > 1e-3
    assert np.abs(whole.state.u[: 2 * system.nodes] - after.state.u).max() < 1e-3 * spring
    for name in ("elastic", "plastic"):
        assert after.energy[name] == pytest.approx(whole.energy[name], abs=1e-4 * whole.energy["plastic"])
    last = read_history(tmp_path / "press")
    missed = last["energy.imbalance"][-1]
    assert after.energy["imbalance"] == pytest.approx(missed, abs=1e-3 * last["energy.external"][-1]), (
        "nothing is added"
    )
    assert system.release[1::2].sum() == pytest.approx(-last["punch.fy"][-1], rel=0.02), (
        "the punch's force, at new weights"
    )


def test_other_tools_are_placed_on_the_deformed_body(tmp_path):
    """A plane that touches the pressed surface stands at its highest node; a second body is virgin."""
    pr.run(case(PRESS), tmp_path / "press", quiet=True)
    bodies = case(PRESS).problem.bodies | {"new": pr.Body(pr.Rectangle((1, 1), (2, 2), origin=(9, 0)), STEEL)}
    second = case(
        pr.Step("flatten", move={"plate": pr.Motion(y=-0.01)}, increments=2), bodies=bodies,
        tools={"plate": pr.Plane(above="block.top")}, friction=None,
        fixed={"block.bottom": "xy", "block.left": "x", "new.bottom": "xy"}, start=pr.Start(str(tmp_path / "press")),
    )  # fmt: skip
    system = pr.discretise(second.problem)
    top = system.positions(system.initial().u)[system.boundary_nodes("block.top"), 1].max()
    assert system.tools[0].at[1] == pytest.approx(top, rel=1e-12) and top > 3.0
    assert not system.initial().history[1].any()
    inc = pr.run(second, tmp_path / "flatten", quiet=True).increment
    assert inc.force("plate").y > 0 and not inc.bodies["new"].displacement.any()


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()], ids=lambda e: e.type)
def test_a_support_released_gives_the_contact_more_points(tmp_path, enforcement):
    """The whole outline is in contact but where it is held: what is released joins in, the other points go on as they were."""
    whole = (pr.Contact("block", "punch", pr.Coulomb(0.2), enforcement=enforcement),)
    run = pr.run(case(PRESS, contacts=whole), tmp_path / "press", quiet=True)
    ended = run.increment.state
    loose = case(RELEASE, contacts=whole, fixed={"block.bottom": "xy"}, start=pr.Start(str(tmp_path / "press")))
    system = pr.discretise(loose.problem)
    state = system.initial()
    s, old = system.surfaces[0], pr.discretise(case(PRESS, contacts=whole).problem).surfaces[0]
    assert len(s.points) > len(old.points)
    for name in ("traction", "slip"):
        new, before = getattr(state.contact, name), getattr(ended.contact, name)
        assert np.abs(before).max() > 0 and np.sort(new[new != 0]).tolist() == np.sort(before[before != 0]).tolist(), name
    after = pr.run(loose, tmp_path / "release", quiet=True).increment
    assert after.tools["punch"].force[1] == pytest.approx(0.0, abs=1e-6) and np.abs(after.supports["block.bottom"]).max() < 1e-6


def test_a_case_in_a_file_names_the_run_beside_it_and_resumes(tmp_path):
    """The folder is relative to the case file; a resumed second stage is the uninterrupted one; changed runs are noticed."""
    pr.run(case(PRESS), tmp_path / "press", quiet=True)
    text = pr.dump(case(RELEASE)) + "start: {run: press}\n"
    (tmp_path / "release.yaml").write_text(text)
    second = pr.load(tmp_path / "release.yaml")
    assert second.problem.start == pr.Start(str(tmp_path / "press"))
    assert loads(pr.dump(second)) == second
    with pytest.raises(PrensaError, match="starts from the run in this folder"):
        pr.run(second, tmp_path / "press", quiet=True)
    result = pr.run(second, tmp_path / "release", quiet=True)
    from prensa.analysis import solve
    from prensa.output.checkpoint import read_checkpoint

    first = next(iter(solve(second.problem)))
    *_, last = solve(second.problem, start=first.state)
    assert np.array_equal(last.state.u, result.increment.state.u)
    assert read_checkpoint(tmp_path / "release" / "checkpoint.h5")[0] == second
    pr.run(case(replace(PRESS, increments=5)), tmp_path / "press", quiet=True)
    with pytest.raises(pr.CaseError, match="has changed since"):
        read_checkpoint(tmp_path / "release" / "checkpoint.h5")
    with pytest.raises(pr.CaseError, match=r"release.yaml:\d+:\d+: .*no folder 'pres'"):
        (tmp_path / "release.yaml").write_text(text.replace("run: press", "run: pres"))
        pr.load(tmp_path / "release.yaml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kinematics": "small"}, "has kinematics 'finite'"),
        ({"bodies": {"block": pr.Body(pr.Rectangle((4, 3), (8, 7)), STEEL)}}, "another mesh"),
        ({"bodies": {"block": pr.Body(pr.Rectangle((4, 3), (8, 6), grade="top-left"), pr.Elastic(7e4, 0.33))}}, "another mater"),
        ({"bodies": {"block": pr.Body(pr.Rectangle((4, 3), (8, 6), grade="top-left"), STEEL, "q4")}}, "element"),
    ],
)  # fmt: skip
def test_cases_that_do_not_go_together_are_refused(tmp_path, change, words):
    """The message names what differs."""
    pr.run(case(PRESS), tmp_path / "press", quiet=True)
    with pytest.raises(PrensaError, match=words):
        pr.discretise(case(RELEASE, start=pr.Start(str(tmp_path / "press")), **change).problem)


@pytest.mark.parametrize("enforcement", [pr.Penalty(), pr.Exact()], ids=lambda e: e.type)
def test_a_roller_that_turns_far_slips_from_the_start(enforcement):
    """In one increment of a whole turn, whose points would go far beyond their elements if they stuck: as in 40."""
    press = pr.Step("press", move={"t": pr.Motion(y=-0.3)}, increments=4)
    problem = pressed_block(
        press, tools={"t": pr.Circle(3.0, at=(5.0, 7.0))}, size=(10, 4), n=(20, 8), friction=pr.Coulomb(0.3),
        enforcement=enforcement,
    )  # fmt: skip
    runs = []
    for n in (1, 40):
        turn = pr.Step("turn", move={"t": pr.Motion(y=-0.3, rz=2 * np.pi)}, increments=n)
        runs.append(list(pr.solve(replace(problem, steps=(press, turn)))))
    (*_, once), (*_, often) = runs
    assert once.statistics.cutbacks == 0
    assert once.statistics.iterations <= 6
    assert once.force("t").x == pytest.approx(often.force("t").x, rel=1e-3)
    assert once.force("t").y == pytest.approx(often.force("t").y, rel=1e-3)
