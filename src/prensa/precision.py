"""The precision of numbers: sizes below which something is nothing, one for each reason. All are relative, or added to a divisor.

A threshold that is part of a method (a share of an element, an angle at which a corner begins) stands where it is used.
"""

from __future__ import annotations

import sys

EPS = sys.float_info.epsilon
"""Round-off of one operation."""
SMALLEST = sys.float_info.min
"""Least normal number: the size of a divisor where 0/0 is to be 0."""
FIRST_DIFFERENCE = EPS ** (1 / 3)
"""Step of central differences of a function, over its argument, at which round-off and truncation are alike."""
SECOND_DIFFERENCE = EPS ** (1 / 4)
"""The same of second differences, and of differences of differences."""
COMPLEX_STEP = 1e-30
"""Step of complex derivatives, over the argument: its square is lost beside any number, and nothing is subtracted."""
ROUND_OFF = 1e-12
"""What sums and solutions of some thousand operations leave of an exact zero."""
NEGLIGIBLE = 1e-9
"""Length over the size of what it is a part of, sine, cosine, angle or share of time that is none in computed geometry."""
DRAWN = 1e-6
"""The same in drawings, meshes and measured tables that other programs wrote, often with seven digits."""
