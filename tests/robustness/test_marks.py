"""Bodies that bend, confined layers and moved supports, drawn at random: right, or the cause is named."""

import pytest

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
        assert any("are too stiff by" in words for words in said)
