"""Odd but readable cases, solved: whatever a case says that is not refused, its run ends well or with a `PrensaError`.

Beside `prensa_bench.fuzz`, which reads and checks broken cases. Here good cases of the random suites and of forming are changed
in their values alone (sizes, steps, laws, enforcement, elements, what moves, pushes, holds), so that many can be solved, and the
first increments are. Solving takes its time: an input that is not done then is left, which is no defect.
"""

from __future__ import annotations

import functools
import itertools
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from prensa.errors import PrensaError
from prensa_bench.fuzz_calls import Attempt, answer, paths_of

INCREMENTS = 6  # that are solved of an input
SECONDS = 0.6  # of processor time, after which the next increment is not asked for
LIMITS = (60.0, 120.0)  # processor seconds within which an input is done, and after which it is abandoned
FACTORS = (-1.0, 0.0, 1e-9, 1e-3, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1e3, 1e9)
WORDS: dict[str, tuple[Any, ...]] = {
    "element": ("q4", "q4_fbar", "q4_enhanced", "q4_sheet", "t3", "t6", "q8", "q8_full", None),
    "integration": ("nodal", "gauss1", "gauss2", "gauss3", "simpson", "kikuchi"),
    "enforcement": (
        {"type": "penalty"}, {"type": "augmented"}, {"type": "exact"}, {"type": "penalty", "beta": 1e-3},
        {"type": "penalty", "beta": 1e7}, {"type": "penalty", "k_n": 1.0, "k_T": 1e9},
    ),
    "friction": (
        None, {"mu": 0.0}, {"mu": 0.3}, {"mu": 50}, {"type": "shear", "m": 1.0}, {"type": "shear", "m": 0.0},
        {"type": "capped", "mu": 0.2, "m": 0.5}, {"mu": {"mu0": 0.5, "mu_inf": 0.01, "u0": 1e-9}},
    ),
    "space": ("plane strain", "plane stress", "axisymmetric"),
    "kinematics": ("finite", "small"),
    "stabilise": ("auto", "off", 0.1, 1e-12),
    "remesh": ("auto", "off", {"at_most": 0}, {"when": {"quality": 0.5, "travel": 1e-3}}),
    "fillet": (0, 1e-9, 1e9),
    "nu": (0.0, 0.4999, -0.9, 0.49999999),
    "increments": (1, 2, 1000, 1_000_000, None),
    "thickness": (1e-9, 1.0, 1e9),
    "duration": (1e-12, 1e12),
    "follower": (True, False),
    "condense": ("auto", True, False),
    "remove_tools": (True,),
    "time_rule": ("auto", "backward_euler", "bdf2"),
    "time_tolerance": (1e-6, 0.01, 0.999),
}  # fmt: skip


def runs(count: int, seed: int, folder: Path) -> Iterator[Attempt]:
    """Good cases with one to four values changed, and the beginning of their runs, of every sixth with derivatives."""
    from prensa.model import text as yaml
    from prensa_bench.fuzz import FORMING, corpus

    rng = np.random.default_rng(seed)
    trees = [yaml.read(text, "<fuzz>")[0].plain() for text in (*FORMING, *corpus())]
    for _ in range(count):
        tree = changed(rng, trees[rng.integers(len(trees))])
        text, by = yaml.write(tree), tuple[str, ...]()
        if rng.random() < 1 / 6:
            paths = list(paths_of(tree))
            by = tuple(paths[rng.integers(len(paths))] for _ in range(int(rng.integers(1, 3))))
        yield f"{text}derivatives: {by}", functools.partial(answer, functools.partial(begun, text, folder, by))


def changed(rng: np.random.Generator, tree: Any) -> Any:
    """A copy of a case with some values changed, and keys of its parts added."""
    import copy

    from prensa_bench.fuzz import spots_of

    tree = copy.deepcopy(tree)
    for _ in range(int(rng.integers(1, 5))):
        spots = list(spots_of(tree))
        holder, key = spots[rng.integers(len(spots))]
        old = holder[key]
        if key in WORDS:
            holder[key] = WORDS[key][rng.integers(len(WORDS[key]))]
        elif isinstance(old, int | float) and not isinstance(old, bool):
            holder[key] = type(old)(old * float(rng.choice(FACTORS)))
        elif isinstance(holder, dict) and rng.random() < 0.5:
            del holder[key]
        if rng.random() < 0.3:
            part, name = _added(rng, tree)
            part[name] = WORDS[name][rng.integers(len(WORDS[name]))]
    return tree


def _added(rng: np.random.Generator, tree: Any) -> tuple[dict[str, Any], str]:
    """A part of a case and a key that it may have."""
    whole = ("friction", "space", "kinematics", "stabilise", "remesh", "thickness")
    parts: list[tuple[Any, tuple[str, ...]]] = [(tree, whole)]
    parts += [(body, ("element",)) for body in tree.get("bodies", {}).values()]
    parts += [(c, ("enforcement", "integration", "friction")) for c in tree.get("contacts", []) if isinstance(c, dict)]
    parts += [(s, ("increments", "stabilise", "duration", "remove_tools")) for s in tree.get("steps", [])]
    parts.append((tree.setdefault("numerics", {}), ("time_rule", "time_tolerance", "condense")))
    parts = [(part, keys) for part, keys in parts if isinstance(part, dict)]
    part, keys = parts[rng.integers(len(parts))]
    return part, keys[rng.integers(len(keys))]


def begun(text: str, folder: Path, by: tuple[str, ...] = ()) -> None:
    """Read a case and solve its first increments; what is too large for that, or is refused, is a `PrensaError`.

    ``by``: paths in the case, by which derivatives are asked for, whatever stands there.
    """
    import prensa
    from prensa.model.schema import loads
    from prensa_bench.fuzz import LARGEST_MESH, elements

    case = loads(text, "case.yaml", folder)
    if sum(elements(b.mesh) for b in case.problem.bodies.values()) > LARGEST_MESH // 40:
        raise PrensaError("too large to be solved here")
    begun = time.process_time()
    for _ in itertools.islice(prensa.solve(case.problem, case.numerics, derivatives=by), INCREMENTS):
        if time.process_time() - begun > SECONDS:
            break
