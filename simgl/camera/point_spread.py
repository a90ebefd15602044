"""Effects of a lens on a sharp image: point spread, veiling glare and ghosts.

Results are weighted sums of the four bands: the bands themselves, or the electrons behind each of a
detector's filters. For a single sum, the kernels of the bands are approximated by mixtures of two
kernels. Light and tail of each band stay exact, as both are linear in its wavelength, and so does
the kernel of white; the cores of the bands are a least-squares fit.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.convolution import (
    CELL,
    Convolver,
    Spectrum,
    Window,
    add_coarse,
    between_cells,
    coarse_light,
    coarse_size,
    lit_window,
)
from simgl.camera.ghosts import GhostDisc, add_discs, ghosts
from simgl.camera.pixel_ramp import pixel_ramps
from simgl.camera.psf_kernel import PsfKernel, image_kernel, lens_kernel, lens_reach
from simgl.physics.constants import SOLAR_CONSTANT, SOLAR_TEMPERATURE
from simgl.physics.spectrum import black_body_light

# Pixels beyond this many sunlit white plates are convolved in double precision: the error of single
# precision is then below 3e-5 of a plate.
BRIGHT_PLATES = 300.0
# Ghosts with a narrower edge, in cells of the coarse grid, are drawn at full resolution.
_SOFT_GHOST = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class SunInCamera:
    """The Sun as seen by a camera.

    direction : (3,) unit, towards the Sun, camera axes
    irradiance : (4,) at the lens on a plane that faces the Sun, with eclipse [W m-2]
    angular_radius : [rad]
    """

    direction: Array
    irradiance: Array
    angular_radius: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SpreadSpectra:
    """Spectra of the kernels of a spread, for transforms of whole images.

    near_size, far_size : of those of what is near to its source, and of the coarse grid of what has
        come far, with veiling glare: rows, columns
    near : (zones * planes, rows, columns / 2 + 1), zone by zone; None where nothing is spread
    far : (planes, rows, columns / 2 + 1)
    near_share : of what is near
    """

    near_size: tuple[int, int]
    near: Spectrum | None
    far_size: tuple[int, int]
    far: Spectrum
    near_share: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SpreadLight:
    """Results of a spread: what is near to its source, and what has come far.

    near : (rows, columns) of each result in a window of the image
    far : (results, rows, columns) on the coarse grid of all of it
    sharp : ghosts besides
    """

    window: Window
    near: tuple[Array32, ...]
    far: Array
    sharp: tuple[GhostDisc, ...]

    def image(self, result: int) -> Array32:
        """(height, width) one of the results."""
        image = between_cells(self.far[result], Window.full(self.window.size))
        image[self.window.pixels] += self.near[result]
        _add_sharp(image, self.sharp, result)
        return image

    def mosaic(self, results: IndexArray) -> Array32:
        """(height, width) of each pixel one of the results.

        results : of the pixels (0, 0), (1, 0), (0, 1), (1, 1) and all others like them
        """
        if len(self.near) == 1:
            return self.image(0)
        size, window = self.window.size, self.window
        mosaic = np.empty(size, dtype=np.float32)
        within = mosaic[window.pixels]
        for place, result in enumerate(results.tolist()):
            row, column = divmod(place, 2)
            every = slice(row, size[0], 2), slice(column, size[1], 2)
            mosaic[every] = between_cells(
                self.far[result], Window(rows=every[0], columns=every[1], size=size)
            )
            near = np.s_[
                (row - window.rows.start) % 2 :: 2, (column - window.columns.start) % 2 :: 2
            ]
            within[near] += self.near[result][near]
            if self.sharp:
                ghosts_only = np.zeros(size, dtype=np.float32)
                _add_sharp(ghosts_only, self.sharp, result)
                mosaic[every] += ghosts_only[every]
        return mosaic


class Spread:
    """Point spread, veiling glare and ghosts of one lens, on pixels softened by ``pixel_ramps``.

    weights : (results, 4) of the bands; by default the bands themselves
    margin : pixels around the image of the camera that planes and results have, too
    executor : processes planes in parallel; None for one after the other

    mixture : (planes, 4) weights of the bands in the planes that ``apply`` takes, non-negative
    mixing : (results, planes) how much each plane, spread, counts in each result
    zones : (height, width) weight of each zone in each pixel; None for 1 everywhere
    limits : of each plane; what is brighter is convolved in double precision
    """

    def __init__(
        self,
        camera: Camera,
        weights: Array | None = None,
        executor: Executor | None = None,
        margin: int = 0,
    ) -> None:
        self._half_diagonal = 0.5 * float(np.hypot(camera.detector.width, camera.detector.height))
        self._camera = camera = camera.with_margin(margin)
        self._map = map if executor is None else executor.map
        self._outcome = np.eye(4) if weights is None else weights
        d = camera.detector
        light = black_body_light(SOLAR_CONSTANT, SOLAR_TEMPERATURE, d.bands).irradiance
        zones = None if camera.lens.spread is None else _zone_kernels(camera)
        kernels = zones or []
        if zones is None or zones[0][0].tail == zones[0][3].tail:
            # All bands have the same kernel.
            self.mixture, self.mixing = self._outcome, np.eye(len(self._outcome))
            kernels = [row[:1] * len(self._outcome) for row in kernels]
        elif len(self._outcome) == 1:
            (single,), shares = self._outcome, _shares(zones[0])
            self.mixture, self.mixing = single * shares, np.ones((1, 2))
            kernels = [list(_pair(row, shares, single * light)) for row in zones]
        else:
            self.mixture, self.mixing = np.eye(4), self._outcome
        self.zones: list[Array32 | None] = [None]
        if zones is not None:
            self.zones = _zone_weights(camera, self._half_diagonal)
        self._convolver = None
        if zones is not None:
            self._convolver = Convolver(kernels, self.mixing, d.width, d.height, executor)
        plate = irradiance_per_radiance(camera) * (light / np.pi)
        self.limits = BRIGHT_PLATES * self.mixture @ plate
        self._ghosts = ghosts(camera.lens.surfaces, camera.lens.focal_length)

    @property
    def nbytes(self) -> int:
        """Size of its kernels, their spectra and the weights of its zones."""
        zones = sum(zone.nbytes for zone in self.zones if zone is not None)
        return zones + (0 if self._convolver is None else self._convolver.nbytes)

    def apply(self, planes: Sequence[Array32], sun: SunInCamera | None = None) -> list[Array32]:
        """(height, width) results.

        planes : (height, width) each, non-negative, weighted by ``mixture``
        sun : for ghosts
        """
        window = self.window(lit_window(np.stack(planes, axis=-1)))
        spread = self.within(window, [plane[window.pixels] for plane in planes], sun)
        return [spread.image(index) for index in range(len(self._outcome))]

    def window(self, lit: Window) -> Window:
        """Of an image whose light is all in a window: what ``within`` has to know of it."""
        return lit if self._convolver is None else self._convolver.window(lit)

    def within(
        self, window: Window, planes: Sequence[Array32], sun: SunInCamera | None = None
    ) -> SpreadLight:
        """Of an image that is black outside a window.

        planes : (rows, columns) each in the window, non-negative, weighted by ``mixture``
        sun : for ghosts
        """
        coarse = np.stack(list(self._map(lambda plane: coarse_light(plane, window), planes)))
        if self._convolver is None:
            near = [plane.copy() for plane in planes]
            far = np.zeros_like(coarse)
        else:
            zones = [None if zone is None else zone[window.pixels] for zone in self.zones]
            near = self._convolver.cores(planes, zones, self.limits)
            far = self._convolver.tails(coarse)
        glare = self._camera.lens.veiling_glare
        if glare > 0.0:
            height, width = window.size
            means = coarse.sum(axis=(1, 2)) * CELL**2 / (height * width)
            far = (1.0 - glare) * far + glare * (self.mixing @ means)[:, None, None]
            for plane in near:
                plane *= np.float32(1.0 - glare)
        sharp = self._sharp_ghosts(far, window, planes, sun)
        return SpreadLight(window=window, near=tuple(near), far=far, sharp=sharp)

    def spectra(self) -> SpreadSpectra:
        """What ``within`` does to a whole image, but for what lies beyond the limits and ghosts."""
        d, glare = self._camera.detector, self._camera.lens.veiling_glare
        near_size, near = (d.height, d.width), None
        far_size = coarse_size(near_size)
        far = np.zeros((len(self.mixture), far_size[0], far_size[1] // 2 + 1), dtype=np.complex64)
        if self._convolver is not None:
            near_size, cores = self._convolver.core_spectra()
            near = np.stack(cores).astype(np.complex64)
            far += (1.0 - glare) * np.stack(self._convolver.tail_spectra())
        # The mean of a plane, from its sum.
        far[:, 0, 0] += glare * CELL**2 / (d.height * d.width)
        return SpreadSpectra(
            near_size=near_size, near=near, far_size=far_size, far=far, near_share=1.0 - glare
        )

    def add_excess(self, results: Array32, place: tuple[int, int], excess: Array) -> None:
        """Add to (results, height, width) what pixels beyond the limits bring.

        place, excess : as of ``Convolver.add_excess``
        """
        if self._convolver is not None:
            near_share = 1.0 - self._camera.lens.veiling_glare
            self._convolver.add_excess(list(results), place, near_share * excess)

    def add_ghosts(
        self, results: Array32, window: Window, planes: Sequence[Array32], sun: SunInCamera
    ) -> None:
        """Add the Sun's ghosts to (results, height, width).

        window, planes : of ``sun_window``, and the light there
        """
        far = np.zeros((len(results), *(-(-pixels // CELL) for pixels in window.size)))
        sharp = self._sharp_ghosts(far, window, planes, sun)
        for index, (result, coarse) in enumerate(zip(results, far, strict=True)):
            add_coarse(result, coarse)
            _add_sharp(result, sharp, index)

    def sun_window(self, sun: SunInCamera) -> Window | None:
        """What has to be known of an image to tell the Sun's ghosts; None if it makes none."""
        if not self._makes_ghosts(sun):
            return None
        row, column, _ = self._pixels_of_sun(*self._image_of(sun))
        rows, columns = (
            slice(int(of[0]), int(of[-1]) + 1) if of.size else slice(0, 0) for of in (row, column)
        )
        d = self._camera.detector
        return Window(rows=rows, columns=columns, size=(d.height, d.width))

    def _sharp_ghosts(
        self, far: Array, window: Window, planes: Sequence[Array32], sun: SunInCamera | None
    ) -> tuple[GhostDisc, ...]:
        """The Sun's ghosts but for those with soft edges, which are added to what has come far."""
        discs = [] if sun is None else self._discs(window, planes, sun)
        soft = [disc for disc in discs if disc.edge >= _SOFT_GHOST * CELL]
        add_discs(list(far), soft, CELL)
        return tuple(disc for disc in discs if disc not in soft)

    def _image_of(self, sun: SunInCamera) -> tuple[Array, float]:
        """Column and row of the Sun's image, NaN where the lens sees none, and its radius [px]."""
        radius = float(np.tan(sun.angular_radius)) * self._camera.focal_length_px
        return self._camera.project(sun.direction), radius

    def _makes_ghosts(self, sun: SunInCamera) -> bool:
        if not self._ghosts:
            return False
        d, (place, radius) = self._camera.detector, self._image_of(sun)
        off_centre = float(np.linalg.norm(place - 0.5 * np.array([d.width, d.height])))
        return off_centre <= self._half_diagonal + radius

    def _discs(
        self, window: Window, planes: Sequence[Array32], sun: SunInCamera
    ) -> list[GhostDisc]:
        """Ghosts of the Sun, if its image touches the circle around the camera's image.

        Beyond that circle a lens hood is assumed to block the Sun.
        """
        if not self._makes_ghosts(sun):
            return []
        camera, lens, pitch = self._camera, self._camera.lens, self._camera.detector.pixel_pitch
        turns, focal_length = False, lens.focal_length
        if lens.distortion is not None:
            turns, focal_length = lens.distortion.pupil_turns, focal_length * lens.distortion.scale
        pupil = 0.5 * focal_length / lens.f_number
        collected = sun.irradiance * irradiance_per_radiance(camera) * focal_length**2
        place, radius = self._image_of(sun)
        direct = self._outcome @ collected / pitch**2
        direct *= self._visible_share(window, planes, place, radius)
        # A pupil that faces the boresight is foreshortened.
        direct *= 1.0 if turns else sun.direction[2]
        middle = np.array(camera.principal_point)
        discs = []
        for ghost in self._ghosts:
            x, y = middle + ghost.lever / lens.focal_length * (place - middle)
            discs.append(
                GhostDisc(
                    x=float(x),
                    y=float(y),
                    # No disc is smaller than a pixel.
                    pupil=max(ghost.spread * pupil / pitch, 0.6),
                    sun=max(abs(ghost.lever) * sun.angular_radius / pitch, 0.6),
                    power=ghost.share * direct,
                )
            )
        return discs

    def _visible_share(
        self, window: Window, planes: Sequence[Array32], place: Array, radius: float
    ) -> float:
        """Fraction of the Sun's pixels that no spacecraft covers; 1 if it has none in the image."""
        row, column, inside = self._pixels_of_sun(place, radius)
        if not inside.any():
            return 1.0
        # Outside the window all is black.
        lit_row, lit_column = (
            (places >= lit.start) & (places < lit.stop)
            for places, lit in ((row, window.rows), (column, window.columns))
        )
        part = np.ix_(row[lit_row] - window.rows.start, column[lit_column] - window.columns.start)
        seen = inside[np.ix_(lit_row, lit_column)]
        bright = [plane[part][seen] > lim for plane, lim in zip(planes, self.limits, strict=True)]
        return float(np.any(bright, axis=0).sum() / inside.sum())

    def _pixels_of_sun(self, place: Array, radius: float) -> tuple[IndexArray, IndexArray, Mask]:
        """Rows and columns around the Sun's image, and which of their pixels are in it."""
        d, (x, y) = self._camera.detector, place
        reach = max(0.9 * radius, 0.75)
        row = np.arange(max(int(y - reach), 0), min(int(y + reach) + 1, d.height))
        column = np.arange(max(int(x - reach), 0), min(int(x + reach) + 1, d.width))
        return row, column, np.hypot((row + 0.5 - y)[:, None], column + 0.5 - x) <= reach


