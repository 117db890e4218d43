"""Draw ``guide/pictures/teeth.png``: what landing nodes do to the derivative of a force, from runs of an upset billet."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

import prensa as pr
from prensa.sensitivity.parameters import with_values

PAGE = Path(__file__).parent / "guide" / "pictures" / "teeth.png"
MU, LANDED = "friction.mu", "#b8442b"
TIMES = np.linspace(0.0, 1.0, 101)[1:]


def billet(mu: float, elements: tuple[int, int]) -> pr.Problem:
    """Half of a billet between flat dies, to 40 % of its height; its side is part of the contact and folds onto the die."""
    return pr.Problem(
        "upsetting",
        space="axisymmetric",
        bodies={"billet": pr.Body(pr.Rectangle((10, 7.5), elements), pr.J2(200e3, 0.3, pr.Ludwik(250, 500, 0.3)))},
        tools={"die": pr.Plane(touching="billet.top")},
        contacts=[pr.Contact(("billet.top", "billet.right"), "die")],
        friction=pr.Coulomb(mu),
        fixed={"billet.bottom": "y", "billet.left": "x"},
        steps=[pr.Step("press", move={"die": {"y": -3.0}})],
    )


def slopes(problem: pr.Problem) -> tuple[list[float], list[float], list[bool]]:
    """Reductions, d ln F/d ln μ as derived, and whether points land or lift in an increment."""
    reductions, found, landed = list[float](), list[float](), list[bool]()
    mu = problem.friction.mu  # type: ignore[union-attr]
    for increment in pr.solve(problem, stops=TIMES, derivatives=[MU]):
        reductions.append(40.0 * increment.time)
        found.append(increment.derivative("die.force.y")[MU] * mu / increment.force("die").y)
        assert increment.derivatives is not None
        landed.append(any(increment.derivatives.switched.values()))
    return reductions, found, landed


def secants(problem: pr.Problem, share: float) -> list[float]:
    """The same as secants over a share of μ to both sides."""
    mu = problem.friction.mu  # type: ignore[union-attr]
    both = []
    for sign in (1.0, -1.0):
        beside = with_values(problem, {MU: mu * (1.0 + sign * share)})
        increments = [i for i in pr.solve(beside, stops=TIMES) if np.abs(TIMES - i.time).min() < 1e-9]
        both.append([np.log(i.force("die").y) for i in increments])
    return [float((a - b) / (2.0 * share)) for a, b in zip(*both)]


def main(elements: Sequence[int] = (24, 18)) -> None:
    """Write the picture."""
    fig, axes = plt.subplots(2, 1, figsize=(7.5, 6.2), sharex=True, layout="constrained")
    for ax, mu in zip(axes, (0.1, 0.3)):
        problem = billet(mu, (elements[0], elements[1]))
        reduction, exact, landed = slopes(problem)
        ax.plot(reduction, exact, color="#1f5fa8", lw=1.4, label="derivative of the mesh, exact")
        over = secants(problem, 0.1)
        print(f"mu {mu}, at 20 %: derivative {np.interp(20.0, reduction, exact):.3f}, secant {over[49]:.3f}")
        ax.plot(40.0 * TIMES, over, color="#2d7d46", lw=1.4, ls="--", label="secant over ± 10 % of μ")
        for at in np.array(reduction)[1:][landed[1:]]:
            ax.axvline(at, color=LANDED, lw=0.6, alpha=0.6)
        ax.plot([], [], color=LANDED, lw=0.6, label="a node lands or lifts")
        ax.set(title=f"μ = {mu}", ylabel="d ln F / d ln μ")
        ax.spines[["top", "right"]].set_visible(False)
    axes[1].legend(frameon=False, loc="upper left")
    axes[1].set_xlabel("reduction of height (%)")
    fig.savefig(PAGE, dpi=110)


if __name__ == "__main__":
    main([int(n) for n in sys.argv[1:]] or (24, 18))
