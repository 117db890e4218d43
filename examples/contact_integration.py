"""Where to integrate contact, and how to read its stress: the open problem of the founding paper, seen and cured.

The paper integrated the penalty terms at all Gauss points, found "inadmissible" contact stresses, found one point
"incorrect", and took the stresses of the interior, extrapolated and smoothed. Its two examples, on meshes of its size
(178 and 220 elements) and with its own penalty, read in every way; then all rules × penalties against the elastic layer.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from common import beside, figure, judged, options, saved

import prensa as pr
from prensa.errors import SolveError
from prensa.output import style
from prensa.reference import LayerLine, hertz_line, layer_line, tables
from prensa.result.increment import ContactState
from prensa.verify import example2, friction, rules
from prensa.verify.example1 import NU, E, H, R
from prensa.verify.table import Row, row
from prensa_bench.robustness import draw

K_N = 1e9  # N/mm³: the paper's 10E+9, read with its MPa and cm
DEPTHS = (0.25, 0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True)
class Stage:
    """A contact at a depth, beside the layer at that depth."""

    contact: ContactState
    layer: LayerLine
    force: float


def mesh_178() -> pr.Points:
    """Half of the block with 178 elements, fine under the cylinder: 16 × 11, and the lower right one cut into three."""
    x = np.concatenate([np.linspace(0, 15, 11), 15 + np.cumsum(65 * 1.7 ** np.arange(6) / (1.7 ** np.arange(6)).sum())])
    y = H * (1 - np.concatenate([[0], np.cumsum(1.2 ** np.arange(11) / (1.2 ** np.arange(11)).sum())]))[::-1]
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    node = np.arange(12 * 17).reshape(12, 17)
    whole = rules.points_mesh(grid, {"bottom": node[0], "left": node[:, 0], "top": node[-1]})
    points, cells, names = list(whole.points), list(whole.cells), dict(whole.boundaries)
    a, b, c, d = cells[15]  # lower left, lower right, upper right, upper left
    at, n = np.array(points), len(points)
    for middle in (at[[a, b]], at[[b, c]], at[[a, b, c, d]]):
        points.append(tuple(middle.mean(axis=0).tolist()))
    cells[15:16] = [(a, n, n + 2, d), (n, b, n + 1, n + 2), (n + 2, n + 1, c, d)]
    return replace(
        whole, points=tuple(points), cells=tuple(cells), boundaries=names | {"bottom": (*names["bottom"], n)}
    )


def pressed(integration: str, k_n: float | None) -> list[Stage]:
    """Example 1 on 178 elements at all depths, linear Signorini."""
    enforcement = pr.Penalty(k_n=k_n) if k_n else pr.Penalty()
    problem = pr.Problem(
        "cylinder on a block", kinematics="small", contact_geometry="reference",
        bodies={"block": pr.Body(mesh_178(), pr.Elastic(E, NU), "q4")},
        tools={"cylinder": pr.Circle(radius=R, touching="block.top")},
        contacts=(pr.Contact("block.top", "cylinder", enforcement=enforcement, integration=integration),),  # type: ignore[arg-type]
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=tuple(pr.Step(f"to {d:g}", move={"cylinder": pr.Motion(y=-d)}, increments=1) for d in DEPTHS),
    )  # fmt: skip
    ends = (
        inc for inc in pr.solve(problem) if inc.end_of_step
    )  # more constraints than nodes need a cut here and there
    return [
        Stage(
            inc.contacts["block.top-cylinder"], layer_line(R=R, H=H, E=E, nu=NU, delta=d), 2 * inc.force("cylinder").y
        )
        for d, inc in zip(DEPTHS, ends, strict=True)
    ]


def ring(integration: str, enforcement: pr.Penalty) -> ContactState:
    """Example 2 on 22 × 10 = 220 elements."""
    p = example2.problem((22, 10), 20.0, 10.0, 4.0, 1.0)
    contact = replace(p.contacts[0], integration=integration, enforcement=enforcement)  # type: ignore[arg-type]
    return list(pr.solve(replace(p, contacts=(contact,))))[-1].contacts["disc.top-ring"]


# -------------------------------------------------------------------------------------------------------------- rows
def paper(found: list[Stage], ours: list[Stage]) -> Iterator[Row]:
    """Peak pressure and force on 178 elements: what the paper's settings give, what nodal ones do."""
    for d, s, o in zip(DEPTHS, found, ours):
        if d < 1:
            continue
        yield beside(
            f"δ = {d:g} mm: largest p at the paper's points (MPa)", s.layer.p0, s.contact.points.pressure.max()
        )
        yield row("  largest smoothed σ·n, the paper's way out", s.layer.p0, s.contact.pressure_smoothed.max(), 0.08)
        yield row("  largest p from nodal forces, nodal rule, β = 100", s.layer.p0, o.contact.pressure.max(), 0.02)
        yield row("  force, nodal rule (N/mm)", s.layer.P, o.force, 0.01)


