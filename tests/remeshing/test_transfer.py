"""Transfer of a state to new meshes: homogeneous and linear states exactly, the same after a turn, and nothing lost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import prensa as pr
from prensa.policy import Policy
from prensa.remeshing import driver
from prensa.remeshing.driver import balanced
from prensa.remeshing.renewal import carried_over, renewed
from prensa.remeshing.transfer import carried, elastic_volume, exponential, logarithm
from prensa.solver.reporting import Messages
from prensa.solver.time_stepping import TimeStepping
from prensa.system.assembly import Block
from prensa.system.discretise import discretise
from prensa.system.state import State
from prensa.system.system import System
from prensa.timer import Timer
from problems import single_block, stroke

J2 = pr.J2(E=200e3, nu=0.3, flow=pr.Ludwik(s0=250.0, K=500.0, n=0.3))


def upsetting(mu: float, space: str = "axisymmetric", to: float = -1.5) -> pr.Problem:
    """A billet of 10 × 7.5 mm between flat dies."""
    return single_block(
        stroke(to, tool="punch"), tools={"punch": pr.Plane(touching="billet.top")}, material=J2, size=(10.0, 7.5),
        n=(8, 6), element="t6", body="billet",
        fixed={"billet.bottom": pr.Fixed(y="held"), "billet.left": pr.Fixed(x="held")}, friction=pr.Coulomb(mu=mu),
        space=space, remesh=pr.Remesh(size=pr.Sizes(far=1.5)),
    )  # fmt: skip


def pressed(problem: pr.Problem, until: float) -> tuple[System, State, Any]:
    """System, state and increment of a problem without remeshing, at the first increment from a time on."""
    system = discretise(replace(problem, remesh="off"))
    for increment in pr.solve(system):
        if increment.time >= until:
            break
    return discretise(problem), increment.state, increment


def sizes(system: System, state: State) -> Any:
    """Elements of about 1.3 mm everywhere."""
    return lambda body: lambda x: np.full(len(x), 1.3)


def stepping(system: System) -> TimeStepping:
    return TimeStepping(system, pr.Numerics(), Policy(), Messages(system, None), Timer(), False)


def force(system: System, state: State) -> float:
    """Force on the punch of a state in equilibrium: what moves it."""
    return float(state.work[system.tool_dof(0) + 1])


@pytest.fixture(scope="module")
def rubbed() -> tuple[System, State, Any]:
    return pressed(upsetting(0.1), 0.9)


def volume(block: Block, x: np.ndarray) -> float:
    """By Green's theorem along the outline of T6: ∮ x dy, 2π ∮ x²/2 dy in axisymmetry, exact for quadratic sides."""
    from prensa.mesh.mesh import boundary_edges

    edges = boundary_edges(block.cells)
    t, w = np.polynomial.legendre.leggauss(5)
    t, w = 0.5 * (t + 1), 0.5 * w
    N = np.stack([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
    dN = np.stack([4 * t - 3, 4 * t - 1, 4 - 8 * t])
    r = np.einsum("aq,ka->kq", N, x[edges][..., 0])
    dy = np.einsum("aq,ka->kq", dN, x[edges][..., 1])
    return float(((np.pi * r**2 if block.mode.axisymmetric else r) * dy * w).sum())


def test_a_homogeneous_state_stays_what_it_is_on_any_mesh() -> None:
    """Without friction: b_e within 1e-7, the force after equilibrium within 1e-5."""
    system, state, _ = pressed(upsetting(0.0), 0.9)
    new, there = renewed(system, state, ["billet"], sizes(system, state))
    b, old = there.history[0][..., :4], state.history[0][..., :4]
    assert len(there.history[0]) != len(state.history[0])
    assert np.abs(b - old.mean(axis=(0, 1))).max() < 1e-7
    there, _ = balanced(stepping(new), there)
    assert force(new, there) == pytest.approx(force(system, state), rel=1e-5)


def test_what_only_grows_keeps_its_mean(rubbed: tuple[System, State, Any]) -> None:
    """Plastic strain and work of a rubbed billet, integrated over initial volumes, on coarser and finer meshes: 1e-5."""
    system, state, _ = rubbed
    for size in (2.5, 0.9):
        new, there = renewed(system, state, ["billet"], lambda body, h=size: lambda x: np.full(len(x), h))  # type: ignore[misc]
        for name in ("plastic_strain", "plastic_work"):
            before, after = (
                float(s.blocks[0].volume.ravel() @ s.blocks[0].field(t.history[0], name).ravel())
                for s, t in ((system, state), (new, there))
            )
            assert after == pytest.approx(before, rel=1e-5)


def test_linear_fields_are_carried_over_exactly() -> None:
    """Logarithmic strains that are linear in the place, a mesh of other elements: within 1e-12."""
    body = pr.Body(pr.Rectangle(size=(10.0, 7.5), n=(8, 6)), pr.Elastic(E=1e3, nu=0.3), "t6")
    problem = replace(upsetting(0.0), remesh="off", bodies={"billet": body})
    system = discretise(problem)
    block, rng = system.blocks[0], np.random.default_rng(1)
    a, b = 1e-2 * rng.normal(size=(2, 4)), 1e-2 * rng.normal(size=4)

    def strain(x: np.ndarray) -> np.ndarray:
        return x @ a / 10.0 + b

    points = rng.uniform([0, 0], [10.0, 7.5], (50, 3, 2))
    new = carried(block, system.X, exponential(strain(block.positions(system.X))), points)
    assert np.abs(logarithm(new) - strain(points)).max() < 1e-12


def test_a_turn_of_body_and_mesh_commutes_with_the_transfer(rubbed: tuple[System, State, Any]) -> None:
    """A rotated state on a rotated mesh is the rotated one: within 1e-10."""
    system, state, _ = rubbed
    block, x = system.blocks[0], system.positions(state.u)
    rng = np.random.default_rng(2)
    lower, upper = x.min(axis=0) + 0.1, x.max(axis=0) - 0.7
    points = rng.uniform(lower, upper, (60, 3, 2))
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, s], [-s, c]])  # of rows

    def turned(history: np.ndarray) -> np.ndarray:
        out = history.copy()
        for first in (0, 6):  # elastic and trial strains
            B = history[..., [[first, first + 3], [first + 3, first + 1]]]
            B = np.einsum("ji,...jk,kl->...il", R, B, R)
            out[..., first], out[..., first + 1], out[..., first + 3] = B[..., 0, 0], B[..., 1, 1], B[..., 0, 1]
        return out

    plain = carried(block, x, state.history[0], points)
    assert np.abs(carried(block, x @ R, turned(state.history[0]), points @ R) - turned(plain)).max() < 1e-10


