"""From a scenario to exposures: the object that most programs hold."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import moderngl
import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.point_spread import SunBefore
from simgl.camera.rolling_shutter import duration, instants, parts, row_shares
from simgl.camera_pipeline import CameraPipeline
from simgl.errors import ConfigError, did_you_mean
from simgl.flash_lidar import lidar_frame
from simgl.gpu.context import current, open_context, preserve_current
from simgl.gpu.render_targets import ImageTarget
from simgl.gpu.timers import PassTimer
from simgl.images import (
    DigitalFrame,
    ElectronFrame,
    FrameInfo,
    IrradianceFrame,
    LayersFrame,
    LidarFrame,
    NormalsFrame,
    RadianceFrame,
    TruthFrame,
)
from simgl.progress import ProgressCallback
from simgl.renderer import Renderer
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.view.frame_view import FrameView, frame_view
from simgl.view.image_motion import image_motion
from simgl.view.lidar_pulse import pulse_view


class Product(StrEnum):
    """What a capture can bring to the CPU."""

    DN = "dn"
    ELECTRONS = "electrons"
    RADIANCE = "radiance"
    LAYERS = "layers"
    IRRADIANCE = "irradiance"
    TRUTH = "truth"
    NORMALS = "normals"
    LIDAR = "lidar"


ALL_PRODUCTS = frozenset(Product)
# Made from the radiance of the scene as it stands at the epoch.
_FROM_RADIANCE = frozenset({Product.RADIANCE, Product.IRRADIANCE, Product.LIDAR})
# Of the scene alone, whatever a camera makes of its light.
_OF_THE_SCENE = frozenset({Product.RADIANCE, Product.LAYERS, Product.TRUTH, Product.NORMALS})


@dataclass(frozen=True, kw_only=True, eq=False)
class Capture:
    """One picture in the forms that were asked for; the others are None.

    lidar : None also where the camera has no LIDAR
    """

    info: FrameInfo
    digital: DigitalFrame | None = None
    electrons: ElectronFrame | None = None
    radiance: RadianceFrame | None = None
    layers: LayersFrame | None = None
    irradiance: IrradianceFrame | None = None
    truth: TruthFrame | None = None
    normals: NormalsFrame | None = None
    lidar: LidarFrame | None = None

    def _repr_png_(self) -> bytes:
        frames = (self.digital, self.radiance, self.electrons, self.truth, self.layers)
        others = (self.irradiance, self.normals, self.lidar)
        for frame in (*frames, *others):
            if frame is not None:
                return frame._repr_png_()
        return b""


def _sun(state: SceneState, info: FrameInfo) -> SunBefore:
    """The Sun before a camera, as far as the Earth and the Moon let it shine on the lens."""
    return SunBefore(
        direction=info.R_camera_from_icrf @ info.sun_direction_icrf,
        irradiance=info.sun_irradiance * state.sunlight(info.position),
        angular_radius=state.sun.seen_from(info.position).angular_radius,
    )


def _geometry(camera: Camera) -> tuple[object, ...]:
    """What says where a camera's pixels look."""
    d, lens = camera.detector, camera.lens
    return camera.name, d.width, d.height, d.pixel_pitch, lens.focal_length, lens.distortion


