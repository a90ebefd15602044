"""Spacecraft surfaces: radiance of every shading point of a tile."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import GrowingTarget, textures_of
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.albedo_table import LOBE_UNIT, lobe_texture
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shading_points import (
    BY_MATERIAL,
    GBUFFER,
    POINT_GROUPS,
    PointScreen,
    ShadingPoints,
    draw_by_material,
    gbuffer_units,
    point_shader,
)
from simgl.passes.shared_blocks import (
    JOINTS,
    LAMPS,
    MATERIALS,
    SPACECRAFT,
    TILE,
    lamp_values,
)
from simgl.passes.view_blocks import ViewBlocks
from simgl.view.lamp_views import LampView
from simgl.view.raster_tiles import RasterTile

# The terms of a surface's radiance, in the order of the targets of shaders/surface/surface.frag.
LIGHTS = ("sun", "earth", "inter_reflected", "lamp", "emitted")

# Behind the G-buffer's channels, in the order of the same targets.
_TEXTURED = ("textured_reflectance", "textured_emission", "textured_normal")
# In the order of the sunlight pass's textures.
_SUNLIGHT_UNITS = {"sunlight": 11, "searched_sunlight": 8, "searched_pages": 9}
_SKY_UNITS = {"sky_cube": 12, "sky_lobes": 13, "sky_irradiance": 14}
_LAMP_UNITS = {"lamp_maps": 15, "lamp_bounds": 21}

_LOBES = {"lobe_table": LOBE_UNIT}
# In the order of the glossy pass's textures.
_SEEN_UNITS = {"seen_lobes": 22, "seen_pages": 23}

# What each variant of the shader reads besides.
_MORE_UNITS = {
    "SUNLIT": _SUNLIGHT_UNITS,
    "SKY": _SKY_UNITS | _LOBES,
    "INTERREFLECTION": gbuffer_units("indirect") | _LOBES,
    "LAYERED": POINT_GROUPS | _LOBES,
    "LAMPS": dict(_LAMP_UNITS),
    "GLOSSY": _SEEN_UNITS | _LOBES,
    "DETAILED": {name: unit for unit, name in enumerate(_TEXTURED, len(GBUFFER))},
}


class SurfacePass:
    """Lights the shading points of a spacecraft."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore, blocks: ViewBlocks) -> None:
        self._ctx, self._meshes, self._blocks = ctx, meshes, blocks
        self._lobes = lobe_texture(ctx)
        # By what they are defined by, and by the parts of the times.
        self._lit: dict[tuple[tuple[str, ...], int], PointScreen] = {}
        self._lamps = UniformBuffer(ctx, LAMPS)
        # By the number of radiances, whole or in parts.
        self._targets: dict[int, GrowingTarget] = {}

    def draw(
        self,
        tile: RasterTile,
        points: ShadingPoints,
        drawn: DrawnSpacecraft,
        sunlight: Sequence[moderngl.Texture],
        seen: Sequence[moderngl.Texture],
        lamps: Sequence[LampView] = (),
        lamp_maps: Sequence[moderngl.Texture] = (),
        *,
        by_light: bool = False,
        light_parts: int = 1,
    ) -> tuple[moderngl.Texture, ...]:
        """RGBA32F radiance of the points [W m-2 sr-1], of all spacecraft that were drawn since the
        last tile; undefined where there is no point.

        points : those of this spacecraft have been looked up last
        sunlight : of the sunlight pass
        seen : of the glossy pass
        lamps : which light every spacecraft, and the textures of their shadow maps
        light_parts : of the times over which their light is spread
        returns : one texture for each of these parts, or with ``by_light`` one for each of
            ``LIGHTS``
        """
        target = self._target_of(len(LIGHTS) if by_light else light_parts, points)
        self._write(tile, drawn, lamps)
        for unit, texture in enumerate(points.textures):
            texture.use(unit)
        points.bind()
        for unit, texture in zip(_SUNLIGHT_UNITS.values(), sunlight, strict=True):
            texture.use(unit)
        for unit, texture in zip(_SEEN_UNITS.values(), seen, strict=False):
            texture.use(unit)
        self._bind_light(drawn, lamp_maps)
        lights = {
            "SKY": drawn.probe is not None,
            "INTERREFLECTION": drawn.interreflects,
            "LAMPS": bool(lamps),
            "GLOSSY": bool(seen),
        }
        # Where there is no light at all, there is no need of a shader of its own.
        sunlit = drawn.view.sun_irradiance.any() or not any(lights.values())
        optional = lights | {
            "SUNLIT": bool(sunlit),
            "BY_LIGHT": by_light,
            "AIR_BEFORE": drawn.air is not None,
        }
        variant = [d for d in drawn.view.model.variant if d != "CUT_OUT"]
        variant += [define for define, wanted in optional.items() if wanted]
        variant += drawn.view.lit_variant
        single = tuple(d for d in variant if d not in ("LAYERED", "JOINTED"))
        plain = self._lit_for(single, light_parts)
        layered = self._lit_for(tuple(variant), light_parts) if "LAYERED" in variant else None
        draw_by_material(target, points, plain, layered)
        return textures_of(target)

    def _target_of(self, count: int, points: ShadingPoints) -> moderngl.Framebuffer:
        if count not in self._targets:
            self._targets[count] = GrowingTarget(self._ctx, [range(count)])
        return self._targets[count].covering(points.size, points.depth)[0]

    def _write(self, tile: RasterTile, drawn: DrawnSpacecraft, lamps: Sequence[LampView]) -> None:
        self._blocks.bind_tile(tile)
        self._blocks.bind_spacecraft(drawn)
        if lamps:
            self._lamps.write(lamp_values(lamps))
            self._lamps.bind()
        model = drawn.view.model
        self._meshes.bind_materials(model)
        if "JOINTED" in model.variant:
            self._meshes.bind_joints(model, model.posed_mesh)

    def _bind_light(self, drawn: DrawnSpacecraft, lamp_maps: Sequence[moderngl.Texture]) -> None:
        self._lobes.use(LOBE_UNIT)
        for unit, texture in zip(_LAMP_UNITS.values(), lamp_maps, strict=False):
            texture.use(unit)
        if drawn.probe is not None:
            drawn.probe.cube.use(_SKY_UNITS["sky_cube"])
            drawn.probe.lobes.use(_SKY_UNITS["sky_lobes"])
            drawn.probe.irradiance.use(_SKY_UNITS["sky_irradiance"])

    def _lit_for(self, variant: tuple[str, ...], light_parts: int) -> PointScreen:
        if (variant, light_parts) not in self._lit:
            self._lit[variant, light_parts] = self._lit_screen(variant, light_parts)
        return self._lit[variant, light_parts]

    def _lit_screen(self, variant: tuple[str, ...], light_parts: int) -> PointScreen:
        samplers = gbuffer_units("position", "normal_roughness", "face_normal")
        blocks = [SPACECRAFT, MATERIALS]
        for define, units in _MORE_UNITS.items():
            if define in variant:
                samplers |= units
        if "LAYERED" in variant:
            blocks += [TILE] + [JOINTS] * ("JOINTED" in variant)
        if "LAMPS" in variant:
            blocks.append(LAMPS)
        defines = dict.fromkeys(variant, 1) | {"LIGHT_PARTS": light_parts}
        return point_shader(self._ctx, "surface/surface", BY_MATERIAL, blocks, samplers, defines)

    def release(self) -> None:
        """Free everything."""
        for target in self._targets.values():
            target.release()
        self._lamps.release()
        self._lobes.release()
        for screen in self._lit.values():
            screen.release()
