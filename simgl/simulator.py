"""The simulator: renders captures of a scenario. Most programs hold one."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Literal

import moderngl

from simgl.camera.camera import Camera
from simgl.camera.image_margin import image_margin
from simgl.errors import ConfigError, did_you_mean
from simgl.garbage_collection import collect_again, leave_out_of_collections
from simgl.gpu.context import close_context, current, is_closed, open_context, preserve_current
from simgl.gpu.release import freed_on_error
from simgl.gpu.render_targets import ImageTarget
from simgl.gpu.timers import PassTimer
from simgl.images import Capture as Capture
from simgl.images import DigitalFrame, ElectronFrame, FrameInfo
from simgl.products import ALL_PRODUCTS as ALL_PRODUCTS
from simgl.products import Product as Product
from simgl.products import check_products
from simgl.products import products_of as products_of
from simgl.progress import ProgressCallback, begin_stage
from simgl.rendering.camera_pipeline import CameraPipeline
from simgl.rendering.first_image import prepare_first_image
from simgl.rendering.renderer import Renderer
from simgl.rendering.scene_frames import scene_frames
from simgl.rendering.spacecraft_skies import SpacecraftSkies
from simgl.rendering.still_scene import StillScene, with_settings
from simgl.rendering.thermal_frames import ThermalScene, thermal_capture
from simgl.scenario.scenario import Scenario
from simgl.scene.lamp_response import DetectorLight, lit_for_detector
from simgl.scene.state import SceneState
from simgl.thermal.scene_temperatures import TemperatureHistory, Temperatures, ThermalBodies
from simgl.view.exposure_parts import ExposurePart, moving_scene
from simgl.view.exposure_views import MovingViews
from simgl.view.frame_view import FrameView, frame_view
from simgl.view.mean_sunlight import with_mean_sunlight

# Independent of the camera's settings.
_OF_THE_SCENE = frozenset({Product.RADIANCE, Product.LAYERS, Product.TRUTH, Product.NORMALS})


@dataclass(frozen=True, eq=False)
class _Drawn:
    """A capture whose DN, if any, have not been read back yet."""

    frames: Capture
    dn: ImageTarget | None = None


class Simulator(AbstractContextManager["Simulator"]):
    """Captures images of a scenario. An image depends only on the given state.

    scenario : provides models, Earth and render settings
    ctx : OpenGL context to use; without it the simulator opens its own and closes it at the end
    progress : called with the finished and the total steps while interreflection is traced and
        tables of atmosphere and Earth are computed: some seconds for each that is new

    Raises ContextError if there is no usable OpenGL, and ConfigError for a camera whose image size
    the driver does not support. Use it in a ``with`` statement, or call ``close``.

    >>> ball = {"sphere": {"radius_m": 1.0, "material": {"reflectance": 0.5}}}
    >>> about = {"target": "ball", "azimuth_deg": 0.0, "range_m": 9.0}
    >>> scenario = simgl.scenario_from_dict({
    ...     "epoch": {"utc": "2026-03-20T12:00:00"},
    ...     "spacecraft": {"ball": {"model": ball, "orbit": {"altitude_km": 400.0}}},
    ...     "camera": {"cam": {"about": about, "width_px": 64, "height_px": 48}},
    ... })
    >>> with simgl.Simulator(scenario) as simulator:
    ...     capture = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam")
    >>> capture.digital.dn.shape
    (48, 64)
    """

    def __init__(
        self,
        scenario: Scenario,
        ctx: moderngl.Context | None = None,
        progress: ProgressCallback | None = None,
    ) -> None:
        self.scenario = scenario
        self._owns_ctx = ctx is None
        with preserve_current():
            self._ctx = open_context() if ctx is None else ctx
        with ExitStack() as undo:
            if self._owns_ctx:
                undo.callback(close_context, self._ctx)
            begin_stage(progress, "compiling shaders")
            with current(self._ctx), freed_on_error(self._ctx), ExitStack() as release:
                self._renderer = Renderer(self._ctx)
                release.callback(self._renderer.release)
                for camera in scenario.cameras.values():
                    self._check_size(camera)
                self._camera_pipeline = CameraPipeline(self._ctx, self._renderer.timer)
                release.callback(self._camera_pipeline.release)
                prepare_first_image(self._renderer, self._camera_pipeline, scenario, progress)
                release.pop_all()
            undo.pop_all()
        self.skies = SpacecraftSkies(self._renderer, self._ctx)
        self.thermal_bodies = ThermalBodies(scenario.thermal_patches, self.skies)
        self.renderer_name = f"{self._ctx.info['GL_RENDERER']}, {self._ctx.info['GL_VERSION']}"
        leave_out_of_collections(self)

    @property
    def timer(self) -> PassTimer:
        """Timer of the passes; disabled by default."""
        return self._renderer.timer

    @cached_property
    def temperatures(self) -> TemperatureHistory:
        """Temperatures of the spacecraft, by the scenario's laws from its epoch on."""
        scenario = self.scenario
        return TemperatureHistory(
            self.thermal_bodies,
            scenario.at,
            scenario.epoch_tai_ns,
            round(1e9 * scenario.thermal_step),
        )

    @property
    def gl_error(self) -> str:
        """The OpenGL error since the last query, "GL_NO_ERROR" if there is none."""
        with current(self._ctx):
            return str(self._ctx.error)

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: Collection[Product] = frozenset({Product.DN}),
        during: Callable[[int], SceneState] | None = None,
        seed: int | None = None,
        draw: int = 0,
        temperatures: Temperatures | None = None,
    ) -> Capture:
        """Capture the image of one camera.

        state : of the scene at mid-exposure
        camera : its name
        products : frames of the capture, see ``Product``
        during : the scene at a time [TAI ns] of the exposure, such as ``scenario.around(tai_ns)``;
            electrons and DN then have motion blur and rolling shutter. Without it the scene is
            static, as it always is for radiance and truth
        seed : of the noise; the scenario's if omitted
        draw : distinguishes images of one epoch: equal draws have equal noise, different draws
            independent noise; 0 to 2^32 - 1
        temperatures : of the spacecraft, for thermal cameras, for instance from
            ``TemperatureHistory``; those of the steady state if omitted. The frame says which

        Raises ConfigError for an unknown camera, for a camera inside a body and for a product that
        the camera does not have; ValueError for what is no product, and for a draw or seed that is
        no integer from 0 to 2^32 - 1.
        """
        (capture,) = self.captures(state, {camera: products}, during, seed, draw, temperatures)
        return capture

    def capture_at(
        self, tai_ns: int, camera: str, products: Collection[Product], draw: int = 0
    ) -> Capture:
        """Capture the image at a time at which all follow the scenario's laws: with motion during
        the exposure, and temperatures since the scenario's epoch.

        tai_ns : mid-exposure [TAI ns]
        camera, products, draw : as for ``capture``

        Raises as ``capture`` does.
        """
        thermal = camera in self.scenario.cameras and self.scenario.cameras[camera].thermal
        return self.capture(
            self.scenario.at(tai_ns),
            camera,
            products,
            during=self.scenario.around(tai_ns),
            draw=draw,
            temperatures=self.temperatures.at(tai_ns) if thermal else None,
        )

    def captures(
        self,
        state: SceneState,
        cameras: Mapping[str, Collection[Product]],
        during: Callable[[int], SceneState] | None = None,
        seed: int | None = None,
        draw: int = 0,
        temperatures: Temperatures | None = None,
    ) -> tuple[Capture, ...]:
        """Capture the images of several cameras of one scene, each as by ``capture``.

        This is faster than separate calls, since DN are read back after all images are submitted.

        cameras : camera name to products
        state, during, seed, draw, temperatures : as for ``capture``, for all cameras
        """
        unread = []
        # Another simulator of this process may have made its own context current.
        with current(self._ctx), freed_on_error(self._ctx):
            for place, (camera, products) in enumerate(cameras.items()):
                still = self._still(state, camera, seed, draw)
                check_products(still.camera, products, self.scenario.name)
                frames = scene_frames(still, self._camera_pipeline, frozenset(products))
                if still.camera.thermal is not None:
                    temperatures = temperatures or self.thermal_bodies.steady(state)
                    view_of = partial(self._view, camera=camera)
                    warm = ThermalScene(still, self.thermal_bodies, temperatures, during, view_of)
                    unread.append(_Drawn(thermal_capture(frames, warm, frozenset(products))))
                    continue
                counts = Product.DN in products or Product.ELECTRONS in products
                electrons = self._electrons(self._over_exposure(still, during)) if counts else None
                unread.append(self._with_counts(frames, still, electrons, products, place))
            return tuple(self._read(drawn) for drawn in unread)

    def bracket(
        self,
        state: SceneState,
        camera: str,
        settings: Sequence[Camera],
        products: Collection[Product] = frozenset({Product.DN}),
        first_draw: int = 0,
    ) -> tuple[Capture, ...]:
        """Capture one instant with several settings of a camera; the scene is rendered once.

        state, camera, products : as for ``capture``
        settings : the camera with different exposure times, f-numbers, filters or electronics;
            image size and field of view must be the same. Frames of radiance and truth refer to
            the scenario's camera
        first_draw : draw of the first image; it increases by 1 per image, so that each has its own
            noise

        Raises ConfigError and ValueError like ``capture``, and ValueError for a camera with a
        different field of view.
        """
        still = self._still(state, camera, draw=first_draw)
        if still.camera.thermal is not None:
            problem = "sees thermal radiation; a bracket is of visible light"
            raise ConfigError(self.scenario.name, f'camera "{camera}"', problem)
        check_products(still.camera, products, self.scenario.name)
        every = [still.camera, *settings]
        if len({(c.name, c.detector.pixel_pitch, c.geometry) for c in every}) > 1:
            raise ValueError("a setting changes the size or the field of view of the image")
        captures = []
        with current(self._ctx), freed_on_error(self._ctx):
            shared = scene_frames(still, self._camera_pipeline, _OF_THE_SCENE & frozenset(products))
            for draw, setting in enumerate(settings, first_draw):
                still_with = still.with_camera(setting, draw)
                frames = replace(shared, info=still_with.info)
                electrons = self._electrons(still_with)
                drawn = self._with_counts(frames, still_with, electrons, products)
                captures.append(self._read(drawn))
        return tuple(captures)

    def _check_size(self, camera: Camera) -> None:
        try:
            self._renderer.sizes.check(camera)
        except ConfigError as error:
            where = f"{self.scenario.source or self.scenario.name} {error.where}"
            raise ConfigError(where, error.key, error.problem) from None

    def _still(
        self, state: SceneState, camera: str, seed: int | None = None, draw: int = 0
    ) -> StillScene:
        if camera not in state.cameras:
            problem = f"is not in the scenario; {did_you_mean(camera, state.cameras)}"
            raise ConfigError(self.scenario.name, f'camera "{camera}"', problem)
        self._check_size(state.cameras[camera].camera)
        placed = state.cameras[camera]
        sun = state.sun.seen_from(placed.position)
        info = FrameInfo(
            scenario=self.scenario.name,
            camera=placed.camera,
            epoch_tai_ns=state.tai_ns,
            position=placed.position,
            R_camera_from_icrf=placed.R_camera_from_icrf,
            sun_direction_icrf=sun.direction_icrf,
            sun_irradiance=sun.irradiance,
            seed=self.scenario.seed if seed is None else seed,
            renderer=self.renderer_name,
            draw=draw,
            interreflection=self._interreflection(state),
        )
        view = cache(lambda margin: self._view(state, camera, margin))
        return StillScene(self._renderer, state, view, info)

    def _view(
        self, state: SceneState, camera: str, margin: int = 0, part: ExposurePart | None = None
    ) -> FrameView:
        """The view of a camera at a state with so many pixels around its image, or over the part of
        an exposure around it."""
        placed = state.cameras.get(camera)
        # Thermal images do not need visible light between surfaces.
        lit = placed is None or placed.camera.thermal is None
        try:
            return frame_view(
                state,
                camera,
                sample_budget=self._renderer.sample_budget,
                samples_per_pixel=self.scenario.samples_per_pixel,
                inter_reflection=lit and self.scenario.inter_reflection,
                between_spacecraft=lit and self.scenario.between_spacecraft,
                gather=self.scenario.gather,
                glossy_reflections=lit and self.scenario.glossy_reflections,
                joint_light=self.scenario.joint_light,
                margin=margin,
                part=part,
            )
        except ConfigError as error:
            where = f"{self.scenario.source or self.scenario.name} {error.where}"
            raise ConfigError(where, error.key, error.problem) from None

    def _over_exposure(
        self, still: StillScene, during: Callable[[int], SceneState] | None
    ) -> StillScene:
        """The scene during the exposure; a still scene if nothing moves visibly."""
        camera = still.camera.name
        if during is None:
            return still
        seen_by = still.state.cameras[camera].camera
        around = with_settings(still.state, seen_by.with_margin(image_margin(still.camera)))
        if (scene := moving_scene(around, camera, during)) is None:
            info, length = still.info, still.camera.exposure_time

            def at(offset: float) -> SceneState:
                return during(info.epoch_tai_ns + round(1e9 * offset))

            lit = with_mean_sunlight(still.state, camera, at, 0.0, length)
            return still if lit is still.state else self._still(lit, camera, info.seed, info.draw)
        moving = MovingViews(
            scene=scene, view_of=lambda part: self._view(part.state, camera, part=part)
        )
        return replace(still, moving=moving, lit={}, drawn={})

    def _interreflection(self, state: SceneState) -> Literal["off", "quick", "exact"]:
        """See ``FrameInfo``."""
        if not self.scenario.inter_reflection:
            return "off"
        moved = any(body.model.angles for body in state.bodies.values())
        return self.scenario.joint_light if moved else "exact"

    def _electrons(self, still: StillScene) -> ImageTarget:
        """Mean electrons of the scene."""
        camera, pipeline = still.camera, self._camera_pipeline
        colours = lit_for_detector(still.state, camera.detector)
        if len(colours) == 1:
            photons = still.state.sun.photons_per_joule
            seen = self._lit_for(still, colours, 0)
            area = seen.lit_area
            return pipeline.electrons_through(camera, photons, seen.softened, seen.sun, area)
        lights = (
            self._lit_for(still, colours, index).lit_for(replace(camera, detector=colour.detector))
            for index, colour in enumerate(colours)
        )
        return pipeline.electrons_by_colour(camera, lights)

    def _lit_for(
        self, still: StillScene, colours: Sequence[DetectorLight], index: int
    ) -> StillScene:
        """The scene with its lamps weighted by the response of the pixels of one colour; the last
        result is cached, for the settings of a bracket."""
        camera, light = still.camera, colours[index]
        if light.key == b"":
            return still
        if still.lit.get(light.key) is None:
            still.lit.clear()
            lit = self._still(replace(still.state, lamps=light.lamps), camera.name)
            if still.moving is not None:
                lit.moving = still.moving.lit_by(
                    lambda state: lit_for_detector(state, camera.detector)[index].lamps
                )
            still.lit[light.key] = lit
        return still.lit[light.key]

    def _with_counts(
        self,
        frames: Capture,
        still: StillScene,
        electrons: ImageTarget | None,
        products: Collection[Product],
        place: int = 0,
    ) -> _Drawn:
        """The capture with electrons and DN, if they are requested.

        electrons : None if neither is requested
        place : index of the image among those that are not read back yet
        """
        info = still.info
        if electrons is not None and Product.ELECTRONS in products:
            frames = replace(frames, electrons=ElectronFrame(info=info, electrons=electrons.read()))
        if electrons is None or Product.DN not in products:
            return _Drawn(frames)
        dn = self._camera_pipeline.digital(
            still.camera, info.epoch_tai_ns, info.seed, electrons, info.draw, place
        )
        return _Drawn(frames, dn)

    def _read(self, drawn: _Drawn) -> Capture:
        frames, target = drawn.frames, drawn.dn
        if target is None:
            return frames
        with self._renderer.timer.measure("read"):
            return replace(frames, digital=DigitalFrame(info=frames.info, dn=target.read()))

    def close(self) -> None:
        """Free the GPU resources, and the context if this simulator opened it. May be repeated."""
        if is_closed(self._ctx):
            return
        collect_again(self)
        with current(self._ctx):
            self._camera_pipeline.release()
            self._renderer.release()
        if self._owns_ctx:
            close_context(self._ctx)

    def __exit__(self, *_: object) -> None:
        self.close()