def spread_key(camera: Camera, weights: Array | None, margin: int) -> Hashable:
    """Equal where a ``Spread`` of these is.

    Neither exposure time nor electronics count: a control loop may set them for every image.
    """
    detector, summed = camera.detector, None if weights is None else weights.tobytes()
    spectrum = detector.bands, detector.pixel_curves
    return camera.lens, camera.geometry, margin, detector.pixel_pitch, spectrum, summed


def has_spread(camera: Camera) -> bool:
    """Whether a camera's lens has a point spread, veiling glare or ghosts."""
    lens = camera.lens
    return lens.spread is not None or lens.veiling_glare > 0.0 or bool(lens.surfaces)


def _add_sharp(image: Array32, discs: Iterable[GhostDisc], result: int) -> None:
    """Add what discs bring of one of the results."""
    of_result = [replace(disc, power=disc.power[[result]]) for disc in discs]
    add_discs([image], of_result, 1)


def _zone_kernels(camera: Camera) -> list[list[PsfKernel]]:
    """Kernels of the four bands for each zone."""
    spread = camera.lens.spread
    assert spread is not None
    if spread.image is not None:
        return [[image_kernel(np.array(spread.image), spread.image_scale)] * 4]
    reach, ramps = max(lens_reach(camera, zone.blur) for zone in spread.zones), pixel_ramps(camera)
    if not spread.diffraction:
        return [[lens_kernel(camera, zone.blur, 0, reach, ramps[0])] * 4 for zone in spread.zones]
    return [
        [lens_kernel(camera, zone.blur, band, reach, ramp) for band, ramp in enumerate(ramps)]
        for zone in spread.zones
    ]


