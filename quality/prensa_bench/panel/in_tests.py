"""A plugin of pytest that runs tests with mechanisms of the solver off, those of the variable ``PRENSA_PANEL_OFF`` (a,b)."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from prensa_bench.panel.composition import without
from prensa_bench.panel.mechanisms import MECHANISMS


@pytest.fixture(scope="session", autouse=True)
def _off() -> Iterator[None]:
    with without(MECHANISMS[name] for name in os.environ["PRENSA_PANEL_OFF"].split(",")):
        yield