class Simulator:
    """Takes pictures of a scenario. A picture depends on the state given to it and on nothing else.

    >>> with Simulator(load_scenario("approach.toml")) as simulator:
    ...     exposure = simulator.capture(simulator.scenario.at(epoch), "navcam")

    progress : told the steps done and their number while light between surfaces is traced, and
        the air's tables are made, some seconds for a new model or air
    """

    def __init__(
        self,
        scenario: Scenario,
        ctx: moderngl.Context | None = None,
        progress: ProgressCallback | None = None,
    ) -> None:
        self.scenario = scenario
        self._own_ctx = ctx is None
        with preserve_current():
            self._ctx = open_context() if ctx is None else ctx
        with current(self._ctx):
            self._renderer = Renderer(self._ctx)
            self._camera_pipeline = CameraPipeline(self._ctx, self._renderer.timer)
            models = scenario.models_at_epoch() if scenario.inter_reflection else ()
            self._renderer.prepare(models, scenario.earth, progress)
        self.renderer_name = f"{self._ctx.info['GL_RENDERER']}, {self._ctx.info['GL_VERSION']}"

    @property
    def timer(self) -> PassTimer:
        """Times of the passes, once enabled."""
        return self._renderer.timer

    @property
    def gl_error(self) -> str:
        """OpenGL's error since it was last asked; "GL_NO_ERROR" while all is well."""
        with current(self._ctx):
            return str(self._ctx.error)

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: Collection[Product] = frozenset({Product.DN}),
        during: Callable[[int], SceneState] | None = None,
        seed: int | None = None,
    ) -> Capture:
        """The picture that a camera of the scene takes.

        during : the scene at other epochs [TAI ns] while the shutter is open, such as the
            scenario's ``at``; electrons and DN then show motion blur and the rolling of the
            shutter. Without it the scene stands still, as it does for radiance and truth.
        seed : of the noise, in place of the scenario's

        Raises ConfigError for an unknown camera or one that is inside a body.
        """
        if camera not in state.cameras:
            problem = f"is not in the scenario; {did_you_mean(camera, state.cameras)}"
            raise ConfigError(self.scenario.name, f'camera "{camera}"', problem)
        view = self._view(state, camera)
        info = self._info(state, camera, seed)
        states = [] if during is None else self._states(state, camera, during)
        # Another simulator of this process may have made its own context current.
        with current(self._ctx):
            counts = Product.DN in products or Product.ELECTRONS in products
            still: ImageTarget | None = None
            if _FROM_RADIANCE & frozenset(products) or (counts and not states):
                still = self._renderer.radiance(view)
            frames = self._still(state, view, info, products, still)
            if counts:
                electrons = self._electrons(state, view, states, still)
                if Product.ELECTRONS in products:
                    frames["electrons"] = ElectronFrame(info=info, electrons=electrons.read())
                if Product.DN in products:
                    frames["digital"] = self._digital(state, view, info, electrons)
        return Capture(info=info, **frames)  # type: ignore[arg-type]

    def bracket(
        self,
        state: SceneState,
        camera: str,
        settings: Sequence[Camera],
        products: Collection[Product] = frozenset({Product.DN}),
    ) -> tuple[Capture, ...]:
        """Pictures of one instant with other settings of a camera, its scene rendered only once.

        settings : the camera with other exposure times, f-numbers, filters or electronics; its
            picture's size and field must stay. Frames of radiance and truth name the camera itself
        Raises ConfigError as ``capture`` does, ValueError for a camera of another field.
        """
        if camera not in state.cameras:
            problem = f"is not in the scenario; {did_you_mean(camera, state.cameras)}"
            raise ConfigError(self.scenario.name, f'camera "{camera}"', problem)
        placed = state.cameras[camera]
        if any(_geometry(setting) != _geometry(placed.camera) for setting in settings):
            raise ValueError("a setting changes the size or the field of the picture")
        view, info = self._view(state, camera), self._info(state, camera)
        taken = []
        with current(self._ctx):
            still = self._renderer.radiance(view)
            shared = self._still(state, view, info, set(products) & _OF_THE_SCENE, still)
            for setting in settings:
                cameras = {**state.cameras, camera: replace(placed, camera=setting)}
                there, seen = replace(state, cameras=cameras), replace(view, camera=setting)
                own = replace(info, camera=setting)
                frames = dict(shared)
                electrons = self._electrons(there, seen, (), still)
                if Product.ELECTRONS in products:
                    frames["electrons"] = ElectronFrame(info=own, electrons=electrons.read())
                if Product.DN in products:
                    frames["digital"] = self._digital(there, seen, own, electrons)
                taken.append(Capture(info=own, **frames))  # type: ignore[arg-type]
        return tuple(taken)

    def _view(self, state: SceneState, camera: str) -> FrameView:
        try:
            return frame_view(
                state,
                camera,
                sample_budget=self._renderer.sample_budget,
                samples_per_pixel=self.scenario.samples_per_pixel,
                inter_reflection=self.scenario.inter_reflection,
                gather=self.scenario.gather,
            )
        except ConfigError as error:
            where = f"{self.scenario.source or self.scenario.name} {error.where}"
            raise ConfigError(where, error.key, error.problem) from None

    def _states(
        self, state: SceneState, name: str, during: Callable[[int], SceneState]
    ) -> list[SceneState]:
        """What the shutter sees one after the other; empty where nothing moves enough to show."""
        camera = state.cameras[name].camera

        def at(offset: float) -> SceneState:
            moved = during(state.tai_ns + round(offset * 1e9))
            # The exposure time may have been chosen for this picture alone.
            there = replace(moved.cameras[name], camera=camera)
            return replace(moved, cameras={**moved.cameras, name: there})

        half = 0.5 * duration(camera)
        # Either side of the middle, since what turns back shows no motion from end to end.
        motion = sum(image_motion(state, at(offset), name) for offset in (-half, half))
        count = parts(motion)
        return [at(offset) for offset in instants(camera, count).tolist()] if count > 1 else []

    def _still(
        self,
        state: SceneState,
        view: FrameView,
        info: FrameInfo,
        products: Collection[Product],
        radiance: ImageTarget | None,
    ) -> dict[str, object]:
        """Frames of the scene as it stands at the epoch."""
        frames: dict[str, object] = {}
        if Product.RADIANCE in products:
            assert radiance is not None
            frames["radiance"] = RadianceFrame(info=info, radiance=radiance.read())
        if Product.LAYERS in products:
            frames["layers"] = LayersFrame(info=info, layers=self._renderer.layers(view))
        if Product.TRUTH in products:
            frames["truth"] = self._truth(state, view, info)
        if Product.NORMALS in products:
            normals = self._renderer.truth(view, normals=True).read(2)[..., :3]
            frames["normals"] = NormalsFrame(info=info, normals=normals)
        if Product.IRRADIANCE in products:
            assert radiance is not None
            target = self._camera_pipeline.irradiance(view.camera, radiance, _sun(state, info))
            frames["irradiance"] = IrradianceFrame(
                info=info,
                irradiance=target.read(),
                photons_per_joule=state.sun.photons_per_joule,
            )
        if Product.LIDAR in products and view.camera.lidar is not None:
            assert radiance is not None
            frames["lidar"] = self._lidar(state, view, info, radiance)
        return frames

    def _electrons(
        self,
        state: SceneState,
        view: FrameView,
        states: Sequence[SceneState],
        still: ImageTarget | None,
    ) -> ImageTarget:
        """Of the still scene, or of the states that the shutter sees one after the other."""
        camera = view.camera
        if not states:
            assert still is not None
            sun = _sun(state, self._info(state, camera.name))
            return self._camera_pipeline.electrons_through(
                camera, state.sun.photons_per_joule, still, sun
            )
        shares = row_shares(camera, len(states))
        for index, (moved, share) in enumerate(zip(states, shares, strict=True)):
            radiance = self._renderer.radiance(self._view(moved, camera.name))
            sun = _sun(moved, self._info(moved, camera.name))
            electrons = self._camera_pipeline.add_electrons(
                camera,
                moved.sun.photons_per_joule,
                self._camera_pipeline.irradiance(camera, radiance, sun),
                share,
                first=index == 0,
            )
        return electrons

    def _digital(
        self, state: SceneState, view: FrameView, info: FrameInfo, electrons: ImageTarget
    ) -> DigitalFrame:
        target = self._camera_pipeline.digital(view.camera, state.tai_ns, info.seed, electrons)
        with self._renderer.timer.measure("read"):
            return DigitalFrame(info=info, dn=target.read())

    def _lidar(
        self, state: SceneState, view: FrameView, info: FrameInfo, radiance: ImageTarget
    ) -> LidarFrame:
        lidar = view.camera.lidar
        assert lidar is not None
        pulse = pulse_view(view, lidar, state, state.cameras[view.camera.name])
        sunlit = radiance.read()
        lit = np.zeros_like(sunlit) if pulse is None else self._renderer.layers(pulse)["lamp"]
        depth = self._renderer.truth(view).read(0)
        return lidar_frame(info, info.seed, depth, lit, sunlit)

    def _truth(self, state: SceneState, view: FrameView, info: FrameInfo) -> TruthFrame:
        target = self._renderer.truth(view)
        names = {
            (instance + 1) * 65536 + part + 1: f"{name}/{part_name}"
            for instance, (name, body) in enumerate(state.bodies.items())
            for part, part_name in enumerate(body.model.parts)
        }
        return TruthFrame(info=info, depth=target.read(0), part_id=target.read(1), part_names=names)

    def _info(self, state: SceneState, name: str, seed: int | None = None) -> FrameInfo:
        camera = state.cameras[name]
        sun = state.sun.seen_from(camera.position)
        return FrameInfo(
            scenario=self.scenario.name,
            camera=camera.camera,
            epoch_tai_ns=state.tai_ns,
            position=camera.position,
            R_camera_from_icrf=camera.R_camera_from_icrf,
            sun_direction_icrf=sun.direction_icrf,
            sun_irradiance=sun.irradiance,
            seed=self.scenario.seed if seed is None else seed,
            renderer=self.renderer_name,
        )

    def close(self) -> None:
        """Free what draws, and the context if this simulator opened it."""
        with current(self._ctx):
            self._camera_pipeline.release()
            self._renderer.release()
        if self._own_ctx:
            self._ctx.release()

    def __enter__(self) -> Simulator:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