def table(quick: bool) -> Iterator[Row]:
    """RMS errors over p0 of all rules and penalties beside the recorded ones."""
    for rule, recorded in rules.RECORDED.items():
        if quick and rule not in ("nodal", "gauss2"):
            continue
        for beta, pair in zip(rules.BETAS, recorded):
            found = rules.outcome(rules.pressed(rule, pr.Penalty(beta=beta)))
            for where, reference, value in zip(("points", "nodes"), pair, (found.at_points, found.at_nodes)):
                yield row(f"{rule}, β = {beta:g}: RMS error at the {where} (% of p0)", reference, 100 * value, 1 / 3)


def solved(problem: pr.Problem, iteration: str) -> tuple[float, int]:
    """Share of the history that an iteration gets through, and the iterations that it took."""
    reached, spent = 0.0, 0
    numerics = pr.Numerics(iteration=iteration, max_cutbacks=3)  # type: ignore[arg-type]
    with contextlib.suppress(SolveError):
        for inc in pr.solve(problem, numerics):
            reached, spent = inc.time / len(problem.steps), spent + inc.statistics.iterations
    return reached, spent


def iterations(count: int) -> Iterator[Row]:
    """Newton beside the paper's iteration (symmetric matrix, pressure of the last iterate in the friction)."""
    plate = friction.plate(16, 1.0, 1.0)
    (reached, _), (theirs, _) = solved(plate, "newton"), solved(plate, "paper")
    yield row("plate pushed on a plane, μ = 1: share of the history, Newton", 1.0, reached, 1e-12)
    yield beside("  the paper's iteration", 1.0, theirs)
    for suite in ("elastic", "plastic")[: 1 if count < 8 else 2]:
        n = count if suite == "elastic" else count // 4
        ours, paper = ([solved(draw(suite, 0, k), i) for k in range(n)] for i in ("newton", "paper"))
        both = [k for k in range(n) if ours[k][0] == paper[k][0] == 1.0]
        yield beside(f"{n} random {suite} problems solved: Newton", n, sum(v[0] == 1.0 for v in ours))
        yield beside("  the paper's iteration", n, sum(v[0] == 1.0 for v in paper))
        yield beside(
            "  iterations where both get through: Newton, paper",
            sum(ours[k][1] for k in both),
            sum(paper[k][1] for k in both),
        )


