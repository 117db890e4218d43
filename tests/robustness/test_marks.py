"""Bodies that bend, confined layers and moved supports, drawn at random: right, or the cause is named."""

import pytest

from prensa.checks.after.quality import GIVE_WAY
from prensa_bench import marks
from prensa_bench.marks import draw, verdict


@pytest.mark.parametrize(("kind", "number", "expected"), [
    ("bending", 2, "right"), ("bending", 5, "right"), ("bending", 36, "reported"),
    ("confined", 1, "right"), ("confined", 4, "right"), ("moved", 0, "right"), ("moved", 1, "right"), ("moved", 9, "right"),
    ("free", 1, "reported"), ("free", 4, "right"), ("free", 6, "reported"), ("free", 7, "reported"),
])  # fmt: skip
def test_marks_are_met(kind, number, expected):
    """Within the share allowed of a finer mesh, exact contact or statics; a feed in no contact waits for no grip."""
    found, error, said = verdict(draw(kind, 23, number))
    assert found == expected, (error, said)
    if number == 36:
        assert any("are too stiff for that" in words for words in said)


def test_a_share_of_penalties_that_exact_contact_confirms_is_no_false_alarm():
    """1.4 % for exact contact on the same mesh, where the finer mesh, with its own error, is within 5 %."""
    found, error, said = verdict(draw("bending", 9304, 58))
    assert found == "share" and abs(error) < 0.05 and all(GIVE_WAY in words for words in said)


@pytest.mark.parametrize(("exact", "said", "expected"), [
    (1.02, [GIVE_WAY], "share"), (1.005, [GIVE_WAY], "alarm"), (0.98, [GIVE_WAY], "alarm"),
    (float("nan"), [GIVE_WAY], "alarm"), (1.02, [GIVE_WAY, "something else"], "alarm"), (1.02, [], "right"),
])  # fmt: skip
def test_what_counts_as_a_false_alarm(monkeypatch, exact, said, expected):
    """Right answers: a share that is not there, that nobody can confirm, or that is not all that is said, counts as one."""
    mark = draw("bending", 9304, 58)
    exacts = marks.enforced(mark.problem, "exact")
    monkeypatch.setattr(marks, "answer", lambda problem, _: (exact if problem == exacts else 1.0, said))
    assert verdict(mark)[0] == expected


@pytest.mark.parametrize(("answers", "expected"), [
    (((1.0, []),), 1.0), (((1.0, ["warned"]), (1.1, [])), 1.1), (((1.0, ["warned"]), (1.1, ["warned"])), 1.1),
    (((1.0, ["warned"]), (float("nan"), ["stopped"])), 1.0), (((1.0, []), (1.1, [])), 1.0),
])  # fmt: skip
def test_what_is_warned_of_itself_is_no_reference(monkeypatch, answers, expected):
    """The first finer mesh of which nothing is said is right, else the last one that has an answer."""
    mark = draw("bending", 23, 2)
    mark = mark._replace(better=mark.better * len(answers))
    found = iter([(expected, []), *answers])
    monkeypatch.setattr(marks, "answer", lambda *_: next(found))
    verdict_, error, _ = verdict(mark)
    assert verdict_ == "right" and abs(error) < 1e-12
