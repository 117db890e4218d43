"""``--set path=value`` changes one value before validation, and leads nowhere only with an explanation."""

from __future__ import annotations

from dataclasses import replace

import pytest

from prensa.errors import CaseError
from prensa.model.schema import loads

from .test_mistakes import CASE

CHANGES = [
    ("tools.punch.radius=20", lambda c: c.problem.tools["punch"].radius == 20),
    ("tools.punch.radius=2 cm", lambda c: c.problem.tools["punch"].radius == 20),
    ("steps.0.increments=40", lambda c: c.problem.steps[0].increments == 40),
    ("steps.0.increments=", lambda c: c.problem.steps[0].increments is None),
    ("contacts.0.friction.mu=0.1", lambda c: c.problem.contacts[0].friction.mu == 0.1),
    ("contacts.0.friction={mu: {mu0: 0.1, slope: 1}}", lambda c: c.problem.contacts[0].friction.mu.slope == 1),
    ("contacts.0.enforcement={type: augmented}", lambda c: c.problem.contacts[0].enforcement.type == "augmented"),
    ("contacts.0.surface=billet.top", lambda c: c.problem.contacts[0].name == "billet.top-punch"),
    ("bodies.billet.mesh.n=[2, 3]", lambda c: c.problem.bodies["billet"].mesh.n == (2, 3)),
    ("bodies.billet.mesh.n.1=7", lambda c: c.problem.bodies["billet"].mesh.n == (20, 7)),
    ("bodies.billet.mesh.grade.ratio=2", lambda c: c.problem.bodies["billet"].mesh.grade.ratio == 2),
    ("fixed.billet.bottom=xy", lambda c: c.problem.fixed["billet.bottom"].x == "held"),
    ("fixed.billet.left.x=0.5 mm", lambda c: c.problem.fixed["billet.left"].x == 0.5),
    ("steps.0.push.punch.y=[[0, 0], [1, 2]]", None),
    ("friction.mu=0.2", lambda c: c.problem.friction.mu == 0.2),
    ("numerics.tolerance=1e-6", lambda c: c.numerics.tolerance == 1e-6),
    ("steps.0.friction.billet.top+billet=null", None),
    ("name=other = name", lambda c: c.problem.name == "other = name"),
]


@pytest.mark.parametrize(
    ("change", "true"), [c for c in CHANGES if c[1]], ids=lambda c: c if isinstance(c, str) else ""
)
def test_a_change_is_made(change, true):
    """The value at the path is replaced, or made where the vocabulary has it, and is converted as in a file."""
    assert true(loads(CASE, overrides=[change]))


def test_changes_are_made_in_their_order():
    """A later change sees what an earlier one made."""
    changes = ["tools.punch={type: stamp, width: 3, touching: billet.top}", "tools.punch.width=4"]
    assert loads(CASE, overrides=changes).problem.tools["punch"].width == 4


WRONG = [
    ("tools.pnuch.radius=1", ["unknown tool 'pnuch'", "did you mean 'punch'?"]),
    ("tools.punch.radus=1", ["unknown key 'radus' in tool 'punch' (circle)", "did you mean 'radius'?"]),
    ("tols.punch.radius=1", ["unknown key 'tols'", "did you mean 'tools'?"]),
    ("steps.1.increments=3", ["no entry '1' in 'steps'", "only number 0"]),
    ("steps.pres.increments=3", ["no entry 'pres' in 'steps'", "did you mean 'press'?"]),
    ("steps.0.incremnts=3", ["unknown key 'incremnts' in step 'press'", "did you mean 'increments'?"]),
    ("steps.0.move.pnuch.y=3", ["unknown tool 'pnuch'", "did you mean 'punch'?"]),
    ("tools.punch.radius.x=3", ["'tools.punch.radius' is '8 cm' in the file", "'x'"]),
    ("tools.punch.radius=-1", ["is -1", "greater than 0"]),
    ("tools.punch.radius=.nan", ["not a finite number"]),
    ("tools.punch.radius=8 kg", ["'8 kg' is not a length"]),
    ("bodies.billet.mesh.n=[1", ["bracket"]),
    ("contacts.0.against=pnuch", ["unknown tool 'pnuch'"]),
    ("tools.punch.radius", ["path=value"]),
    ("=3", ["path=value"]),
]


