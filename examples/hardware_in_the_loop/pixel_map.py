"""From radiance to the pixels of a screen that a camera looks at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array32, Image8, Mask


@dataclass(frozen=True, kw_only=True)
class PixelMap:
    """How an image lies on a screen, and how bright it is there.

    screen_size : width and height of the screen [px]
    image_size : width and height of the image [px]
    white_radiance : shown by the largest code value, as mean of R, G, B [W m-2 sr-1]
    gamma : exponent from code value to light of the screen, as measured

    The pixel in column i, row j of the image fills a square of ``zoom`` screen pixels an edge whose
    top left one is ``(left + zoom i, top + zoom j)``. All other pixels are black.

    Raises ValueError for an image larger than the screen.
    """

    screen_size: tuple[int, int]
    image_size: tuple[int, int]
    white_radiance: float
    gamma: float = 2.2

    def __post_init__(self) -> None:
        if self.zoom < 1:
            problem = "the image of {} x {} pixels is larger than the screen of {} x {}"
            raise ValueError(problem.format(*self.image_size, *self.screen_size))

    @property
    def zoom(self) -> int:
        """Screen pixels along an edge of a pixel: as many as fit."""
        across, down = zip(self.screen_size, self.image_size, strict=True)
        return min(across[0] // across[1], down[0] // down[1])

    @property
    def corner(self) -> tuple[int, int]:
        """Left and top of the image on the screen, in its middle [px]."""
        (w, h), (a, b) = self.screen_size, self.image_size
        return (w - self.zoom * a) // 2, (h - self.zoom * b) // 2

    def clipped(self, radiance: Array32) -> Mask:
        """(height, width) where the image is brighter than the screen can be."""
        return radiance[..., :3].mean(axis=-1) > self.white_radiance

    def screen(self, radiance: Array32) -> Image8:
        """(height, width) grey code values of the screen, row 0 at the top.

        radiance : (height, width, 4) of the image, bands R, G, B, N [W m-2 sr-1]
        """
        light = np.clip(radiance[..., :3].mean(axis=-1) / self.white_radiance, 0.0, 1.0)
        codes = np.rint(255.0 * light ** (1.0 / self.gamma)).astype(np.uint8)
        enlarged = codes.repeat(self.zoom, axis=0).repeat(self.zoom, axis=1)
        screen = np.zeros(self.screen_size[::-1], dtype=np.uint8)
        left, top = self.corner
        screen[top : top + enlarged.shape[0], left : left + enlarged.shape[1]] = enlarged
        return screen

    def __str__(self) -> str:
        (w, h), (left, top) = self.screen_size, self.corner
        return (
            f"screen {w} x {h}: pixel (i, j) at ({left} + {self.zoom} i, {top} + {self.zoom} j), "
            f"{self.zoom} x {self.zoom} pixels; white {self.white_radiance:g} W m-2 sr-1, "
            f"gamma {self.gamma:g}"
        )
