"""What a run in space is going to take: unknowns, memory, disk, the time of an increment, before anything starts."""

from __future__ import annotations

import time as clocks
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from prensa.linear import iterative
from prensa.linear.factorisations import Factorisation, SingularError
from prensa.linear.iterative import IN_WORDS, Iterative
from prensa.linear.reduction import Reduced
from prensa.model.problem import Numerics, Output
from prensa.output.vtk import as_mesh
from prensa.policy import DEFAULT
from prensa.solver.time_stepping import at_rest
from prensa.system.matrix_symmetry import is_symmetric
from prensa.system.planning import plan_step
from prensa.system.system import System


class Estimate(NamedTuple):
    """Free ``unknowns``, the linear ``solver`` and its name in ``words``, bytes of ``memory`` and of ``fields`` on the disk.

    ``memory`` without Python's own. ``fields``: of an increment, and ``disk`` of all whose fields are written, None where their
    number is not known before. ``available``: memory of the machine, None where it does not say. ``seconds`` of an increment, of
    usual iterations; None where that was not tried since there is no room. ``remedy``: what else takes less memory.
    """

    unknowns: int
    solver: str
    words: str
    memory: float
    available: float | None
    fields: float
    disk: float | None
    seconds: float | None
    remedy: str = "'numerics: {solver: multigrid}'"

    def lines(self) -> Iterator[str]:
        """The same in words."""
        yield f"linear systems: {self.unknowns} free unknowns, by {self.words}"
        size = f"memory: about {_bytes(self.memory)}, beside that of Python and its packages"
        if self.available is not None and self.memory > self.available:
            size += f", and this machine has {_bytes(self.available)}: use fewer elements, or {self.remedy}"
        yield size
        whole = "" if self.disk is None else f", {_bytes(self.disk)} in all"
        yield f"disk: fields of at most {_bytes(self.fields)} an increment{whole}; tables, pictures and a checkpoint besides"
        if self.seconds is not None:
            many = DEFAULT.easy_iterations
            yield f"time: about {self.seconds:.2g} s an increment of {many} iterations (one was tried on the undeformed bodies)"

    def summary(self) -> dict[str, Any]:
        """The same as data."""
        return {"free_unknowns": self.unknowns, "solver": self.solver, "memory_bytes": self.memory,
                "memory_available_bytes": self.available, "disk_bytes_per_increment": self.fields, "disk_bytes": self.disk,
                "seconds_per_increment": self.seconds}  # fmt: skip


def estimate(system: System, numerics: Numerics, output: Output) -> Estimate:
    """That of a system in space: its pattern is analysed, and one iteration tried where there is room for it."""
    state = system.initial()
    plan = plan_step(system, 0, state.step_start)
    reduced = Reduced.of(system, plan.fixed, numerics, is_symmetric(system, plan))
    factors = reduced.factorisation
    assert isinstance(factors, Iterative | Factorisation)
    iterates = isinstance(factors, Iterative)
    solver = factors.name if isinstance(factors, Iterative) else "lu"
    words = f"GMRES with {IN_WORDS[solver]}" if iterates else "factors of the matrix itself"
    memory, available = _memory(system, factors), iterative.machine_memory()
    fits = available is None or memory < available
    seconds = _seconds(system, reduced) if fits else None
    start = at_rest(system)
    mesh = None if start is None else as_mesh(start)
    arrays = [] if mesh is None else [mesh.points, *mesh.point_data.values(), *(c.data for c in mesh.cells)]
    arrays += [] if mesh is None else [a for parts in mesh.cell_data.values() for a in parts]
    fields = float(sum(np.asarray(a).nbytes for a in arrays))
    many = [step.increments for step in system.problem.steps]
    known = sum(k or 0 for k in many) if all(many) else None
    written = None if known is None else known // output.fields if output.fields else len(many)
    disk = None if written is None else fields * written
    found = Estimate(len(reduced.free), solver, words, memory, available, fields, disk, seconds)
    return found._replace(remedy="'enforcement: penalty'") if system.exact else found


def _memory(system: System, factors: Iterative | Factorisation) -> float:
    """Bytes of matrices, factors, histories and Krylov vectors."""
    f = factors.direct if isinstance(factors, Iterative) else factors
    nnz, n = len(f.structure.indices), f.structure.n
    # two evaluations with their matrices, and of each pattern its rows
    matrices = system.pattern.entries * (8 + 8 + 4) + nnz * (8 + 4)
    history = sum(h.nbytes for h in system.initial_history) * 4
    vectors = 0.0
    if isinstance(factors, Iterative):
        # A by rows, P, and where mirrored entries are; GMRES keeps two vectors an iteration
        matrices += nnz * (8 + 8 + 4)
        most = DEFAULT.krylov_max_iterations if factors.name == "multigrid" else DEFAULT.ldlt_max_iterations
        vectors = 2.0 * 8.0 * n * most
    return float(matrices + history + factors.size + vectors)


def _seconds(system: System, reduced: Reduced) -> float | None:
    """Seconds of an increment, from one iteration in the undeformed state; None where there is no such matrix."""
    state = system.initial()
    c = system.context(state, plan_step(system, 0, state.step_start), 1.0)
    system.evaluate(c, state.u, state.lam)  # kernels are compiled, patterns analysed: once a run
    reduced.factorisation.analyse()
    began = clocks.perf_counter()
    e = system.evaluate(c, state.u, state.lam)
    if e.failed:
        return None
    b = np.random.default_rng(0).standard_normal(system.ndof)
    try:
        reduced.step(reduced.matrix(e, b, spent=True), b, 1.0)
    except (SingularError, ArithmeticError):  # bodies that nothing holds but contact
        return None
    return DEFAULT.easy_iterations * (clocks.perf_counter() - began)


def _bytes(size: float) -> str:
    """A size in MB or GB."""
    return f"{size / 1e9:.2g} GB" if size >= 1e9 else f"{max(size / 1e6, 1.0):.0f} MB"
