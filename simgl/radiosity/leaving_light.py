"""Light that leaves the surfaces of a body: by patch, and by the spots that a patch is made of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgl.arrays import Array32
from simgl.radiosity.patches import SPOTS


@dataclass(frozen=True, kw_only=True, eq=False)
class LeavingLight:
    """Exitance of a body [W m-2].

    patches : (p, 4) mean of each, after all bounces
    uneven : (p, SPOTS, 4) what spots have more than their patch of light that comes straight from
        Sun and lamps; None where none comes. All other light is even over a patch
    """

    patches: Array32
    uneven: Array32 | None = None

    @cached_property
    def spots(self) -> Array32:
        """(p * SPOTS, 4) of each spot."""
        each = np.repeat(self.patches, SPOTS, axis=0)
        if self.uneven is not None:
            each += self.uneven.reshape(each.shape)
        return each

    def plus(self, patches: Array32) -> LeavingLight:
        """With more light that is even over each patch (p, 4)."""
        return replace(self, patches=self.patches + patches)


def uneven(albedo: Array32, irradiance: Array32) -> Array32:
    """(p, SPOTS, 4) what spots reflect more than their patch.

    albedo : (p, 4); irradiance : (p, SPOTS, 4), straight from light sources [W m-2]
    """
    more = irradiance - irradiance.mean(axis=1, keepdims=True)
    more *= albedo[:, None]
    return more
