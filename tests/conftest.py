"""What all tests share."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from prensa import analysis
from prensa.sensitivity import solve

JUDGED = {"checks", "docs", "examples", "model", "robustness", "verification"}
"""Folders whose tests look at what a run warns of, but for modules with `JUDGES_WARNINGS` = False."""


def pytest_collection_finish() -> None:
    """What thousands of collected tests are made of stays to the end: searches for cyclic garbage leave it out from here on."""
    gc.freeze()


@pytest.fixture(autouse=True, scope="module")
def _contacts_of_few_nodes(request: pytest.FixtureRequest) -> Iterator[None]:
    """Small contacts are not computed once more on finer elements where nobody asks whether their forces are right.

    Nearly every contact of a test has few nodes, and a look takes as long as such a test.
    """
    with pytest.MonkeyPatch.context() as patch:
        if not getattr(request.module, "JUDGES_WARNINGS", request.path.parent.name in JUDGED):
            for module in (analysis, solve):
                patch.setattr(module, "missed_on_finer", lambda *_, **__: None)
        yield
