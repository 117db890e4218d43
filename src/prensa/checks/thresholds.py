"""Thresholds that several checks have in common; one that a single check has stands in its file."""

from __future__ import annotations

NO_DIFFERENCE = 1e-6
"""Relative difference of two numbers, or cosine, that counts as none: above round-off of what follows from a description, and
below what anybody writes on purpose."""
SLIGHT = 0.01
"""Share of an element, a force or a way that answers do not show: errors of a mesh are as large."""
TOUCHING_DEPTH = 0.05
"""Depth over element size up to which outlines just touch: penalties and chords of curved sides make as much."""
NOTABLE_DEPTH = 0.1
"""Depth over element size that is worth a word: areas and forces of the contact are off by about as much."""
IMBALANCE = 0.05
"""Share of the largest energy above which an error of the energy balance is worth a word."""
ALONG = 0.9
"""Cosine (of 26°) from which a support acts along a tool's normal, or two tools face each other."""
TOWARDS = 0.5
"""Cosine (of 60°) from which a motion or a normal points along another direction rather than past it."""
