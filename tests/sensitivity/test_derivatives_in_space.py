"""Derivatives in space: bricks, contact by penalty and Coulomb friction with two tangents, against differences of whole runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.sensitivity.adjoint import OnlyForwards, gradient

STEP = 2e-4
"""Share of a parameter by which runs are compared, between round-off and what is not linear."""


def slid(mu: float = 0.3, K: float = 600.0, press: float = -0.1, slide: float = 0.1) -> pr.Problem:
    """A block on a support, pressed by a plate that then slides along neither axis: points stick and slip."""
    steel = pr.J2(200e3, 0.3, pr.Swift(K=K, e0=0.01, n=0.2))
    return pr.Problem(
        "block", space="solid", friction=pr.Coulomb(mu), bodies={"b": pr.Body(pr.Box((4.0, 4.0, 4.0), (2, 2, 2)), steel)},
        tools={"t": pr.Plane(touching="b.top")}, contacts=(pr.Contact("b.top", "t"),), fixed={"b.bottom": "xyz"},
        steps=(
            pr.Step("press", move={"t": pr.Motion(y=press)}, increments=2),
            pr.Step("slide", move={"t": pr.Motion(x=slide, z=0.05)}, increments=2),
        ),
    )  # fmt: skip


def pressed(mu: float = 0.3, K: float = 600.0, force: float = -8000.0) -> pr.Problem:
    """An eighth of a billet below a plate that is pushed: the plate is an unknown of the linear systems."""
    p = slid(mu, K)
    held = {"b.bottom": "y", "b.left": "x", "b.back": "z"}
    return replace(p, fixed=held, steps=(pr.Step("press", push={"t": pr.Push(y=force)}, increments=2),))


def compared(
    make: type[pr.Problem] | object, values: Sequence[float], paths: Sequence[str], measures: Sequence[str], solver: str
) -> None:  # fmt: skip
    """Hold derivatives of measures of all increments against differences of runs at the same times, to 1e-6 of the largest."""
    assert callable(make)
    numerics = pr.Numerics(solver=solver, tolerance=1e-12)
    run = list(pr.solve(make(*values), numerics, derivatives=paths))
    times = [i.time for i in run]
    for k, path in enumerate(paths):
        beside = []
        for sign in (1.0, -1.0):
            there = list(values)
            there[k] *= 1.0 + sign * STEP
            beside.append(list(pr.solve(make(*there), numerics, times=times)))
        ours = np.array([[i.derivative(m)[path] for m in measures] for i in run])
        differences = np.array([[(a.measure(m) - b.measure(m)) for m in measures] for a, b in zip(*beside)])
        differences /= 2.0 * STEP * values[k]
        assert np.abs(ours).max() > 0.0
        np.testing.assert_allclose(ours, differences, rtol=1e-6, atol=1e-6 * np.abs(differences).max(), err_msg=path)


@pytest.mark.parametrize("solver", ["superlu", "ldlt", "multigrid"])
def test_derivatives_in_space_are_those_of_whole_runs(solver: str) -> None:
    """Forces along three axes by friction, flow curve and both motions of the tool, through steps that stick and slide."""
    paths = ["friction.mu", "bodies.b.material.flow.K", "steps.0.move.t.y", "steps.1.move.t.x"]
    some = len(paths) if solver == "superlu" else 1
    compared(slid, (0.3, 600.0, -0.1, 0.1), paths[:some], ["t.force.x", "t.force.y", "t.force.z"], solver)


def test_derivatives_of_friction_on_areas_that_grow() -> None:
    """Forces by a shear factor and by the flow curve that the shear yield stress follows, too."""

    def sheared(m: float, K: float) -> pr.Problem:
        return replace(slid(K=K), friction=pr.Shear(m))

    paths = ["friction.m", "bodies.b.material.flow.K"]
    compared(sheared, (0.4, 600.0), paths, ["t.force.x", "t.force.y", "t.force.z"], "superlu")


def test_a_pushed_tool_goes_further_by_what_its_derivative_says() -> None:
    """Travel of a tool that is driven by force, by that force, friction and the flow curve."""
    paths = ["friction.mu", "bodies.b.material.flow.K", "steps.0.push.t.y"]
    compared(pressed, (0.3, 600.0, -8000.0), paths, ["t.travel.y"], "superlu")


@pytest.mark.parametrize("way", ["slid", "pressed"])
def test_derivatives_of_exact_contact_in_space(way: str) -> None:
    """The same with three multipliers to a point, those of nodes on planes of symmetry among them."""
    exact = (pr.Contact("b.top", "t", enforcement=pr.Exact()),)
    if way == "slid":
        paths, measures = ["friction.mu", "steps.1.move.t.x"], ["t.force.x", "t.force.y", "t.force.z"]
        compared(lambda mu, x: replace(slid(mu, slide=x), contacts=exact), (0.3, 0.1), paths, measures, "superlu")
    else:
        paths = ["friction.mu", "bodies.b.material.flow.K"]
        compared(lambda mu, K: replace(pressed(mu, K), contacts=exact), (0.3, 600.0), paths, ["t.travel.y"], "superlu")


def test_backwards_is_refused_in_space() -> None:
    """The adjoint has no transposed bricks: it refers to derivatives forwards."""
    with pytest.raises(OnlyForwards, match=r"use solve\(derivatives"):
        gradient(slid(), "t.force.y", ["friction.mu"])
    assert issubclass(OnlyForwards, PrensaError)


def tilted(mu: float = 0.3, K: float = 600.0, force: float = -8000.0) -> pr.Problem:
    """A block under a plate that is pushed beside its middle and free to tilt about two axes."""
    p = slid(mu, K)
    plate, free = pr.Plane(touching="b.top", at=(1.6, 4.0, 2.2)), pr.Push(y=force, mx=0.0, mz=0.0)
    return replace(p, tools={"t": plate}, steps=(pr.Step("press", push={"t": free}, increments=2),))


def turned(mu: float = 0.3, K: float = 600.0, press: float = -0.1) -> pr.Problem:
    """A block under a plate that turns about the upright axis."""
    p = slid(mu, K)
    plate = pr.Plane(touching="b.top", at=(2.0, 4.0, 2.0))
    press_it = pr.Step("press", move={"t": pr.Motion(y=press)}, increments=2)
    steps = (press_it, pr.Step("turn", by={"t": pr.Motion(ry=0.05)}, increments=2))
    return replace(p, tools={"t": plate}, steps=steps)


def test_turns_moments_and_sizes_of_tools_have_derivatives() -> None:
    """All six motions and forces of a tool, and the length of a force that has three components."""
    compared(tilted, (0.3, 600.0, -8000.0), ("friction.mu", "bodies.b.material.flow.K"), ("t.rz", "t.rx", "t.uy"), "superlu")
    measures = ("t.my", "t.moment.y", "t.rotation.y", "t.force")
    compared(turned, (0.3, 600.0, -0.1), ("friction.mu", "bodies.b.material.flow.K"), measures, "superlu")
    compared(slid, (0.3, 600.0, -0.1, 0.1), ("friction.mu",), ("t.force", "t.mz"), "superlu")