def test_the_same_mesh_gives_the_same_state(rubbed: tuple[System, State, Any]) -> None:
    """Histories, force and places on the mesh that was there: within 1e-6."""
    system, state, _ = rubbed
    from prensa.mesh.mesh import displaced

    meshes = {"billet": displaced(system.meshes["billet"], system.positions(state.u))}
    new, there = carried_over(system, state, meshes, ["billet"])
    assert np.abs(new.positions(there.u) - system.positions(state.u)).max() < 1e-6 * system.length
    assert np.abs(there.history[0] - state.history[0]).max() < 1e-9
    assert new.blocks[0].volume == pytest.approx(system.blocks[0].volume, rel=1e-4)
    assert new.blocks[0].volume.sum() == pytest.approx(system.blocks[0].volume.sum(), rel=1e-6)
    there, _ = balanced(stepping(new), there)
    assert force(new, there) == pytest.approx(force(system, state), rel=1e-6)
    assert there.history[0] == pytest.approx(state.history[0], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("space", ["axisymmetric", "plane strain"])
def test_little_is_lost_on_a_new_mesh(space: str) -> None:
    """Initial volume 1e-5, volume 1e-4, plastic work 5e-4; the force after the next increment 0.5 % of that on the old mesh."""
    system, state, _ = pressed(upsetting(0.1, space), 0.7)
    new, there = renewed(system, state, ["billet"], sizes(system, state))
    there, _ = balanced(stepping(new), there)
    old_block, block = system.blocks[0], new.blocks[0]
    assert block.volume.sum() == pytest.approx(old_block.volume.sum(), rel=1e-5)
    assert volume(block, new.positions(there.u)) == pytest.approx(volume(old_block, system.positions(state.u)), rel=1e-4)
    assert new.plastic_work(there.history) == pytest.approx(system.plastic_work(state.history), rel=5e-4)
    forces = [next(stepping(s).run(at)).force("punch").y for s, at in ((system, state), (new, there))]
    assert forces[1] == pytest.approx(forces[0], rel=5e-3)
    assert elastic_volume(there.history[0]).max() < 1.0


def test_in_no_time_nothing_flows_or_slides(rubbed: tuple[System, State, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Equilibrium on a new mesh leaves plastic strains and slips; where it is not found so, metal flows: the forces are alike."""
    system, state, _ = rubbed
    new, there = renewed(system, state, ["billet"], sizes(system, state))
    rested, message = balanced(stepping(new), there)
    assert message.endswith("iterations")
    assert (rested.history[0][..., 4] == there.history[0][..., 4]).all()
    assert (rested.contact.slip == there.contact.slip).all()
    real, tried = driver.attempt_from, []

    def refused(eq: Any, u: np.ndarray) -> Any:
        tried.append(real(eq, u))
        if len(tried) == 1:
            tried[0].converged = False
        return tried[-1]

    monkeypatch.setattr(driver, "attempt_from", refused)
    flown, message = balanced(stepping(new), there)
    assert message.endswith("with flow")
    assert not (flown.history[0][..., 4] == there.history[0][..., 4]).all()
    assert force(new, rested) == pytest.approx(force(system, state), rel=5e-4)
    assert force(new, flown) == pytest.approx(force(system, state), rel=5e-3)


def test_the_state_after_a_remeshing_is_on_the_tools(rubbed: tuple[System, State, Any]) -> None:
    """Closed nodes lie where their pressures put them, open ones outside, supports hold, displacements count from the start."""
    system, state, _ = rubbed
    new, there = renewed(system, state, ["billet"], sizes(system, state))
    s, gaps = new.surfaces[0], new.stencils(new.surfaces[0], there.u).g
    closed = there.contact.closed
    assert gaps[closed] == pytest.approx(-there.lam[closed, 0] / s.scale(np.zeros(len(s.points))).k_n[closed], rel=2e-2)
    assert gaps[~closed].min() >= -1e-12
    assert np.abs(new.displacement(there.u)[new.boundary_nodes("billet.bottom"), 1]).max() < 1e-13
    assert np.abs(new.X[new.boundary_nodes("billet.left"), 0]).max() < 1e-12
    top, x = new.boundary_nodes("billet.top"), new.positions(there.u)
    assert new.X[top, 1] == pytest.approx(7.5, abs=1e-2)
    assert x[:, 1].max() < 6.7
