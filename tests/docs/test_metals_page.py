"""The page of metals is that of the files of the library."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from prensa.materials.metals import read_metal

DOCS = Path(__file__).parents[2] / "docs"


def test_the_table_of_metals_is_up_to_date():
    """It is written by docs/make_metals.py from the files."""
    spec = importlib.util.spec_from_file_location("make_metals", DOCS / "make_metals.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    text = module.PAGE.read_text(encoding="utf-8")
    assert module.page(text) == text, "run docs/make_metals.py"


def test_metals_that_pages_and_examples_name_are_in_the_library():
    """What a reader copies into a case is found; the page of mistakes names wrong ones on purpose."""
    root = DOCS.parent
    pages = [*(DOCS / "guide").glob("*.md"), DOCS / "index.md", root / "README.md", *(root / "examples").glob("*.yaml")]
    found = {
        (page.name, name)
        for page in pages
        if page.name != "mistakes.md"
        for name in re.findall(r"type: j2, of: ([\w.-]+)", page.read_text(encoding="utf-8"))
        if not name.isupper() or any(c.isdigit() for c in name)  # METAL stands for any
    }
    assert ("first-forming.md", "AISI4135") in found
    for page, name in found:
        assert name.endswith(".yaml") or read_metal(name), page