# ---------------------------------------------------------------------------------------------------------- pictures
def profiles(found: list[Stage], ours: list[Stage], path: Path) -> None:
    """The paper's figure 3 in three readings: at its points, smoothed, from nodal forces."""
    with style.styled():
        made, axes = figure(8.6, 3.6, columns=2, sharey=False)
        for ax, k in zip(axes, (1, 4)):
            s, o = found[k], ours[k]
            round_tip = np.sin(np.linspace(0, np.pi / 2, 200))  # dense where the pressure falls steeply
            hertz = hertz_line(s.layer.P, R, E, NU)
            order = np.argsort(s.contact.X[:, 0])
            X = s.contact.X[order, 0]
            q = np.argsort(s.contact.points.X[:, 0])
            for name, line, a, p in (
                ("elastic layer", "-", s.layer.a, s.layer.pressure),
                ("Hertz, same force", "--", hertz.a, hertz.pressure),
            ):
                ax.plot(a * round_tip, p(a * round_tip), line, color=style.BLACK, linewidth=0.9, label=name)
            ax.plot(s.contact.points.X[q, 0], s.contact.points.pressure[q], "x-", color=style.RED, linewidth=0.6,
                    label="at the Gauss points, paper's $k_n$")  # fmt: skip
            ax.plot(
                X,
                s.contact.pressure_smoothed[order],
                "s:",
                color=style.PURPLE,
                markersize=3,
                label="interior stress, smoothed",
            )
            ax.plot(X, o.contact.pressure[order], "o", color=style.BLUE, label="nodal forces, nodal rule, β = 100")
            ax.set(
                xlim=(0, 1.4 * s.layer.a),
                ylim=(-0.3 * s.layer.p0, 2.2 * s.layer.p0),
                xlabel="x (mm)",
                ylabel="pressure (MPa)",
            )
            ax.set_title(f"Example 1, δ = {DEPTHS[k]:g} mm, 178 elements")
        axes[1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    saved(made, path)


def depths(found: list[Stage], ours: list[Stage], path: Path) -> None:
    """The paper's figure 4: peak pressure by depth; Hertz departs from the layer, not from the mesh alone."""
    with style.styled():
        made, axes = figure(5.4, 3.4)
        fine = 2.1 * np.linspace(0.05, 1.0, 25) ** 2
        layers = [layer_line(R=R, H=H, E=E, nu=NU, delta=float(d)) for d in fine]
        axes.plot(fine, [s.p0 for s in layers], color=style.BLACK, linewidth=1.0, label="elastic layer")
        axes.plot(
            fine,
            [hertz_line(s.P, R, E, NU).p0 for s in layers],
            "--",
            color=style.BLACK,
            linewidth=0.8,
            label="Hertz, same force",
        )
        axes.plot(
            DEPTHS,
            [s.contact.points.pressure.max() for s in found],
            "x",
            color=style.RED,
            label="largest at the Gauss points, paper's $k_n$",
        )
        axes.plot(
            DEPTHS,
            [s.contact.pressure_smoothed.max() for s in found],
            "s",
            color=style.PURPLE,
            markersize=3,
            label="interior stress, smoothed",
        )
        axes.plot(
            DEPTHS, [s.contact.pressure.max() for s in ours], "o", color=style.BLUE, label="nodal forces, nodal rule"
        )
        axes.set(xlabel="depth δ (mm)", ylabel="largest pressure (MPa)", xlim=(0, 2.1), ylim=(0, 2000))
        axes.set_title("Peak pressure by depth")
        axes.legend(loc="upper left", fontsize=7)
    saved(made, path)


def ring_picture(path: Path) -> None:
    """The paper's figure 6 on 220 elements."""
    gauss, nodal = ring("gauss2", pr.Penalty(k_n=K_N)), ring("nodal", pr.Penalty())
    layer = tables.ring_stamp_pressure("layer_smooth_base")
    with style.styled():
        made, axes = figure(5.8, 3.6)
        mean = float((nodal.pressure * nodal.weight).sum() / (np.pi * (12.0**2 - 8.0**2)))
        axes.plot(layer["r"], layer["p_over_mean"], color=style.BLACK, linewidth=1.0, label="layer")
        for c, y, mark, colour, name in (
            (gauss.points, gauss.points.pressure, "x", style.RED, "at the Gauss points, paper's $k_n$"),
            (gauss, gauss.pressure_smoothed, "s:", style.PURPLE, "interior stress, smoothed"),
            (nodal, nodal.pressure, "o", style.BLUE, "nodal forces, nodal rule"),
        ):
            order = np.argsort(c.X[:, 0])
            axes.plot(c.X[order, 0], y[order] / mean, mark, color=colour, markersize=4, linewidth=0.8, label=name)
        axes.set(
            xlim=(7, 13),
            ylim=(-0.2, 4),
            xlabel="r (mm)",
            ylabel="pressure over its mean",
            title="Example 2, 220 elements",
        )
        axes.legend(loc="upper center", fontsize=7)
    saved(made, path)


def bars(found: Sequence[Row], path: Path) -> None:
    """The table of rules and penalties, logarithmic."""
    with style.styled():
        made, axes = figure(7.6, 3.2, columns=2, sharey=True)
        for ax, where in zip(axes, ("points", "nodes")):
            chosen = [r for r in found if f"at the {where}" in r.quantity]
            names = list(dict.fromkeys(r.quantity.split(",")[0] for r in chosen))
            for k, (beta, colour) in enumerate(zip(rules.BETAS, (style.SKY, style.BLUE, style.RED))):
                rows = [next(r for r in chosen if r.quantity.startswith(f"{n}, β = {beta:g}:")) for n in names]
                at = np.arange(len(names)) + 0.27 * (k - 1)
                ax.bar(at, [r.ours for r in rows], 0.25, color=colour, label=f"β = {beta:g}")
                ax.plot(at, [r.reference for r in rows], "_", color=style.BLACK, label=None if k else "recorded")
            ax.set_xticks(range(len(names)), names)
            ax.set(yscale="log", title={"points": "p at the integration points", "nodes": "p from nodal forces"}[where])
        axes[0].set_ylabel("RMS error (% of p0)")
        axes[0].legend(loc="upper left")
    saved(made, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Solve both examples, then the table; returns the exit code."""
    chosen = options(__doc__, "contact_integration", argv)
    found, ours = pressed("gauss2", K_N), pressed("nodal", None)
    failed = judged("Example 1 on 178 elements, beside the elastic layer", list(paper(found, ours)))
    measured = list(table(chosen.quick))
    failed += judged("Rules × penalties, 16 contact elements, beside the recorded figures", measured)
    failed += judged("Newton beside the paper's iteration", list(iterations(4 if chosen.quick else 24)))
    profiles(found, ours, chosen.out / "example1.png")
    depths(found, ours, chosen.out / "depth.png")
    ring_picture(chosen.out / "example2.png")
    bars(measured, chosen.out / "rules.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
