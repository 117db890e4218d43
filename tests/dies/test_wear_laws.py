"""Wear laws: Archard's as before, users' own by closed forms, in case files and over tools in space; what is wrong with one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import prensa as pr
from prensa.model.schema import dump, loads
from prensa.registry import DOORS, examples
from prensa.testing import LawError, check_wear
from prensa.verify.dies import sliding


class Powers(pr.WearLaw):
    """A user's: powers of pressure and speed."""

    c: float
    a: float
    b: float

    def rate(self, at):
        """Of powers, c p^a v^b."""
        return self.c * at.pressure**self.a * at.speed**self.b


LAWS = examples("wear") | {"user's": Powers(1e-9, 1.3, 0.7)}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_laws_are_pure_and_need_pressure_and_slip(law):
    """The suite that every law inherits."""
    check_wear(law)


def test_every_law_has_examples():
    """Each type of the door is tried."""
    assert {law.type for law in LAWS.values()} >= set(DOORS["wear"].own())


@pytest.fixture(scope="module")
def slid():
    """A block of no Poisson's ratio that slides over a plane under a constant force, evenly pressed; its loads."""
    problem = replace(
        sliding(1.0, 1.0, "nodal", 8.0, 1.5),
        bodies={"block": pr.Body(pr.Rectangle(size=(4, 2), n=(8, 4)), pr.Elastic(E=1e6, nu=0.0))},
    )
    return problem, pr.tool_loads(pr.solve(problem), problem, "plane", 64)


def test_a_law_of_archards_form_is_archards(slid):
    """k/H p v as a user's law wears as k and H do, place by place."""
    _, found = slid
    own, known = pr.wear(found, law=Powers(1e-4 / 2000.0, 1.0, 1.0)), pr.wear(found, 1e-4, 2000.0)
    assert own.depth == pytest.approx(known.depth, rel=1e-12) and own.volume == pytest.approx(known.volume, rel=1e-12)
    assert known.volume == pytest.approx(1e-4 / 2000.0 * found.work.sum(), rel=1e-12)


@pytest.mark.parametrize(("a", "b"), [(2.0, 1.0), (1.0, 0.5), (1.4, 2.0)])
def test_a_law_of_ones_own_wears_by_its_formula(slid, a, b):
    """At steady slip the volume is c p^a v^b A t node by node; the sum over the tool's coordinate is the volume."""
    problem, found = slid
    worn = pr.wear(found, law=Powers(1e-9, a, b))
    assert worn.depth @ found.area == pytest.approx(worn.volume, rel=1e-12) and worn.volume > 0.0
    states = [c for inc in pr.solve(problem) for c in inc.contacts.values()]
    before = [np.zeros_like(states[0].points.slip), *(c.points.slip for c in states)]
    total = 0.0
    for state, was, seconds in zip(states, before, [1 / 2] * 2 + [1 / 6] * 6):  # of a nodal rule the points are the nodes
        p, speed = state.points.pressure, np.abs(state.points.slip - was) / seconds
        total += float((1e-9 * p**a * speed**b * state.points.weight).sum()) * seconds
    assert worn.volume == pytest.approx(total, rel=1e-6)


LAW = """
import numpy as np
import prensa as pr

class Halved(pr.WearLaw):
    c: float

    def rate(self, at):
        return 0.5 * self.c * at.pressure * at.speed
"""
CASE = """
name: upsetting
units: {length: mm, force: N}
space: axisymmetric
bodies:
  b: {mesh: {type: rectangle, size: [10, 7.5], n: [4, 3]}, material: {type: elastic, E: 200e3, nu: 0.3}}
tools: {die: {type: plane, touching: b.top, press: {capacity: 400 kN}}}
contacts: [{surface: [b.top, b.right], against: die, friction: {mu: 0.1}}]
fixed: {b.bottom: y}
steps: [{name: press, move: {die: {y: -0.02}}, increments: 2}]
output: {pictures: false, report: REPORT, wear: {die: WEAR}}
"""


