"""Names of array types, for signatures; shapes are said where they are used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers."""
Index = NDArray[np.int64]
"""Numbers of nodes, elements, degrees of freedom."""
Flags = NDArray[np.bool_]
"""Yes or no."""
Ints = NDArray[np.int32]
"""Places in the values of a matrix, where eight bytes each would be a share of what a run holds."""
Bytes = NDArray[np.int8]
"""States of contact points."""
Single = NDArray[np.float32]
"""Numbers of half the digits."""
Stored = NDArray[np.generic]
"""Arrays of any kind of numbers or flags, as checkpoints hold them."""
