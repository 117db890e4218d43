"""The page of metals is that of the files of the library."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_table_of_metals_is_up_to_date():
    """It is written by docs/make_metals.py from the files."""
    spec = importlib.util.spec_from_file_location("make_metals", DOCS / "make_metals.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    text = module.PAGE.read_text(encoding="utf-8")
    assert module.page(text) == text, "run docs/make_metals.py"
