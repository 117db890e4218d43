"""Wrong arguments in Python get the sentences of a case file, from every class and function, and no words of the library."""

from __future__ import annotations

import dataclasses

import pytest

import prensa as pr
from prensa.errors import PrensaError
from prensa.output.run import resume, run
from prensa.solver.time_stepping import at_rest

WRONG = [
    (lambda: pr.Stamp(width=1, filet=1), "unknown key 'filet' in Stamp; did you mean 'fillet'?"),
    (lambda: pr.Swift(k=1, e0=0.1, n=0.2), "unknown key 'k' in Swift; did you mean 'K'?"),
    (lambda: pr.Contact("a.top", "p", friction=0.1), "0.1 is not a valid friction: write its type and values"),
    (lambda: pr.Circle(radius=-1), "radius of Circle is -1; it must be greater than 0"),
    (lambda: pr.Circle(), "Circle needs 'radius', a length"),
    (lambda: pr.Circle(1, radius=2), "'radius' of Circle is given twice, by its position and by its name; keep one"),
    (lambda: pr.Motion(1, 2, 3, 4, 5, 6, 7), "Motion is given 7 values and has 6: x, y, rz, z, rx, ry"),
    (lambda: pr.Coulomb(float("nan")), "mu of Coulomb is nan; a finite number is expected"),
    (lambda: pr.Numerics(tolerance=True), "tolerance of Numerics is True; a number is expected"),
    (lambda: pr.Rectangle((1, 2), (3,)), "n of Rectangle has 1 value; a list of 2 whole numbers is expected"),
    (lambda: pr.Rectangle((1, 2), (10**9, 10**9)), "n of Rectangle: 1e+18 elements; a body has 5 000 000 at most"),
    (lambda: pr.Disc(1, (10**6, 1)), "1e+12 elements; a body has 5 000 000 at most"),
    (lambda: pr.Step("a", move={"p": {"rzz": 1}}), "unknown key 'rzz' in move of 'p'; did you mean 'rz'?"),
    (lambda: pr.Contact("a.top", "p", integration="gaus"), "unknown integration 'gaus'; did you mean 'gauss3'?"),
    (
        lambda: pr.Contact("a.top", "p", friction={"type": "colomb"}),
        "unknown friction 'colomb'; did you mean 'coulomb'?",
    ),
    (lambda: pr.Contact("a.top", "p", friction=pr.Elastic(1, 0)), "unknown friction 'elastic'; known: 'capped'"),
    (lambda: pr.Case(1), "problem of Case is 1; a mapping with name"),
    (lambda: pr.Load(traction=(1, 2), pressure=3), "give either 'traction' or 'pressure' and/or 'shear'"),
    (lambda: pr.Problem("x", {}, ()), "bodies: at least one body is needed"),
    (lambda: pr.Coulomb(0.1, type="x"), "unknown type 'x'; known: 'coulomb'"),
    (lambda: dataclasses.replace(pr.Circle(radius=1), radius="8 cm"), "'8 cm': unit strings belong in case files"),
]


@pytest.mark.parametrize(("wrong", "words"), WRONG, ids=[words for _, words in WRONG])
def test_arguments_are_reported_as_keys_of_a_file(wrong, words):
    """The sentence names the argument, its value and what is meant; nothing of the library that found it is in it."""
    with pytest.raises(pr.CaseError) as caught:
        wrong()
    text = str(caught.value)
    assert words in text and "pydantic" not in text and "http" not in text


def test_the_nearest_public_name_is_suggested():
    """Python itself says it from what the error carries."""
    with pytest.raises(AttributeError) as caught:
        _ = pr.Stampp
    assert caught.value.name == "Stampp" and caught.value.obj is pr


def test_arguments_of_functions_are_reported_too(tmp_path):
    """What is no problem, numerics, case, path or name is refused at the door, in one line with the remedy."""
    body = pr.Body(pr.Rectangle((1, 1), (1, 1)), pr.Elastic(1, 0))
    problem = pr.Problem("one", {"b": body}, (pr.Step("s"),), fixed={"b.bottom": "xy"})
    increment = at_rest(pr.discretise(problem))
    small = pr.discretise(problem).initial()
    other = pr.discretise(
        dataclasses.replace(problem, bodies={"b": pr.Body(pr.Rectangle((1, 1), (2, 2)), pr.Elastic(1, 0))})
    )
    for call, words in (
        (lambda: pr.solve(pr.Case(problem)), "solve: problem is a Case; give a Problem"),
        (lambda: pr.solve(problem, numerics={"tolerance": 1e-6}), "solve: numerics is a mapping; give a Numerics"),
        (lambda: pr.solve(problem, monitor=1), "solve: monitor is 1; give a function"),
        (lambda: pr.solve(other, start=small), "solve: start has 8 unknowns and the problem 18"),
        (lambda: pr.discretise("x"), "discretise: problem is 'x'; give a Problem"),
        (lambda: pr.run("case.yaml"), "run: case is 'case.yaml'; give a Case"),
        (lambda: run(pr.Case(problem), 3), "run: out is 3; give the path of a folder"),
        (lambda: resume(None), "resume: directory is None; give the folder"),
        (lambda: pr.load(3), "load: path is 3; give the path"),
        (lambda: pr.dump({}), "dump: case is a mapping; give a Problem or a Case"),
        (lambda: increment.measure(3), "measure: text is 3; give the name"),
        (lambda: increment.force("punch"), "unknown tool 'punch'"),
    ):
        with pytest.raises(PrensaError) as caught:
            call()
        assert words in str(caught.value)
