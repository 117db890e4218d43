"""Broken inputs are read or refused in words: never a traceback, a hang, or the memory filled."""

from __future__ import annotations

import sys
from functools import partial

import numpy as np
import pytest

import prensa as pr
from prensa.cli import app
from prensa.errors import CaseError, PrensaError
from prensa.importers.imported import case_text
from prensa.model.schema import loads
from prensa.output.report import number
from prensa_bench import fuzz, fuzz_calls, fuzz_commands, fuzz_whole, fuzz_yaml


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
        if text == "hang":
            while True:
                pass
        if text == "fill":
            np.ones(fuzz.MEMORY)
        if text == "raise":
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


def test_good_inputs_of_commands_are_read(tmp_path):
    """What the commands' inputs are made of is good: only what is done to them is wrong."""
    for text in (fuzz.EXTRA, *fuzz.FORMING):
        assert fuzz.read(text, tmp_path) == "read"
    for name, content in (("deck.inp", fuzz_commands.DECK), ("p.dxf", fuzz_commands.DXF), ("p.csv", fuzz_commands.PROFILE)):
        (tmp_path / name).write_text(content, encoding="utf-8")
    text, remarks = case_text(tmp_path / "deck.inp", tmp_path)
    assert not remarks and fuzz.read(text, tmp_path) == "read"
    for name in ("p.dxf", "p.csv"):
        assert fuzz.read(fuzz_commands.CASE.replace("POINTS", name), tmp_path) == "read"
    (tmp_path / "mu.csv").write_text(fuzz_commands.SLIP_TABLE, encoding="utf-8")
    assert fuzz.read(fuzz_commands.GOOD.replace("mu: 0.1", "mu: mu.csv"), tmp_path) == "read"
    for name, content in (("a.msh", fuzz.GMSH), ("b.msh", fuzz.GMSH_4), ("c.inp", fuzz.ABAQUS)):
        (tmp_path / name).write_text(content, encoding="utf-8")
        assert fuzz.read(fuzz.FROM_FILE.replace("FILE", name), tmp_path) == "read"
    far = fuzz.FORMING[3].replace("by: {base.bottom: {y: 0.1}", "by: {base.bottom: {y: -1e308}")
    assert far != fuzz.FORMING[3] and fuzz.read(far, tmp_path) in ("read", "refused")  # sums of such places are no numbers


DAMAGE = {
    "no *MATERIAL": ("*MATERIAL, NAME=ALU\n", "", "belongs to no material"),
    "no row": ("*ELASTIC\n70000., 0.33\n", "*ELASTIC\n", "ELASTIC has no data line"),
    "no plastic row": ("60., 0.\n120., 0.1\n180., 2.\n", "", "PLASTIC has no data line"),
    "infinite": ("70000., 0.33", "1e400, 0.33", "'1e400' of .ELASTIC is not a number"),
    "fillet": ("RADIUS=0.5", "RADIUS=half", "'half' of .SURFACE is not a number"),
    "static": ("*STEP, NAME=press, NLGEOM=YES\n", "", "STATIC stands outside of any .STEP"),
    "no time": ("0.05, 1.\n", "0.05, 0.\n", "lasts no time"),
    "odd amplitude": ("0.5, 0.2, 1., 1.", "0.5, 0.2, 1.", "pairs of a time and a factor"),
    "words in an amplitude": ("0.5, 0.2, 1., 1.", "0.5, 0.2, 1., one", "'one' of .AMPLITUDE is not a number"),
    "direction": ("9000, 2, 2, -3.", "9000, y, y, -3.", "'Y' is not a number of a degree of freedom"),
    "contact twice": ("TOP, PUNCH\n", "TOP, PUNCH\nTOP, PUNCH\n", "'TOP' and 'PUNCH' is written before"),
    "no segment": ("LINE, 30., 15.\nCIRCL, 20., 15., 25., 15.\nLINE, 0., 15.\n", "", "'PUNCH' has no segment"),
    "nowhere": ("LINE, 0., 15.\n", "LINE, nan, 15.\n", "not START, LINE or CIRCL"),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_damaged_decks_are_refused_with_their_line(what, tmp_path):
    """Each of these ended in a traceback."""
    old, new, told = DAMAGE[what]
    assert old in fuzz_commands.DECK
    (tmp_path / "deck.inp").write_text(fuzz_commands.DECK.replace(old, new), encoding="utf-8")
    with pytest.raises(PrensaError, match=rf"deck.inp: line \d+: .*{told}"):
        case_text(tmp_path / "deck.inp", tmp_path)


def test_contacts_left_out_are_reported_like_written_ones(tmp_path):
    """What is wrong with the contacts that a case gets by leaving them out is said, not swallowed."""
    text = (
        "name: x\nkinematics: small\ncontact_geometry: reference\n"
        "bodies: {b: {mesh: {type: rectangle, size: [1, 1], n: [2, 2]}, material: {type: elastic, E: 1000, nu: 0.3}}}\n"
        "tools: {t: {type: plane, touching: b.top}}\nfixed: {b.bottom: xy}\nsteps: [{name: s}]\n"
    )
    with pytest.raises(CaseError, match="name the boundaries that tool 't' touches"):
        loads(text)


@pytest.mark.parametrize(
    ("source", "count"), [(fuzz_calls.overrides, 40), (fuzz_calls.calls, 300), (partial(fuzz_commands.commands, app), 120)]
)
def test_changes_and_calls_are_read_or_refused(source, count):
    """A sample of broken changes of the command line, calls in Python, and inputs of commands: none is a defect."""
    report = fuzz.run(count, seed=6, source=source)
    assert report.defects == []
    assert report.counts["refused"] > count / 2 and sum(report.counts.values()) == count


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "count"), [(fuzz_whole.crossed, 60), (fuzz_whole.named, 12), (partial(fuzz_whole.lines, app), 20)]
)
def test_odd_but_whole_inputs_are_read_or_refused(source, count):
    """Cases with parts of others, parts with odd names, command lines that run: both answers occur, no defect does."""
    report = fuzz.run(count, seed=6, source=source, time_to_answer=60.0, time_to_give_up=120.0)
    assert report.defects == []
    assert report.counts["refused"] > 1 and report.counts["read"] > count / 8 and sum(report.counts.values()) == count