@pytest.mark.parametrize(("change", "words"), WRONG, ids=[w[0] for w in WRONG])
def test_a_wrong_change_is_reported_as_such(change, words):
    """The message begins with the option as it was given and says what is there instead."""
    with pytest.raises(CaseError) as caught:
        loads(CASE, "u.yaml", overrides=[change])
    text = str(caught.value)
    assert text.startswith(f"--set {change}: ") and "\n" not in text
    for word in words:
        assert word in text


@pytest.mark.parametrize("change", ["name=\udc8f", "tools.\udc8f.radius=2", "steps.0.name=a\ud800"])
def test_bytes_of_the_command_line_that_are_no_characters_are_refused(change):
    """A terminal hands on bytes that are no UTF-8 as halves of characters: refused in printable ones."""
    with pytest.raises(CaseError, match="halves of characters") as caught:
        loads(CASE, overrides=[change])
    assert str(caught.value).isascii()


PLAIN = """
name: plain
bodies:
  a: {mesh: {type: rectangle, size: [4, 2], n: [4, 2]}, material: {type: elastic, E: 70e3, nu: 0.3}}
  b: {mesh: {type: rectangle, size: [4, 2], n: [4, 2], origin: [0, -2]}, material: {type: elastic, E: 70e3, nu: 0.3}}
tools: {die: {type: plane, touching: a.top}, bed: {type: plane, touching: b.bottom}}
no_contact: [{surface: [b], against: die}]
friction: {type: shear, m: 0.4, k: 50}
fixed: {a.left: x, b.left: x}
steps: [{name: press, move: {die: {y: -0.1}}}]
"""


@pytest.mark.parametrize("section", ["", "contacts: []\n", "contacts:\n"])
def test_an_entry_of_a_list_that_the_file_leaves_to_its_default_is_changed(section):
    """The contacts are those that count without the key, in their order, and the friction begins as that of the case."""
    made = loads(PLAIN + section, overrides=["contacts.1.friction.m=0.7"]).problem
    before = loads(PLAIN + section).problem
    assert [c.name for c in made.contacts] == [c.name for c in before.contacts] == ["a-die", "a-bed", "b-bed"]
    assert [c.friction for c in made.contacts] == [None, replace(before.friction, m=0.7), None]
    with pytest.raises(CaseError, match="unknown key 'mu'"):
        loads(PLAIN + section, overrides=["contacts.1.friction.mu=0.7"])
    without = PLAIN.replace("friction: {type: shear, m: 0.4, k: 50}\n", "")
    smooth = loads(without + section, overrides=["contacts.0.friction.mu=0.2"])
    assert smooth.problem.contacts[0].friction.mu == 0.2 and smooth.problem.contacts[1].friction is None


def test_a_list_that_the_file_does_not_have_grows_entry_by_entry():
    """Changes to one entry come together; one that is left out is reported, and lists of the file do not grow."""
    ties = [f"ties.0.{key}={side}" for key, side in (("slave", "a.bottom"), ("master", "b.top"))]
    assert loads(PLAIN, overrides=ties).problem.ties[0].master == "b.top"
    assert len(loads(PLAIN, overrides=[*ties, "ties.1={slave: a.left, master: b.right}"]).problem.ties) == 2
    for changes, why in ((["ties.1.slave=a.top"], "no entry '1' in 'ties'"), (["steps.1.name=more"], "no entry '1' in 'steps'")):
        with pytest.raises(CaseError, match=why):
            loads(PLAIN, overrides=changes)
