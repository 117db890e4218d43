"""Outlines of tools as polygons, for pictures."""

from __future__ import annotations

from prensa.measures.tool_outlines import outlines as outlines