def test_sizes_as_small_as_numbers_are_divide_nothing(tmp_path):
    """A size of new elements that is no more than the least number: read or refused, no division by zero."""
    text = fuzz.FORMING[0].replace("far: 3.8", "far: 5e-324")
    assert text != fuzz.FORMING[0] and fuzz.read(text, tmp_path) in ("read", "refused")


def test_what_the_commands_stumbled_over_is_reported(tmp_path):
    """Halves of characters, a row without an end, slopes that are no numbers: each of these ended in a traceback."""
    with pytest.raises(CaseError, match="halves of characters"):
        loads("name: \udc8f\n")
    (tmp_path / "p.csv").write_text("x,y\n" + "1" * 200_000 + ",2\n", encoding="utf-8")
    with pytest.raises(CaseError, match=r"p\.csv"):
        loads(fuzz_commands.CASE.replace("POINTS", "p.csv"), "case.yaml", tmp_path)
    (tmp_path / "deck.inp").write_text(fuzz_commands.DECK.replace("120., 0.1", "120., 5e-324"), encoding="utf-8")
    with pytest.raises(CaseError, match="so close together"):
        loads(case_text(tmp_path / "deck.inp", tmp_path)[0], "case.yaml", tmp_path)


ASKED = ("particles", "solve derivatives", "gradient of", "gradient by", "gradient step", "converge", "sweep")


@pytest.mark.parametrize("function", ASKED)
def test_functions_of_studies_and_gradients_refuse_hostile_values_in_words(function, tmp_path):
    """Whatever stands where a measure, a path, a level or a value belongs is refused in words, lists without end included."""
    of = dict(fuzz_calls._functions(tmp_path))
    hostile = [None, 3, 10**5000, float("nan"), [], [[1]], {1: 2}, object(), np.array(1.0), np.ones((2, 2)), np.array(["x"])]
    ring: list[object] = []
    ring.append(ring)
    wide: object = [0.0]
    for _ in range(40):
        wide = [wide, wide]
    for value in (*hostile, ring, wide):
        if function == "converge" and value is None:
            continue
        assert fuzz_calls.answer(of[function], [value]) in ("read", "refused"), function
    assert fuzz_calls.answer(of["gradient of"], ["b.width"]) in ("read", "refused")


def test_an_array_where_a_word_may_stand_is_refused():
    """Arrays are compared item by item with a word: 'truth value … is ambiguous' was all that was said."""
    for make in (lambda v: pr.When(travel=v), lambda v: pr.Step("a", fixed={"block.top": v})):
        with pytest.raises(PrensaError):
            make(np.ones(2))


def test_what_is_no_number_has_no_digits():
    """A damaged table has no numbers in places; the report shows that, and ends in no traceback."""
    assert [number(v) for v in (float("nan"), float("inf"), 1e-12, -2.5)] == ["—", "—", "1.0000 · 10⁻¹²", "−2.5"]
