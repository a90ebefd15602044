"""Spread: point spread, scattered light and ghosts of a lens, by Fourier transforms on the CPU.

The radiance goes to the CPU, where the sums of its bands are made that spread, in the window that
holds light; the result comes back. On a CPU renderer that is a copy, and its transforms are far
faster than any that shaders could do there. On a GPU ``compute_spread`` does the same.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.convolution import WORKERS, Window, lit_window, threads_for
from simgl.camera.distortion import relative_illumination
from simgl.camera.point_spread import Spread, SpreadLight, SunInCamera, spread_key
from simgl.gpu.render_targets import Area, ImageTarget
from simgl.lru_cache import MANY, LruCache

# Of the cached kernels of cameras; those of the last camera stay.
_MAX_BYTES = 512 << 20


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lens:
    """What is computed once for a lens.

    relative_illumination : (height, width) what it leaves off its axis
    """

    spread: Spread
    relative_illumination: Array32

    @property
    def nbytes(self) -> int:
        return self.spread.nbytes + self.relative_illumination.nbytes


def margin_around(camera: Camera, radiance: ImageTarget) -> int:
    """Pixels on each side that a radiance has beyond the image."""
    return (radiance.size[0] - camera.detector.width) // 2


class SpreadPass:
    """A lens that spreads light: the irradiance of its image plane, or the electrons it makes.

    Radiances may have a margin around the image, for light that a lens brings in from there.
    """

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(WORKERS, thread_name_prefix="simgl-convolution")
        self._lenses = LruCache[object, _Lens](MANY, max_bytes=_MAX_BYTES)
        # Of the last image; to make new memory for each takes as long as to fill it.
        self._radiance = np.zeros(0, dtype=np.float32)

    def bands(
        self, camera: Camera, sun: SunInCamera | None, radiance: ImageTarget, target: ImageTarget
    ) -> None:
        """Fill an RGBA32F target with the irradiance of each band [W m-2]."""
        spread, image = self._apply(camera, None, sun, radiance)
        bands = np.stack([spread.image(band)[image] for band in range(4)], axis=-1)
        target.textures[0].write(bands.data)

    def electrons(
        self,
        camera: Camera,
        square: Array,
        sun: SunInCamera | None,
        radiance: ImageTarget,
        target: ImageTarget,
        *,
        lit_area: Area | None = None,
        adds: bool = False,
    ) -> None:
        """Fill a target of ``ELECTRONS_FORMAT`` with mean electrons, or add them to it.

        square : (4, 4) electrons per irradiance and exposure time of the pixels (0, 0), (1, 0),
            (0, 1), (1, 1) in each band [e- W-1 m2 s-1]
        lit_area : outside which the radiance is 0; None where nothing is known of it
        """
        weights, filters = np.unique(square, axis=0, return_inverse=True)
        spread, image = self._apply(camera, weights, sun, radiance, lit_area)
        electrons = spread.mosaic(filters)[image] * np.float32(camera.exposure_time)
        if adds:
            electrons += target.read()
        target.write(electrons)

    def release(self) -> None:
        """End the threads."""
        self._executor.shutdown()

    def _apply(
        self,
        camera: Camera,
        weights: Array | None,
        sun: SunInCamera | None,
        radiance: ImageTarget,
        lit_area: Area | None = None,
    ) -> tuple[SpreadLight, tuple[slice, slice]]:
        """All of the spread radiance, and where the image is in it."""
        d, margin = camera.detector, margin_around(camera, radiance)

        def made() -> _Lens:
            spread = Spread(camera, weights, self._executor, margin)
            relative = relative_illumination(camera.with_margin(margin))
            return _Lens(spread=spread, relative_illumination=relative)

        lens = self._lenses.get(spread_key(camera, weights, margin), made, lambda lens: lens.nbytes)
        window, seen = self._window_read(lens.spread, radiance, lit_area)
        sums = (lens.spread.mixture * irradiance_per_radiance(camera)).astype(np.float32)
        planes = np.empty((len(sums), *window.shape), dtype=np.float32)
        relative = lens.relative_illumination[window.pixels]

        def fill(rows: slice) -> None:
            # Row by row, so that a band's pixels lie side by side afterwards; small products keep
            # the threads of BLAS asleep, which would busy-wait on the cores that the transforms
            # need.
            of_rows = sums @ seen[rows].transpose(0, 2, 1)
            np.multiply(of_rows.transpose(1, 0, 2), relative[rows], out=planes[:, rows])

        parts = threads_for(planes.size)
        ends = np.linspace(0, window.shape[0], parts + 1).astype(int).tolist()
        for _ in self._executor.map(fill, map(slice, ends[:-1], ends[1:])):
            pass
        image = slice(margin, margin + d.height), slice(margin, margin + d.width)
        return lens.spread.within(window, list(planes), sun), image

    def _window_read(
        self, spread: Spread, radiance: ImageTarget, lit_area: Area | None
    ) -> tuple[Window, Array32]:
        """What the lens has to know of an image, and the (rows, columns, 4) radiance there.

        Only of the area that may be lit: to read a megapixel takes as long as its transforms.
        """
        left, top, width, height = (0, 0, *radiance.size) if lit_area is None else lit_area
        width, height = max(width, 1), max(height, 1)
        if self._radiance.size < 4 * width * height:
            self._radiance = np.zeros(4 * width * height, dtype=np.float32)
        part = self._radiance[: 4 * width * height].reshape(height, width, 4)
        radiance.read_area_into(part, (left, top, width, height))
        lit = lit_window(part).shifted(top, left, radiance.size[::-1])
        window = spread.window(lit)
        (rows, columns), (y, x) = window.pixels, (window.rows.start, window.columns.start)
        if min(y - top, x - left, top + height - rows.stop, left + width - columns.stop) >= 0:
            return window, part[window.shifted(-top, -left, part.shape[:2]).pixels]
        seen = np.zeros((*window.shape, 4), dtype=np.float32)
        inside = lit.shifted(-y, -x, window.shape)
        seen[inside.pixels] = part[lit.shifted(-top, -left, part.shape[:2]).pixels]
        return window, seen
