"""Images on surfaces, as frozen data: linear values per texel, and which material has which.

Four kinds of image, each a tuple of layers that materials number:

    base colour   red, green, blue reflectance (linear) and coverage, 0..1
    law           roughness and metallic, 0..1
    normal        unit vector per texel: along the image's rows, up its columns, out of the surface
    emission      red, green, blue share of the material's emission, 0..1
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

# How an image continues past its edge; the shader uses the same numbers.
REPEAT, CLAMP, MIRROR = 0, 1, 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Image:
    """One image.

    values : (height, width, channels) float16, 2^-11 of a value exact; row 0 lies at v = 0
    wrap : how it continues past its edges along u and v
    """

    values: NDArray[np.float16]
    wrap: tuple[int, int] = (REPEAT, REPEAT)


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfaceTextures:
    """Every image of a model, by kind; materials number the layers of each kind from 0."""

    base_colour: tuple[Image, ...] = ()
    law: tuple[Image, ...] = ()
    normal: tuple[Image, ...] = ()
    emission: tuple[Image, ...] = ()

    def __bool__(self) -> bool:
        return any(getattr(self, kind.name) for kind in fields(self))

    @property
    def nbytes(self) -> int:
        """Size of all images."""
        images = (image for kind in fields(self) for image in getattr(self, kind.name))
        return sum(image.values.nbytes for image in images)

    @cached_property
    def digest(self) -> str:
        """Hash of the content, the key of anything made from it."""
        h = hashlib.sha256()
        for kind in fields(self):
            for image in getattr(self, kind.name):
                h.update(f"{kind.name} {image.values.shape} {image.wrap}".encode())
                h.update(np.ascontiguousarray(image.values).tobytes())
        return h.hexdigest()


@dataclass(frozen=True, kw_only=True)
class Maps:
    """The layer of each kind that a material uses; None for a uniform factor.

    normal_scale : stretches the tilt of the normal map
    """

    base_colour: int | None = None
    law: int | None = None
    normal: int | None = None
    emission: int | None = None
    normal_scale: float = 1.0
