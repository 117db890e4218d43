"""The report stays below 10 MB whatever the number of steps: which increments, pictures and curves it shows then."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import prensa as pr
from prensa.output import report
from prensa.output.checkpoint import case_text, text_hash
from prensa.output.frames import evenly, travelled
from prensa.output.report import MOST_PAGE, write_report
from prensa.output.stored import Placement, Stored
from prensa.result.increment import BodyState, Increment, SpatialForce, SpatialPlace, Statistics, ToolState

STEPS = 500


# ------------------------------------------------------------------------------------------------------------ the choice
def test_any_number_of_increments_covers_the_travel_evenly():
    """Of unequal increments, however many are taken, no gap exceeds twice the even one by more than one increment."""
    steps = np.random.default_rng(3).uniform(0.1, 1.0, 400)
    travel = np.cumsum(steps)
    order = list(evenly(travel.tolist(), []))
    assert sorted(order) == list(range(400)) and set(order[:2]) == {0, 399}
    for most in (5, 17, 60):
        gaps = np.diff(travel[np.sort(order[:most])])
        assert gaps.max() <= 2 * np.ptp(travel) / (most - 1) + steps.max()


def test_preferred_increments_divide_gaps_and_rest_is_divided_by_number():
    """The end of a step in the widest gap is taken before its middle; where nothing travels, increments count."""
    assert list(evenly([float(k) for k in range(11)], [], {7}))[:3] == [10, 0, 7]
    assert list(evenly([0.0] * 9, []))[:3] == [8, 0, 4]
    assert list(evenly([], [])) == [] and list(evenly([1.0], [])) == [0]


def test_travel_is_that_of_all_tools_their_rotation_or_time():
    """Two tools that move one after the other add up, to and fro; rolls that only turn count by their rotation."""
    tools = {"a": pr.Plane(normal=(0, 1, 0), at=(0, 0, 0)), "b": pr.Plane(normal=(0, 1, 0), at=(0, 0, 0))}
    problem = _problem(tools)
    still = {f"{t}.{c}": np.zeros(4) for t in tools for c in ("ux", "uy", "uz", "rx", "ry", "rz")}
    table = still | {"time": np.arange(1.0, 5.0)}
    assert travelled(table, problem).tolist() == [1, 2, 3, 4]
    table["b.rz"] = np.array([0.0, 0.5, 0.5, 1.0])
    assert travelled(table, problem).tolist() == [0, 0.5, 0.5, 1]
    table |= {"a.uy": np.array([-3.0, 0.0, 0.0, 0.0]), "a.ux": np.array([4.0, 0.0, 0.0, 0.0]), "b.uz": np.array([0, 0, 2.0, 2.0])}
    assert travelled(table, problem).tolist() == [5, 10, 12, 12]


# -------------------------------------------------------------------------------------------------------------- the page
def _problem(tools=None, steps=1):
    body = pr.Body(pr.Box((32, 32, 32), (32, 32, 32)), pr.Elastic(200e3, 0.3))
    tools = tools or {"punch": pr.Plane(normal=(0, -1, 0), touching="block.top")}
    return pr.Problem(
        "many steps", space="solid", bodies={"block": body}, tools=tools,
        contacts=tuple(pr.Contact("block.top", t) for t in tools), fixed={"block.bottom": "xyz"},
        steps=[pr.Step(f"blow {k}", move={"punch": {"y": -0.01 * k}}, increments=1) for k in range(1, steps + 1)]
        if "punch" in tools else [pr.Step("one", move={"a": {"y": -1.0}}, increments=4)],
    )  # fmt: skip


class Many(Stored):
    """A run of 1e5 unknowns and 500 steps of one increment, as if read back: rough fields, which compress worst."""

    def __init__(self, directory: Path, case: pr.Case, history: dict[str, np.ndarray]) -> None:
        self.directory, self.problem, self.mirror, self.history = directory, case.problem, (), history
        self.placements = {"punch": Placement((0.0, 32.0, 0.0), (0.0, -1.0, 0.0))}
        self.ends = np.ones(STEPS, dtype=bool)
        system = pr.discretise(case.problem)
        self.X, self.cells = system.meshes["block"].points, system.meshes["block"].cells

    with_fields = tuple(range(1, STEPS + 1))

    def _increment(self, k: int) -> Increment:
        tool = ToolState(np.array([0.0, 32.0, 0.0]), SpatialPlace(0, self.history["punch.uy"][k], 0, 0, 0, 0),
                         SpatialForce(0, self.history["punch.fy"][k], 0, 0, 0, 0), (0.0, -1.0, 0.0))  # fmt: skip
        return Increment(
            f"blow {k + 1}", k + 1, k + 1, float(k + 1), {"punch": tool}, {}, {}, Statistics(3, 0, 1e-10), True, None,
            lambda: {}, lambda: {"block": self._body(k)},
        )  # fmt: skip

    def _body(self, k: int) -> BodyState:
        rng = np.random.default_rng(k)
        n = len(self.X)
        return BodyState(self.X, self.X + rng.normal(size=(n, 3)), self.cells, np.zeros((n, 3)), rng.normal(size=(n, 6)),
                         rng.random(n), rng.random(n))  # fmt: skip


@pytest.fixture
def many(tmp_path, monkeypatch):
    """Folder of that run with a picture of 0.3 MB for each step, and the run."""
    from prensa.output.history import history_columns

    case = pr.Case(_problem(steps=STEPS))
    history = {c: np.zeros(STEPS) for c in history_columns(case.problem)}
    history |= {"increment": np.arange(1, STEPS + 1), "time": np.arange(1.0, STEPS + 1), "iterations": np.full(STEPS, 3),
                "cutbacks": np.zeros(STEPS, dtype=int), "step": np.array([f"blow {k + 1}" for k in range(STEPS)]),
                "punch.uy": -0.01 * np.arange(1.0, STEPS + 1), "punch.fy": np.sin(np.linspace(0.1, 2.5, STEPS))}  # fmt: skip
    (tmp_path / "pictures").mkdir()
    for name in ("deformed", "energy", *(f"deformed_step{k}_blow_{k}" for k in range(1, STEPS))):
        (tmp_path / "pictures" / f"{name}.png").write_bytes(bytes(300_000))
    totals = {"increments": STEPS, "iterations": 3 * STEPS, "cutbacks": 0, "time": 500.0, "end": 500.0, "wall_seconds": 1.0}
    summary = {
        "name": "many steps", "status": "completed", "reason": "", "version": "0", "source": "", "finished": "",
        "input_hash": text_hash(case_text(case)), "tools": {}, "bodies": {}, "warnings": [], "timings": {}, "totals": totals,
        "convergence": {"mean_iterations": 3.0, "max_iterations": 3, "max_residual": 1e-10, "tolerance": 1e-9},
        "case": case_text(case),
    }  # fmt: skip
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    made = Many(tmp_path, case, history)
    monkeypatch.setattr(report, "stored_run", lambda *_: made)
    monkeypatch.setattr(report, "maxima", lambda _: [])  # which reads all fields
    return tmp_path, made


@pytest.mark.slow
def test_the_page_of_five_hundred_steps_stays_below_ten_megabytes(many):
    """Full use of the room, no more; it says which increments and how many pictures it shows."""
    folder, stored = many
    assert 3 * len(stored.X) > 1e5
    page = write_report(folder).read_text(encoding="utf-8")
    assert 0.8 * MOST_PAGE < len(page.encode()) <= MOST_PAGE == 10_000_000
    made = json.loads(re.search('<script id="scene"[^>]*>(.*?)</script>', page, re.DOTALL)[1])
    shown = [made["history"]["increment"][k] for k in made["frames"]]
    assert {1, STEPS, made["largest"]} <= set(shown) and made["largest"] == int(np.argmax(stored.history["punch.fy"])) + 1
    assert len(shown) >= 5 and np.diff(shown).max() <= 2 * STEPS / (len(shown) - 2)
    assert f"{len(shown)} of the 500 increments with fields are shown" in page and ", ".join(map(str, shown)) in page
    pictures = page.count("<figure>")
    assert 5 <= pictures < 20 and f"({pictures} of the 501 in <code>pictures/</code>)" in page