def _zone_weights(camera: Camera, half_diagonal: float) -> list[Array32 | None]:
    """(height, width) weight of each zone in each pixel; None for 1 everywhere.

    half_diagonal : of the image [px]

    Blur off the axis grows from where the axis meets the image, as do the angles of its rays.
    """
    spread, d = camera.lens.spread, camera.detector
    assert spread is not None
    if len(spread.zones) == 1 or spread.image is not None:
        return [None]
    axis_x, axis_y = camera.principal_point
    x, y = np.arange(d.width) + 0.5 - axis_x, np.arange(d.height) + 0.5 - axis_y
    share = np.hypot(y[:, None], x) / half_diagonal
    nodes = np.array([zone.share for zone in spread.zones])
    return [np.interp(share, nodes, hat).astype(np.float32) for hat in np.eye(len(nodes))]


def _shares(kernels: Sequence[PsfKernel]) -> Array:
    """(2, 4) weights of two kernels in each band's, by the tails: shortest, longest wavelength."""
    tails = np.array([kernel.tail for kernel in kernels])
    long = (tails - tails.min()) / (tails.max() - tails.min())
    return np.stack([1.0 - long, long])


def _pair(kernels: Sequence[PsfKernel], shares: Array, light: Array) -> tuple[PsfKernel, PsfKernel]:
    """Two kernels whose mixtures approximate the kernels of all bands (least squares).

    light : (4,) of the Sun, weighted as the bands are summed

    The kernel of white in sunlight, the sum of all, counts a hundredfold, which makes it exact.
    """
    cores = light[:, None] * np.stack([kernel.core.ravel() for kernel in kernels])
    of_light = (shares * light).T
    fitted, *_ = np.linalg.lstsq(
        np.concatenate([of_light, 100.0 * of_light.sum(axis=0, keepdims=True)]),
        np.concatenate([cores, 100.0 * cores.sum(axis=0, keepdims=True)]),
        rcond=None,
    )
    tails = [kernel.tail for kernel in kernels]
    short, long = fitted.reshape(2, *kernels[0].core.shape)
    return (
        PsfKernel(0.5 * (short + short[::-1, ::-1]), min(tails)),
        PsfKernel(0.5 * (long + long[::-1, ::-1]), max(tails)),
    )