def test_a_law_of_a_case_file_is_in_the_answer_and_on_the_first_screen(tmp_path):
    """Half of Archard's depth where the law says so, and twice the parts; what a press and wear say needs no measure."""
    (tmp_path / "my_laws.py").write_text(LAW, encoding="utf-8")
    found, own = {}, "{type: 'my_laws:Halved', c: 1e-9, depth: 0.05 mm}"
    for name, wear in (("own", own), ("known", "{k: 1e-6, hardness: 1e3, depth: 0.05}")):
        text = CASE.replace("WEAR", wear).replace("REPORT", str(name == "own").lower())
        case = loads(text, "case.yaml", tmp_path)
        run = pr.run(case, tmp_path / name, quiet=True)
        found[name] = run.summary["wear"]["die"]
        assert loads(dump(case), "again.yaml", tmp_path).output.wear == case.output.wear
    page = (tmp_path / "own" / "report.html").read_text(encoding="utf-8")
    first = page[: page.index("<h2>")]
    assert "wear of die: " in first and "parts until 0.05 mm" in first and "of 400 kN at 0.02 mm" in first
    assert found["own"]["depth"] == pytest.approx(0.5 * found["known"]["depth"], rel=1e-9)
    assert found["own"]["parts"] == pytest.approx(2.0 * found["known"]["parts"], rel=1e-9)


@pytest.mark.parametrize(
    ("rate", "said"),
    [
        ("(self, pressure, speed):\n        return pressure", r"its rate raises TypeError \(.*'speed'.*an array of shape \(5,\)"),
        ("(self, at):\n        return 1.0", r"its rate returns 1.0 where it is tried; for 5 places an array of shape \(5,\)"),
    ],
)  # fmt: skip
def test_a_law_of_the_wrong_form_is_refused_before_the_run(tmp_path, rate, said):
    """With the place in the file, the law's name, what it returns and what is expected."""
    law = f"import prensa as pr\n\n\nclass Odd(pr.WearLaw):\n    def rate{rate}\n"
    (tmp_path / "of_form.py").write_text(law, encoding="utf-8")
    text = CASE.replace("WEAR", "{type: 'of_form:Odd'}").replace("REPORT", "false")
    with pytest.raises(pr.CaseError, match=rf"^case.yaml:\d+:\d+: wear law '.*of_form.py:Odd': {said}.*check_wear$"):
        loads(text, "case.yaml", tmp_path)


def test_wrong_laws_are_refused(slid):
    """Wear without slip, negative, of the wrong shape, with k and H besides, unknown; and a class that states none."""

    class Rusting(pr.WearLaw):
        def rate(self, at):
            return 1.0 + 0.0 * at.pressure

    class Growing(pr.WearLaw):
        def rate(self, at):
            return -at.pressure * at.speed

    class One(pr.WearLaw):
        def rate(self, at):
            return 1.0

    for law, words in ((Rusting(), "wears without slip"), (Growing(), "tools do not grow"), (One(), "one number a place")):
        with pytest.raises(LawError, match=words):
            check_wear(law)
    for law in (Growing(), One()):
        with pytest.raises(pr.PrensaError, match="check_wear"):
            pr.wear(slid[1], law=law)
    with pytest.raises(pr.PrensaError, match="give one of the two"):
        pr.wear(slid[1], 1e-4, 2000.0, law=Powers(1.0, 1.0, 1.0))
    with pytest.raises(pr.CaseError, match="archrad"):
        loads(CASE.replace("WEAR", "{type: archrad}").replace("REPORT", "false"))
    with pytest.raises(pr.CaseError, match="both 'k' and 'hardness'"):
        loads(CASE.replace("WEAR", "{k: 1e-5}").replace("REPORT", "false"))


def test_a_word_that_is_no_wear_is_refused_with_what_may_stand_there() -> None:
    """One word is known; others have the law's values missing."""
    assert type(pr.Output(wear={"die": "relative"}).wear["die"]) is pr.Archard
    with pytest.raises(pr.PrensaError, match=r"'absolute' is no wear: write 'relative', or a law with its values"):
        pr.Output(wear={"die": "absolute"})
