"""How often intervals of a calibrated ring test hold the truth: fits of many noises, each from poor starts of its own.

``python benchmarks/coverage.py [--noises 100] [--mesh 4 3] [--truth 4 3] [--no-refine]``. A ring 18 : 9 : 6, pressed to 45 %:
twenty readings of force (1 % of reading) and bore (5 µm) that a run with known parameters predicts, with errors drawn anew
for each fit of (μ, K, n). Where the mesh of the truth is that of the fits, ``--no-refine`` shows the intervals of the readings
alone; where it is a finer one, the refit shows whether the part of the mesh makes up for it. Prints how many of the
intervals hold the truth, by the readings and with the mesh, and the processor time of a fit.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

import prensa as pr
from prensa.inverse.tables import Table
from prensa.sensitivity.parameters import with_values

MU, K, N = "friction.mu", "bodies.ring.material.flow.K", "bodies.ring.material.flow.n"
TRUTH = {MU: 0.12, K: 450.0, N: 0.25}
FACTORS = {MU: (0.4, 2.5), K: (0.5, 2.0), N: (0.5, 2.4)}  # of the truth, between which starts are drawn
ROWS, SHARE, BORE = 20, 0.01, 0.005
SEEN: dict[str, pr.Observe | str] = {
    "force": pr.Observe("die.force.y", sigma="1 % of reading"), "bore": pr.Observe("ring.left.x at y=0", sigma=BORE),
}  # fmt: skip


def ring(n: tuple[int, int]) -> pr.Problem:
    """Half of the ring with the values that are sought, on n elements."""
    metal = pr.J2(200e3, 0.3, pr.Ludwik(250, TRUTH[K], TRUTH[N]))
    return pr.Problem(
        "ring test",
        space="axisymmetric",
        bodies={"ring": pr.Body(pr.Rectangle((4.5, 3), n, origin=(4.5, 0)), metal)},
        tools={"die": pr.Plane(touching="ring.top")},
        friction=pr.Coulomb(TRUTH[MU]),
        fixed={"ring.bottom": "y"},
        steps=[pr.Step("press", move={"die": {"y": -1.35}}, increments=ROWS)],
    )


def main() -> None:
    """Fit them all and say how it went, a line of JSON at the end."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--noises", type=int, default=100)
    words.add_argument("--mesh", type=int, nargs=2, default=(4, 3))
    words.add_argument("--truth", type=int, nargs=2, default=(4, 3))
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--no-refine", dest="refine", action="store_false")
    asked = words.parse_args()
    case, rng = ring(tuple(asked.mesh)), np.random.default_rng(asked.seed)
    times = [(k + 1) / ROWS for k in range(ROWS)]
    increments = [i for i in pr.solve(ring(tuple(asked.truth)), stops=times) if min(abs(i.time - t) for t in times) < 1e-9]
    stroke, force, bore = (np.array([i.measure(m) for i in increments]) for m in ("die.uy", "die.force.y", "ring.left.x at y=0"))
    by_readings, with_mesh, runs, misfit, spent = np.zeros(3, int), np.zeros(3, int), [], [], []
    for number in range(asked.noises):
        read = {"force": force * (1 + SHARE * rng.standard_normal(ROWS)), "bore": bore + BORE * rng.standard_normal(ROWS)}
        start = {p: v * float(np.exp(rng.uniform(*np.log(FACTORS[p])))) for p, v in TRUTH.items()}
        table = Table(f"noise {number}", {"travel": -stroke, **read}, {"travel": "mm", "force": "N", "bore": "mm"})
        begun = time.process_time()
        fit = pr.calibrate(
            with_values(case, start), table, SEEN, {MU: (0.01, 0.57), K: None, N: None}, "-die.uy", refine=asked.refine,
            compare=False, told=lambda line: None,
        )  # fmt: skip
        spent.append(time.process_time() - begun)
        found = [fit.parameters[p] for p in TRUTH]
        by_readings += [p.ends[0] < true < p.ends[1] for p, true in zip(found, TRUTH.values())]
        with_mesh += [p.low < true < p.high for p, true in zip(found, TRUTH.values())]
        runs.append(fit.runs)
        misfit.append(fit.reduced)
        if (number + 1) % 10 == 0:
            print(f"{number + 1}: {by_readings} by the readings, {with_mesh} with the mesh, {np.mean(spent):.1f} s", flush=True)
    print(json.dumps({
        "noises": asked.noises, "by_readings": by_readings.tolist(), "with_mesh": with_mesh.tolist(),
        "runs": float(np.mean(runs)), "reduced": float(np.mean(misfit)), "seconds": float(np.mean(spent)),
    }))  # fmt: skip


if __name__ == "__main__":
    main()
