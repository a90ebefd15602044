"""Types of numpy arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
IndexArray = NDArray[np.int64]
UIntArray = NDArray[np.uint32]
Mask = NDArray[np.bool_]
Image8 = NDArray[np.uint8]
Image16 = NDArray[np.uint16]
AnyArray = NDArray[Any]
