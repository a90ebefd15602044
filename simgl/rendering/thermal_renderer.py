"""The ordered passes from a view to thermal radiance: those of visible light without the light."""

from __future__ import annotations

import moderngl

from simgl.arrays import Array32
from simgl.camera.camera import Camera
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget, TargetStore
from simgl.gpu.timers import PassTimer
from simgl.passes.background.infrared_earth import InfraredEarthPass
from simgl.passes.background.planet import PlanetPass
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.gbuffer import GBufferPass
from simgl.passes.mesh_store import VertexLighting
from simgl.passes.resolve import DistortedView, ResolvePass
from simgl.passes.thermal import ThermalPass
from simgl.passes.view_blocks import ViewBlocks
from simgl.passes.visibility import VisibilityPass
from simgl.passes.warp import WarpPass
from simgl.thermal.infrared_surroundings import InfraredSurroundings
from simgl.thermal.sky_light import SKY_CELLS
from simgl.thermal.thermal_view import ThermalView
from simgl.view.background import SkyView
from simgl.view.frame_view import FrameView, lit_parts

_BANDS = (Format("f4", 4),)


class ThermalRenderer:
    """Owns the passes and targets of thermal images.

    The other passes are those of visible light, lent by their owner.
    """

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        timer: PassTimer,
        blocks: ViewBlocks,
        visibility: VisibilityPass,
        geometry: GBufferPass,
        resolve: ResolvePass,
        warp: WarpPass,
        planet: PlanetPass,
    ) -> None:
        self._ctx, self._timer = ctx, timer
        self._visibility, self._geometry, self._resolve = visibility, geometry, resolve
        self._warp, self._planet = warp, planet
        self._infrared_earth = InfraredEarthPass(ctx)
        self._thermal = ThermalPass(ctx, blocks)
        self._targets = TargetStore(ctx)

    def draw(self, view: FrameView, scene: ThermalView) -> ImageTarget:
        """What a thermal camera sees, RGBA32F; valid until the next call at this size.

        Band radiance [W m-2 sr-1], the same as the detector counts, the surfaces' temperature times
        the share of the pixel that they cover [K], and that share.
        """
        target = self._target("thermal", view.camera)
        target.blacken()
        planck = self._thermal.begin(scene.surroundings.planck)
        lightings = {name: self._thermal.lighting(light) for name, light in scene.lights.items()}
        for seen in view.pinholes:
            self._background(seen, scene.surroundings, planck, target)
            self._lay_spacecraft(seen, lightings, planck, target)
        return target

    def draw_sky(self, view: SkyView, surroundings: InfraredSurroundings) -> Array32:
        """(6, n, n, 2) radiance of what a spacecraft has around it, in W m-2 sr-1 and as counted,
        on the faces of its sky, n cells along an edge of each."""
        n = SKY_CELLS
        target = self._targets.of("sky", (n, 6 * n), _BANDS)
        planck = self._thermal.begin(surroundings.planck)
        with self._timer.measure("infrared sky"):
            for row, face in enumerate(view.with_edge(n)):
                planet = face.planet
                weather = self._planet.weather(planet.earth) if planet is not None else None
                area = 0, row * n, n, n
                self._infrared_earth.draw(
                    face, surroundings, planck, weather, target.framebuffer, area
                )
            return target.read().reshape(6, n, n, 4)[..., :2]

    def _background(
        self,
        view: FrameView,
        surroundings: InfraredSurroundings,
        planck: moderngl.Texture,
        target: ImageTarget,
    ) -> None:
        planet, field = view.background.planet, view.field
        with self._timer.measure("planet"):
            weather = self._planet.weather(planet.earth) if planet is not None else None
            fine = target if field is None else self._target("field", field.fine)
            area = (0, 0, *fine.size)
            self._infrared_earth.draw(
                view.background, surroundings, planck, weather, fine.framebuffer, area
            )
        if field is not None:
            with self._timer.measure("warp"):
                self._warp.mean(field, fine.textures[0], target.framebuffer)

    def _lay_spacecraft(
        self,
        view: FrameView,
        lightings: dict[str, VertexLighting],
        planck: moderngl.Texture,
        target: ImageTarget,
    ) -> None:
        lens = None
        if view.field is not None:
            lens = DistortedView(field=view.field, places=self._warp.places(view.field))
        for tile in view.tiles:
            spacecraft = [
                DrawnSpacecraft(view=one, shadow_maps=(), vertex_lighting=lightings[one.name])
                for one in tile.spacecraft
            ]
            for part in lit_parts(tile, view):
                with self._timer.measure("visibility"):
                    visibility = self._visibility.draw(part, spacecraft)
                with self._timer.measure("geometry"):
                    points = self._geometry.group(part, visibility, spacecraft)
                for drawn in spacecraft:
                    with self._timer.measure("geometry"):
                        self._geometry.look_up(part, points, drawn)
                    with self._timer.measure("thermal"):
                        light = self._thermal.draw(points, drawn, planck)
                with self._timer.measure("resolve"):
                    self._resolve.draw(part, points, light, target.framebuffer, lens)

    def _target(self, use: str, camera: Camera) -> ImageTarget:
        return self._targets.of(use, (camera.detector.width, camera.detector.height), _BANDS)

    def release(self) -> None:
        """Free what is its own."""
        release_all(self._ctx, self._targets, self._infrared_earth, self._thermal)
