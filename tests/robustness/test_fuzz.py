"""Broken inputs are read or refused in words: never a traceback, a hang, or the memory filled."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from prensa.bench import fuzz, fuzz_calls


def test_mutated_inputs_are_read_or_refused():
    """Of 250 mutated cases and mesh files none is a defect, and both answers occur."""
    report = fuzz.run(250, seed=4)
    assert report.defects == []
    assert report.counts["read"] > 5
    assert report.counts["refused"] > 100
    assert sum(report.counts.values()) == 250


@pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux bounds processor time and memory of a process from within"
)
def test_defects_are_found(monkeypatch):
    """A reader that raises something else, hangs or fills the memory is caught in the act."""

    def bad(text, folder):
        if "hang" in text:
            while True:
                pass
        if "fill" in text:
            np.ones(fuzz.MEMORY)
        if "raise" in text:
            raise KeyError("x")
        return "read"

    monkeypatch.setattr(fuzz, "read", bad)
    monkeypatch.setattr(fuzz, "TIME_TO_GIVE_UP", 0.1)
    monkeypatch.setattr(fuzz, "inputs", lambda *_: iter(["hang", "fill", "raise", "good"]))
    report = fuzz.run(4, 0)
    assert [words.partition(":")[0].removeprefix("_Array") for _, words, _ in report.defects] == [
        "TimeOutError",
        "MemoryError",
        "KeyError",
    ]
    assert report.counts == {"failed": 3, "read": 1}


def test_the_inputs_are_the_same_for_the_same_seed(tmp_path):
    """A defect can be had again from seed and number."""
    assert list(fuzz.inputs(30, 5, tmp_path)) == list(fuzz.inputs(30, 5, tmp_path))


@pytest.mark.parametrize(("source", "count"), [(fuzz_calls.overrides, 40), (fuzz_calls.calls, 300)])
def test_changes_and_calls_are_read_or_refused(source, count):
    """A sample of broken changes of the command line and of broken calls in Python: none is a defect."""
    report = fuzz.run(count, seed=6, source=source)
    assert report.defects == []
    assert report.counts["refused"] > count / 2 and sum(report.counts.values()) == count
