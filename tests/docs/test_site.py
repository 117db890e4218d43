"""The site: what newcomers search for stands in headings, every public name has a topic, every process of the gallery a card."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

import prensa

ROOT = Path(__file__).parents[2]
pytest.importorskip("mkdocs")
sys.path.insert(0, str(ROOT / "docs" / "site"))
import pages  # noqa: E402  (a hook of MkDocs, next to what it serves)


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("install", "guide/install.md"),
        ("flow curve csv", "guide/materials.md"),
        ("press force", "guide/press.md"),
        ("cite", "guide/cite.md"),
        ("3d", "guide/space.md"),
        ("springback", "guide/cases.md"),
        ("stl files", "guide/space.md"),
        ("first case", "guide/first-forming.md"),
    ],
)
def test_what_is_searched_stands_in_a_heading(words: str, page: str) -> None:
    """All words of the query in one heading: the search weighs headings most."""
    headings = re.findall(r"^#+ (.+)$", (ROOT / "docs" / page).read_text(encoding="utf-8"), re.MULTILINE)
    tokens = [set(re.findall(r"\w+", heading.lower())) for heading in headings]
    assert any(set(words.split()) <= found for found in tokens)


def test_every_public_name_has_a_topic() -> None:
    """None is left over for a page that is called More, and none is on two pages."""
    topics = pages.topics()
    names = [name for names in topics.values() for name in names]
    assert "More" not in topics
    assert sorted(names) == sorted(set(dir(prensa)) - {"__version__"})


def test_every_process_of_the_gallery_has_a_card() -> None:
    """A picture, a title and a sentence for each section, before the first of them."""
    text = (ROOT / "docs" / pages.GALLERY).read_text(encoding="utf-8")
    made = pages.cards(text)
    head = made[: made.index("\n## ")]
    titles = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert re.findall(r"\*\*\[(.+?)\]\(#", head) == titles and len(titles) > 20
    assert head.count("](forming/") == len(titles)
    assert made.endswith(text[text.index("## ") :])
