"""The ordered passes that turn a view into radiance and truth."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

import moderngl

from simgl.arrays import Array32, Mask
from simgl.background_work import background_work
from simgl.camera.camera import Camera
from simgl.environment_map import SkyRadiance
from simgl.gpu.context import begin_draws, is_software
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget, TargetStore
from simgl.gpu.timers import PassTimer
from simgl.passes.background.air import AtmospherePass
from simgl.passes.background.diffuse_sky import DiffuseSkyPass
from simgl.passes.background.environment_probe import EnvironmentProbeStore
from simgl.passes.background.moon import MoonPass
from simgl.passes.background.planet import PlanetPass
from simgl.passes.background.stars import StarPass
from simgl.passes.background.sun import SunPass
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.gbuffer import GBufferPass
from simgl.passes.glossy import GlossyPass
from simgl.passes.interreflection import InterreflectionPass
from simgl.passes.lamp_shadow import LampShadowPass
from simgl.passes.mesh_store import MeshStore, VertexLighting
from simgl.passes.reference_gather import ReferenceGather
from simgl.passes.resolve import DistortedView, ResolvePass, needs_edges
from simgl.passes.shading_points import BLOCK, ShadingPoints
from simgl.passes.shadow import ShadowPass
from simgl.passes.sunlight import SunlightPass
from simgl.passes.surface import LIGHTS, SurfacePass
from simgl.passes.truth import TruthPass
from simgl.passes.view_blocks import ViewBlocks
from simgl.passes.visibility import VisibilityPass
from simgl.passes.warp import WarpPass
from simgl.progress import ProgressCallback, begin_stage
from simgl.radiosity.final_gather import LitBody
from simgl.radiosity.transport_store import JointLight, TransportStore
from simgl.rendering.exposure_renderer import Drawing, ExposureRenderer
from simgl.rendering.image_sizes import ImageSizes
from simgl.rendering.sky_renderer import SkyRenderer
from simgl.rendering.thermal_renderer import ThermalRenderer
from simgl.scene.earth import Earth
from simgl.scene.spacecraft import SpacecraftModel
from simgl.thermal.infrared_surroundings import InfraredSurroundings
from simgl.thermal.thermal_view import ThermalView
from simgl.view.background import SkyView
from simgl.view.background_tiles import tiles_behind
from simgl.view.celestial import CelestialView
from simgl.view.exposure_views import MovingViews
from simgl.view.frame_view import FrameView, lit_parts, truth_tile
from simgl.view.raster_tiles import RasterTile

_BANDS = (Format("f4", 4),)
_TRUTH = (Format("f4"), Format("u4"))
_TRUTH_NORMALS = (*_TRUTH, Format("f4", 4))

# Geometry samples that one tile may take before its sample grid gets coarser. On a CPU renderer a
# shaded sample under all lights costs about 0.3 us, so this is some 40 ms. A data-centre GPU, which
# rasterises with few of its units, takes 3.4 ns (NVIDIA H100), so this is 2 ms.
_SAMPLE_BUDGET_CPU = 125_000
_SAMPLE_BUDGET_GPU = 500_000

# Threads besides the one that draws, at most: what two spacecraft and their sky ask for at once.
_WORKERS = 6

_Drawn = TypeVar("_Drawn")


class Renderer:
    """Owns every pass and target between a view and its image, in one OpenGL context."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self.timer, self.sizes = PassTimer(ctx), ImageSizes(ctx)
        self.sample_budget = _SAMPLE_BUDGET_CPU if is_software(ctx) else _SAMPLE_BUDGET_GPU
        self._transports = TransportStore()
        drawn = self._meshes, self._blocks = MeshStore(ctx), ViewBlocks(ctx)
        # What other threads can do while this one waits for draws, or makes them.
        workers = min(max(len(os.sched_getaffinity(0)), 2), _WORKERS)
        self._executor = ThreadPoolExecutor(workers, thread_name_prefix="simgl-renderer")
        self._interreflection = InterreflectionPass(ctx, self._transports, self._executor)
        self._shadow = ShadowPass(ctx, self._meshes)
        self._lamp_shadow = LampShadowPass(ctx, self._meshes)
        self._visibility = VisibilityPass(ctx, *drawn)
        self._geometry = GBufferPass(ctx, *drawn)
        self._sunlight = SunlightPass(ctx, self._blocks)
        self._glossy = GlossyPass(ctx, *drawn)
        self._surface = SurfacePass(ctx, *drawn)
        self._diffuse_sky = DiffuseSkyPass(ctx)
        self._stars = StarPass(ctx)
        self._sun = SunPass(ctx)
        self._moon = MoonPass(ctx)
        self._air = AtmospherePass(ctx)
        self.planet = PlanetPass(ctx, self._air)
        self._probes = EnvironmentProbeStore(ctx, self._executor)
        self.skies = SkyRenderer(ctx, self.planet)
        self._reference_gather = ReferenceGather(self._transports, self._interreflection.light)
        self._resolve = ResolvePass(ctx, self._blocks)
        self._warp = WarpPass(ctx)
        self._truth = TruthPass(ctx, *drawn)
        self._targets = TargetStore(ctx)
        shared = self._visibility, self._geometry, self._resolve, self._warp, self.planet
        self._thermal = ThermalRenderer(ctx, self.timer, self._blocks, *shared)
        self._exposure = ExposureRenderer(ctx, self.timer, self._resolve)

    def prepare(
        self,
        models: Iterable[SpacecraftModel],
        earth: Earth | None = None,
        joint_light: JointLight = "exact",
        progress: ProgressCallback | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> None:
        """Trace how the surfaces of models see each other, and make the tables of the Earth's air
        and the Earth's maps, so that no frame waits for it.

        meanwhile : called where something has to be traced, once all else is made
        """
        models = tuple(models)
        to_trace = self._transports.to_trace(models, joint_light)

        def light(steps: ProgressCallback) -> None:
            self._transports.prepare(models, joint_light, steps)
            if to_trace:
                self._interreflection.prepare(models, joint_light)

        with background_work(light, progress):
            if earth is not None:
                self.planet.prepare(earth, progress)
                self._probes.prepare()
            if to_trace and meanwhile is not None:
                begin_stage(progress, "compiling shaders of the first image")
                meanwhile()

    def radiance(self, view: FrameView) -> ImageTarget:
        """Radiance per band [W m-2 sr-1], RGBA32F; valid until the next call at this size."""
        return self._with_all_pages(partial(self._radiance, view))

    def _with_all_pages(self, draw: Callable[[], _Drawn]) -> _Drawn:
        """What is drawn; again where a GPU had too little room for the pages of points."""
        drawn = draw()
        while self._geometry.lacked_room():
            drawn = draw()
        return drawn

    def _radiance(self, view: FrameView) -> ImageTarget:
        self._blocks.begin()
        target = self._target(f"radiance {view.ramps}", view.camera, _BANDS)
        if view.gather == "vertex":
            tiles = (tile for seen in view.pinholes for tile in seen.tiles)
            self._interreflection.begin([s for t in tiles for s in t.spacecraft], view.joint_light)
        # Where nothing is read back, there is nothing to wait for.
        hides_much = view.hides_much and self._geometry.reads_back
        if not hides_much:
            self._all_background(view, target)
        self._lay_spacecraft(view, target, with_background=hides_much)
        return target

    def radiance_during(self, views: MovingViews) -> ImageTarget:
        """The mean radiance that each row sees over its exposure, as ``radiance`` gives it."""
        return self._with_all_pages(partial(self._radiance_during, views))

    def _radiance_during(self, views: MovingViews) -> ImageTarget:
        self._blocks.begin()
        target = self._target(f"radiance {views.ramps}", views.camera, _BANDS)
        drawing = Drawing(self._lit_tiles, self._all_background, self._distorted)
        self._exposure.draw(views, target, drawing)
        return target

    def _lay_spacecraft(
        self, view: FrameView, target: ImageTarget, *, with_background: bool = False
    ) -> None:
        """Over what a target holds, or over the background as it is seen past the first tile."""
        for seen in view.pinholes:
            lens = self._distorted(seen)
            for number, (tile, points, (radiance,)) in enumerate(self._lit_tiles(seen, seen.tiles)):
                if with_background and number == 0:
                    assert points.bare is not None
                    edge = BLOCK / tile.sample_grid.cells_per_edge
                    hidden = tiles_behind(points.bare, (tile.x, tile.y), edge, target.size)
                    self._background(seen, target, hidden=hidden)
                with self.timer.measure("resolve"):
                    self._resolve.draw(tile, points, radiance, target.framebuffer, lens, view.ramps)

    def _all_background(self, view: FrameView, target: ImageTarget) -> None:
        """Through every pinhole; black where the lens sees nothing."""
        if view.field is not None:
            target.blacken()
        for seen in view.pinholes:
            self._background(seen, target)

    def layers(self, view: FrameView) -> dict[str, Array32]:
        """The radiance in parts: what each of ``LIGHTS`` gives the spacecraft, and "background".

        returns : (height, width, 4) each [W m-2 sr-1]
        """
        return self._with_all_pages(partial(self._layers, view))

    def _layers(self, view: FrameView) -> dict[str, Array32]:
        size = view.camera.detector.width, view.camera.detector.height
        names = (*LIGHTS, "background")
        targets = {name: ImageTarget(self._ctx, size, _BANDS) for name in names}
        try:
            for one in targets.values():
                one.blacken()
            background = targets["background"]
            for seen in view.pinholes:
                self._background(seen, background)
                lens = self._distorted(seen)
                for tile, points, lights in self._lit_tiles(seen, seen.tiles, by_light=True):
                    for name, radiance in zip(LIGHTS, lights, strict=True):
                        self._resolve.draw(tile, points, radiance, targets[name].framebuffer, lens)
                    self._resolve.draw(
                        tile, points, lights[0], background.framebuffer, lens, how=ResolvePass.hides
                    )
            return {name: target.read() for name, target in targets.items()}
        finally:
            release_all(self._ctx, *targets.values())

    def _background(
        self,
        view: FrameView,
        target: ImageTarget,
        hidden: Mask | None = None,
    ) -> None:
        """What is behind the spacecraft.

        hidden : tiles of all rows where it is not (``tiles_behind``)
        """
        if view.background.planet is not None:
            with self.timer.measure("air"):
                self._air.ahead(view.background.planet, view.camera.name)
                self._air.before(view.background.planet)
        fine = target if view.field is None else self._target("field", view.field.fine, _BANDS)
        area = 0, 0, *fine.size
        # The first skies before the planet: they are read back, and would wait for it. While they
        # are drawn, this thread works out what it draws of the planet.
        first = [one.sky for tile in view.tiles[:1] for one in tile.spacecraft]
        with self.timer.measure("probe"):
            under_way = self._begin_skies(first)
        with self.timer.measure("planet"):
            planned = self.planet.planned(view.background, fine.framebuffer, area, hidden)
        with self.timer.measure("probe"):
            self._add_skies(under_way)
        if view.background.celestial is not None:
            with self.timer.measure("celestial"):
                self._celestial(view.background.celestial, fine)
        with self.timer.measure("planet"):
            self.planet.draw(planned)
            begin_draws(self._ctx)
        if view.field is not None:
            with self.timer.measure("warp"):
                self._warp.mean(view.field, fine.textures[0], target.framebuffer)

    def _begin_skies(
        self, views: Iterable[SkyView | None]
    ) -> list[tuple[SkyView, Callable[[], SkyRadiance]]]:
        """Begin to draw the skies that the probes lack."""
        missing = self._probes.missing(tuple(views))
        return [(view, self.skies.begin(view, place)) for place, view in enumerate(missing)]

    def _add_skies(self, under_way: list[tuple[SkyView, Callable[[], SkyRadiance]]]) -> None:
        """Read back what was begun; other threads integrate it meanwhile."""
        for view, drawn in under_way:
            self._probes.add(view, drawn())

    def infrared_sky(self, view: SkyView, surroundings: InfraredSurroundings) -> Array32:
        """What a spacecraft has around it, as ``ThermalRenderer`` gives it."""
        return self._thermal.draw_sky(view, surroundings)

    def _distorted(self, view: FrameView) -> DistortedView | None:
        f = view.field
        return None if f is None else DistortedView(field=f, places=self._warp.places(f))

    def _celestial(self, view: CelestialView, target: ImageTarget) -> None:
        """What lies beyond the Earth, the farthest first."""
        if view.diffuse is None:
            target.blacken()
        else:
            self._diffuse_sky.draw(view.diffuse, target.framebuffer)
        if view.stars is not None:
            self._stars.draw(view, view.stars, target.framebuffer)
        if view.sun is not None:
            self._sun.draw(view.sun, target.framebuffer)
        if view.moon is not None:
            self._moon.draw(view.moon, target.framebuffer)

    def _lit_tiles(
        self, view: FrameView, tiles: Iterable[RasterTile], *, by_light: bool = False
    ) -> Iterator[tuple[RasterTile, ShadingPoints, tuple[moderngl.Texture, ...]]]:
        """Each of some tiles, or its parts, with its shading points and their radiance, valid until
        the next one."""
        with self.timer.measure("lamp_shadow"):
            lamp_maps = self._lamp_shadow.draw(view.lamps)
        surface = partial(self._surface.draw, by_light=by_light, light_parts=view.light_parts)
        for tile in tiles:
            spacecraft = self._spacecraft(tile, view)
            for part in lit_parts(tile, view):
                with self.timer.measure("visibility"):
                    visibility = self._visibility.draw(part, spacecraft)
                    begin_draws(self._ctx)
                # From here on passes read what is still being drawn, and wait for it.
                with self.timer.measure("shadow"):
                    self._shadow.complete([drawn.view.shadow for drawn in spacecraft])
                with self.timer.measure("geometry"):
                    edges = view.field is None and needs_edges(part, view.ramps)
                    even = None if view.lamps else self._sunlight.even_light(part, spacecraft)
                    lit = self._interreflection.complete
                    points = self._geometry.group(
                        part, visibility, spacecraft, lit, edges=edges, even=even
                    )
                # Other threads had until here for the light that goes into the look-up.
                with self.timer.measure("interreflection"):
                    self._interreflection.complete()
                with self.timer.measure("probe"):
                    self._probes.complete()
                for drawn in spacecraft:
                    with self.timer.measure("geometry"):
                        self._geometry.look_up(part, points, drawn)
                        self._reference_gather.fill(part, points, drawn)
                    with self.timer.measure("glossy"):
                        seen = self._glossy.draw(part, points, drawn)
                    with self.timer.measure("surface"):
                        light = self._sunlight.draw(part, points, drawn), seen
                        radiance = surface(part, points, drawn, *light, view.lamps, lamp_maps)
                yield part, points, radiance

    def _spacecraft(self, tile: RasterTile, frame: FrameView) -> list[DrawnSpacecraft]:
        """All that the passes after this draw of the spacecraft of a tile."""
        views = tile.spacecraft
        # All look at the skies of all: most have one in common.
        near = (one for view in views if view.near is not None for one in view.near.spacecraft)
        looks = [*(view.sky for view in views), *(one.sky for one in near)]
        with self.timer.measure("probe"):
            self._add_skies(self._begin_skies(looks))
            probes = self._probes.of(looks)
        with self.timer.measure("shadow"):
            shadow_maps = self._shadow.cast([view.shadow for view in views])
        # On the CPU, while the renderer draws the shadow maps.
        with self.timer.measure("interreflection"):
            known = zip(looks, probes, strict=True)
            sky_of = {look.key: probe for look, probe in known if look and probe}

            def sky_around(look: SkyView | None) -> SkyRadiance | None:
                return None if look is None else sky_of[look.key].sky_around(look)

            vertex_lightings: Sequence[VertexLighting | None] = [None] * len(views)
            bodies: Sequence[tuple[LitBody, ...]] = [()] * len(views)
            by_rays = frame.gather == "pixel"
            if frame.gather == "dark":
                vertex_lightings = self._interreflection.dark(views, frame.joint_light)
            elif not by_rays:
                vertex_lightings = self._interreflection.draw(views, sky_around, frame.joint_light)
            if by_rays or frame.glossy_reflections:
                skies = [sky_around(view.sky) for view in views]
                bodies = self._reference_gather.lit_bodies(views, skies, frame.joint_light)
        return [
            DrawnSpacecraft(
                view=view,
                shadow_maps=maps,
                probe=probe,
                vertex_lighting=lighting,
                lit_bodies=near if by_rays else (),
                mirrored=near if frame.glossy_reflections else (),
                air=self._air.between(view.air),
            )
            for view, maps, probe, lighting, near in zip(
                views, shadow_maps, probes[: len(views)], vertex_lightings, bodies, strict=True
            )
        ]

    def thermal(self, view: FrameView, scene: ThermalView) -> ImageTarget:
        """What a thermal camera sees, as ``ThermalRenderer`` gives it."""
        return self._with_all_pages(partial(self._thermal.draw, view, scene))

    def truth(self, view: FrameView, *, normals: bool = False) -> ImageTarget:
        """Depth [m], part ids and, if wanted, normals at pixel centres, R32F, R32UI, RGBA32F."""
        formats = _TRUTH_NORMALS if normals or view.field is not None else _TRUTH
        use = "truth_normals" if len(formats) > len(_TRUTH) else "truth"
        if view.field is None:
            target = self._target(use, view.camera, formats, depth=True)
            with self.timer.measure("truth"):
                self._truth.draw(truth_tile(view), target.framebuffer)
            return target
        image = self._target("truth_seen", view.camera, formats)
        image.blacken()
        for seen in view.pinholes:
            assert seen.field is not None
            target = self._target(use, seen.field.centred, formats, depth=True)
            with self.timer.measure("truth"):
                self._truth.draw(truth_tile(seen), target.framebuffer)
            with self.timer.measure("warp"):
                self._warp.nearest(seen.field, target.textures, image.framebuffer)
        return image

    def _target(
        self, use: str, camera: Camera, formats: tuple[Format, ...], *, depth: bool = False
    ) -> ImageTarget:
        size = camera.detector.width, camera.detector.height
        return self._targets.of(use, size, formats, depth=depth)

    def release(self) -> None:
        """Free everything that this renderer made."""
        self._executor.shutdown()
        release_all(
            self._ctx,
            self._targets,
            self._shadow,
            self._lamp_shadow,
            self._visibility,
            self._geometry,
            self._sunlight,
            self._glossy,
            self._surface,
            self._diffuse_sky,
            self._stars,
            self._sun,
            self._moon,
            self.planet,
            self._thermal,
            self._air,
            self._probes,
            self.skies,
            self._interreflection,
            self._resolve,
            self._warp,
            self._exposure,
            self._truth,
            self._meshes,
            self._blocks,
        )

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
