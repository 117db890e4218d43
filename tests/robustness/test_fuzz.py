"""Broken inputs are read or refused in words: never a traceback, a hang, or the memory filled."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from prensa.bench import fuzz, fuzz_calls, fuzz_yaml
from prensa.errors import CaseError
from prensa.model.schema import loads


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


def test_what_only_yaml_can_say_and_what_is_no_text_is_read_or_refused(tmp_path):
    """Of the format's own traps (aliases, dates, keys twice, documents) and of bytes, folders and links none is a defect."""
    rng = np.random.default_rng(1)
    texts = fuzz.corpus()
    outcomes = [fuzz.read(fuzz_yaml.mutate_yaml(rng, texts[k % len(texts)]), tmp_path) for k in range(60)]
    outcomes += [fuzz.read_file(fuzz_yaml.no_text(rng, texts[0], tmp_path)) for _ in range(60)]
    assert outcomes.count("refused") > 60


def test_contacts_left_out_are_told_like_written_ones(tmp_path):
    """What is wrong with the contacts that a case gets by leaving them out is said, not swallowed."""
    text = (
        "name: x\nkinematics: small\ncontact_geometry: reference\n"
        "bodies: {b: {mesh: {type: rectangle, size: [1, 1], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}\n"
        "tools: {t: {type: plane, touching: b.top}}\nfixed: {b.bottom: xy}\nsteps: [{name: s}]\n"
    )
    with pytest.raises(CaseError, match="name the boundaries that tool 't' touches"):
        loads(text)


@pytest.mark.parametrize(("source", "count"), [(fuzz_calls.overrides, 40), (fuzz_calls.calls, 300)])
def test_changes_and_calls_are_read_or_refused(source, count):
    """A sample of broken changes of the command line and of broken calls in Python: none is a defect."""
    report = fuzz.run(count, seed=6, source=source)
    assert report.defects == []
    assert report.counts["refused"] > count / 2 and sum(report.counts.values()) == count
