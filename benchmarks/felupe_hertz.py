"""The Hertz block in felupe, run by the interpreter of an environment that has it; reads a mesh that ``run.py`` wrote.

``python benchmarks/felupe_hertz.py MESH.npz SUBSTEPS [DEPTH]``: plain Q4 in plane strain, the same neo-Hooke energy,
penalty contact with a rigid cylinder. felupe is GPL and no dependency of prensa: it runs as a process of its own.
"""

from __future__ import annotations

import json
import sys
import time


def main(path: str, substeps: int, depth: float = 8.0) -> None:
    """Print a line of JSON: processor seconds, of an iteration too, force of the whole block at the end of every substep."""
    try:
        import felupe as fem
    except ImportError:
        print(json.dumps({"skipped": "felupe is not installed (pip install felupe, in an environment of its own)"}))
        return
    import numpy as np
    from scipy.sparse.linalg import spsolve

    data = np.load(path)
    start = time.process_time()
    mesh = fem.Mesh(data["X"], data["cells"], "quad")
    mesh.add_points([0.0, 120.0])
    centre = len(data["X"])
    region = fem.RegionQuad(mesh)
    field = fem.FieldContainer([fem.FieldPlaneStrain(region, dim=2)])
    u = field[0]
    E, nu = 10_000.0, 0.3
    law = fem.NeoHookeCompressible(mu=E / (2 * (1 + nu)), lmbda=E * nu / ((1 + nu) * (1 - 2 * nu)))
    body = fem.SolidBody(law, field)
    contact = fem.ContactRigidCylinder(
        field=field, points=data["top"], centerpoint=centre, radius=80.0, multiplier=100.0, items=[body]
    )
    held = {
        "bottom": fem.Boundary(u, mask=np.isin(np.arange(mesh.npoints), data["bottom"]), skip=(1, 0)),
        "left": fem.Boundary(u, mask=np.isin(np.arange(mesh.npoints), data["left"]), skip=(0, 1)),
        "across": fem.Boundary(u, mask=np.arange(mesh.npoints) == centre, skip=(0, 1)),
        "move": fem.Boundary(u, mask=np.arange(mesh.npoints) == centre, skip=(1, 0)),
    }
    depths = np.linspace(0.0, depth, substeps + 1)[1:]
    step = fem.Step([body, contact], ramp={held["move"]: -depths}, boundaries=held)
    forces, iterations, solved = [], [], []

    def solver(A: object, b: object) -> object:
        """Solve as felupe does unless told otherwise, and note when."""
        x = spsolve(A, b)
        solved.append(time.process_time())
        return x

    def after(i: int, j: int, substep: object) -> None:
        forces.append(2.0 * float(fem.tools.force(field, substep.fun, held["bottom"])[1]))
        iterations.append(int(substep.iterations))

    ended = "completed"
    try:
        fem.Job([step], callback=after).evaluate(verbose=0, solver=solver)
    except Exception as error:
        ended = f"{type(error).__name__}: {error}"
    print(
        json.dumps({
            "seconds": time.process_time() - start, "ended": ended, "depth": depths[: len(forces)].tolist(),
            "force": forces, "iterations": sum(iterations),
            "iteration": float(np.median(np.diff(solved))), "version": fem.__version__,
        })
    )  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), *(float(a) for a in sys.argv[3:4]))
