"""Spread on a GPU: point spread, scattered light and ghosts of a lens, by compute shaders.

The same as ``spread`` in single precision: the radiance stays on the GPU. Only pixels far brighter
than the rest (the Sun, glints), and the Sun's ghosts, are left to the CPU; most images have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.convolution import CELL, Window
from simgl.camera.distortion import relative_illumination
from simgl.camera.point_spread import Spread, SpreadSpectra, SunInCamera, spread_key
from simgl.gpu.compute_program import ComputeProgram
from simgl.gpu.context import wait_for_draws
from simgl.gpu.fourier import ComplexLayers, FourierTransforms
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Area, ImageTarget
from simgl.lru_cache import MANY, LruCache

# Of the cached spectra of lenses; those of the last lens stay.
_MAX_BYTES = 1 << 30
# As struct Plane of shaders/spread/plane.glsl.
_PLANE = np.dtype([("weights", "<f4", 4), ("limit", "<f4"), ("padding", "<f4", 3)])
# Of no pixel: first column and row, last column and row.
_NOTHING_BRIGHT = np.array([2**31 - 1, 2**31 - 1, -1, -1], dtype=np.int32)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lens:
    """What is computed once for a lens.

    margin : pixels around the image that the radiance has, too
    sums : (planes, 4) of the bands of the radiance
    relative_illumination : (height, width) what it leaves off its axis
    spectra : of its kernels, which are on the GPU too
    planes, illumination : buffers of the shaders; ``by_zone``: of each zone
    near, far : kernels
    shares, near_shares : how much each plane counts in each result; that of each zone
    """

    spread: Spread
    margin: int
    sums: Array
    relative_illumination: Array32
    spectra: SpreadSpectra
    planes: moderngl.Buffer
    illumination: moderngl.Buffer
    by_zone: moderngl.Buffer
    near: moderngl.Buffer | None
    far: moderngl.Buffer
    shares: moderngl.Buffer
    near_shares: moderngl.Buffer

    @property
    def nbytes(self) -> int:
        """In the memory of the GPU and outside it."""
        return sum(int(buffer.size) for buffer in self._buffers) + self.spread.nbytes

    @property
    def _buffers(self) -> list[moderngl.Buffer]:
        near = [] if self.near is None else [self.near]
        others = self.planes, self.illumination, self.by_zone, self.far, self.shares
        return [*near, *others, self.near_shares]

    def release(self) -> None:
        """Free the buffers."""
        for buffer in self._buffers:
            buffer.release()


class ComputeSpreadPass:
    """``SpreadPass`` for GPUs, by compute shaders."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._lenses = LruCache[object, _Lens](MANY, _Lens.release, max_bytes=_MAX_BYTES)
        self._transforms = FourierTransforms(ctx)
        self._programs: dict[tuple[object, ...], ComputeProgram] = {}
        # By use, of the last image.
        self._layers: dict[str, ComplexLayers] = {}
        self._bright = ctx.buffer(_NOTHING_BRIGHT.tobytes())

    def bands(
        self, camera: Camera, sun: SunInCamera | None, radiance: ImageTarget, target: ImageTarget
    ) -> None:
        """Fill an RGBA32F target with the irradiance of each band [W m-2]."""
        lens = self._lens(camera, None, radiance)
        self._compose(lens, radiance, sun, target, factor=1.0)

    def electrons(
        self,
        camera: Camera,
        square: Array,
        sun: SunInCamera | None,
        radiance: ImageTarget,
        target: ImageTarget,
        *,
        lit_area: Area | None = None,  # noqa: ARG002 - as the other pass
        adds: bool = False,
    ) -> None:
        """Fill a target of ``ELECTRONS_FORMAT`` with mean electrons, or add them to it.

        square : (4, 4) electrons per irradiance and exposure time of the pixels (0, 0), (1, 0),
            (0, 1), (1, 1) in each band [e- W-1 m2 s-1]
        lit_area : makes no difference here: dark pixels take a GPU no time
        """
        weights, filters = np.unique(square, axis=0, return_inverse=True)
        lens, factor = self._lens(camera, weights, radiance), camera.exposure_time
        self._compose(lens, radiance, sun, target, factor=factor, filters=filters, adds=adds)

    def _lens(self, camera: Camera, weights: Array | None, radiance: ImageTarget) -> _Lens:
        margin = (radiance.size[0] - camera.detector.width) // 2
        return self._lenses.get(
            spread_key(camera, weights, margin),
            lambda: self._made(camera, weights, margin),
            lambda lens: lens.nbytes,
        )

    def _made(self, camera: Camera, weights: Array | None, margin: int) -> _Lens:
        spread = Spread(camera, weights, None, margin)
        spectra = spread.spectra()
        relative = relative_illumination(camera.with_margin(margin))
        sums = spread.mixture * irradiance_per_radiance(camera)
        planes = np.zeros(len(sums), dtype=_PLANE)
        planes["weights"] = sums
        planes["limit"] = np.inf if spectra.near is None else spread.limits
        by_zone = np.stack([relative if zone is None else relative * zone for zone in spread.zones])
        shares = np.zeros((len(sums), 4), dtype=np.float32)
        shares[:, : len(spread.mixing)] = spread.mixing.T
        return _Lens(
            spread=spread,
            margin=margin,
            sums=sums,
            relative_illumination=relative,
            spectra=spectra,
            planes=self._ctx.buffer(planes.tobytes()),
            illumination=self._ctx.buffer(np.ascontiguousarray(relative, dtype=np.float32)),
            by_zone=self._ctx.buffer(by_zone.astype(np.float32).tobytes()),
            near=None if spectra.near is None else self._ctx.buffer(spectra.near.tobytes()),
            far=self._ctx.buffer(spectra.far.tobytes()),
            shares=self._ctx.buffer(shares.tobytes()),
            near_shares=self._ctx.buffer(np.tile(shares, (len(spread.zones), 1)).tobytes()),
        )

    def _compose(
        self,
        lens: _Lens,
        radiance: ImageTarget,
        sun: SunInCamera | None,
        target: ImageTarget,
        *,
        factor: float,
        filters: IndexArray | None = None,
        adds: bool = False,
    ) -> None:
        """Write a spread radiance, times a factor: all bands, or behind the filters (4,) of the
        pixels (0, 0), (1, 0), (0, 1), (1, 1)."""
        near, far = self._near(lens, radiance), self._far(lens, radiance)
        # Meanwhile the GPU transforms.
        besides = self._besides(lens, radiance, sun)
        buffers, defines = [near.values, far.values], {"CELL": CELL}
        names, given = ["image", "margin", "near_size", "far_size", "near_share", "factor"], {}
        if filters is not None:
            defines["MOSAIC"] = 1
            given = {"results": tuple(filters.ravel().tolist()), "adds": int(adds)}
        if besides is not None:
            defines["BESIDES"] = 1
            buffers.append(besides)
        program = self._program("compose", (*names, *given), defines, samplers=())
        target.textures[0].bind_to_image(0)
        program.run(
            (*target.textures[0].size, 1),
            buffers,
            image=radiance.size,
            margin=lens.margin,
            near_size=near.columns_and_rows,
            far_size=far.columns_and_rows,
            near_share=lens.spectra.near_share,
            factor=factor,
            **given,
        )
        if besides is not None:
            besides.release()

    def _near(self, lens: _Lens, radiance: ImageTarget) -> ComplexLayers:
        """Results (two a layer) of what is near to its source."""
        spread, size = lens.spread, lens.spectra.near_size
        inputs = len(spread.zones) * len(lens.sums)
        light = self._layers_for("near", inputs, size)
        self._bright.write(_NOTHING_BRIGHT.tobytes())
        radiance.textures[0].use(0)
        self._planes_program(lens, "size").run(
            (*light.columns_and_rows, 1),
            (lens.planes, lens.by_zone, light.values, self._bright),
            size=light.columns_and_rows,
        )
        if lens.near is None:
            return light
        return self._convolved("near", lens, light, lens.near, lens.near_shares)

    def _far(self, lens: _Lens, radiance: ImageTarget) -> ComplexLayers:
        """Results (two a layer) of what has come far, on the coarse grid."""
        light = self._layers_for("far", len(lens.sums), lens.spectra.far_size)
        defines = {"CELL": CELL, "PLANES": len(lens.sums)}
        radiance.textures[0].use(0)
        self._program("cells", ("size",), defines).run(
            (*light.columns_and_rows, 1),
            (lens.planes, lens.illumination, light.values),
            size=light.columns_and_rows,
        )
        return self._convolved("far", lens, light, lens.far, lens.shares)

    def _convolved(
        self,
        use: str,
        lens: _Lens,
        light: ComplexLayers,
        kernels: moderngl.Buffer,
        shares: moderngl.Buffer,
    ) -> ComplexLayers:
        """Sums of inputs, each convolved with its kernel."""
        results, inputs = len(lens.spread.mixing), int(shares.size) // 16
        mixed = self._layers_for(f"{use} results", results, light.size)
        self._transforms.transform(light)
        defines = {"INPUTS": inputs, "RESULTS": results}
        self._program("mix", ("size",), defines, samplers=()).run(
            (*light.columns_and_rows, 1),
            (light.values, mixed.values, kernels, shares),
            size=light.columns_and_rows,
        )
        self._transforms.inverse(mixed)
        return mixed

    def _besides(
        self, lens: _Lens, radiance: ImageTarget, sun: SunInCamera | None
    ) -> moderngl.Buffer | None:
        """(results, height, width) light of what is too bright for single precision, and ghosts."""
        bright = self._bright_area()
        window = None if sun is None else lens.spread.sun_window(sun)
        if bright is None and window is None:
            return None
        columns, rows = radiance.size
        results = np.zeros((len(lens.spread.mixing), rows, columns), dtype=np.float32)
        if bright is not None:
            excess = self._excess(lens, radiance, bright)
            lens.spread.add_excess(results, (bright[1], bright[0]), excess)
        if sun is not None and window is not None:
            lens.spread.add_ghosts(results, window, self._seen(lens, radiance, window), sun)
        return self._ctx.buffer(results.tobytes())

    def _bright_area(self) -> Area | None:
        """What holds all pixels beyond the limits."""
        wait_for_draws(self._ctx)
        left, top, right, bottom = np.frombuffer(self._bright.read(), dtype=np.int32).tolist()
        return (left, top, right + 1 - left, bottom + 1 - top) if left <= right else None

    def _excess(self, lens: _Lens, radiance: ImageTarget, area: Area) -> Array:
        """(zones, planes, rows, columns) light of the pixels beyond the limits.

        area : x, y, columns, rows that hold them all
        """
        shape = len(lens.spread.zones), len(lens.sums), area[3], area[2]
        excess = self._ctx.buffer(reserve=4 * int(np.prod(shape)))
        radiance.textures[0].use(0)
        buffers = lens.planes, lens.by_zone, excess
        self._planes_program(lens, "rectangle").run((*area[2:], 1), buffers, rectangle=area)
        wait_for_draws(self._ctx)
        values = np.frombuffer(excess.read(), dtype=np.float32).reshape(shape)
        excess.release()
        return values.astype(np.float64)

    @staticmethod
    def _seen(lens: _Lens, radiance: ImageTarget, window: Window) -> list[Array32]:
        """The planes in a window."""
        rows, columns = window.shape
        seen = np.zeros((rows, columns, 4), dtype=np.float32)
        if seen.size:
            radiance.read_area_into(seen, (window.columns.start, window.rows.start, columns, rows))
        relative = lens.relative_illumination[window.pixels]
        return [(seen @ row.astype(np.float32)) * relative for row in lens.sums]

    def _layers_for(self, use: str, values: int, size: tuple[int, int]) -> ComplexLayers:
        """Layers that hold so many values of each pixel, two in one."""
        layers, present = -(-values // 2), self._layers.get(use)
        if present is None or (present.layers, present.size) != (layers, size):
            if present is not None:
                self._layers.pop(use).release()
            present = self._layers[use] = ComplexLayers(self._ctx, layers, size)
        return present

    def _planes_program(self, lens: _Lens, parameter: str) -> ComputeProgram:
        defines = {"ZONES": len(lens.spread.zones), "PLANES": len(lens.sums)}
        if parameter == "rectangle":
            defines["EXCESS"] = 1
        return self._program("planes", (parameter,), defines)

    def _program(
        self,
        name: str,
        parameters: Sequence[str],
        defines: Mapping[str, int],
        samplers: Sequence[str] = ("radiance",),
    ) -> ComputeProgram:
        key = name, *defines.items()
        if key not in self._programs:
            self._programs[key] = ComputeProgram(
                self._ctx,
                f"spread/{name}",
                samplers=samplers,
                parameters=parameters,
                defines=defines,
            )
        return self._programs[key]

    def release(self) -> None:
        """Free everything."""
        self._lenses.clear()
        release_all(self._ctx, *self._programs.values(), *self._layers.values())
        self._programs.clear()
        self._layers.clear()
        self._transforms.release()
        self._bright.release()
