"""The shading points of a tile: what the samples of each cell see of each smooth surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl

from simgl.gpu.fullscreen import Screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import Format, GrowingTarget, textures_of
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shared_blocks import (
    JOINTS,
    MATERIALS,
    SPACECRAFT,
    TILE,
    spacecraft_values,
    tile_values,
)
from simgl.passes.texture_store import IMAGE_UNITS
from simgl.view.raster_tiles import RasterTile

# Groups of a cell that have a shading point each (shaders/gbuffer/cells.glsl).
LAYERS = 4
# The place of a shading point that is not there.
EMPTY = -1.0
# The targets of shaders/gbuffer/gbuffer.frag; those with images and vertex colours have more.
_PLAIN, _DETAILED = 4, 7

_VISIBILITY_UNIT, _GROUPS_UNIT, _CORNERS_UNIT, _VERTICES_UNIT, _LIGHT_UNIT = range(5)
_POINTS = {"visibility": _VISIBILITY_UNIT, "cell_groups": _GROUPS_UNIT}


# Deeper than what later passes draw, nearer than marked points.
_LOOKED_UP = 0.875


@dataclass(frozen=True, kw_only=True, eq=False)
class GBuffer:
    """Shading points of a tile, one layer of cells above the other; valid until the next tile.

    size : columns and rows of all layers
    visibility : of the visibility pass
    groups : RGBA32UI, of each cell the samples of each of its groups
    textures : in the order of the shader's targets, RGBA32F
    framebuffer : of the textures
    depth : of the same size: what later passes are to draw of a spacecraft
    """

    size: tuple[int, int]
    visibility: moderngl.Texture
    groups: moderngl.Texture
    textures: tuple[moderngl.Texture, ...]
    framebuffer: moderngl.Framebuffer
    depth: moderngl.Renderbuffer


class GBufferPass:
    """Groups the samples of each cell, and looks up what the groups see of a spacecraft.

    The depth buffer then says which points are that spacecraft's: 0 for all others.
    """

    state = State(depth=True)
    colour_only = State()
    depth_only = State(depth=True, write_color=False)

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._grouping: dict[int, Screen] = {}
        self._mark = Screen(ctx, "gbuffer/mark", 0.0, [TILE, SPACECRAFT], _POINTS)
        self._lookups: dict[tuple[str, ...], Screen] = {}
        self._tile = UniformBuffer(ctx, TILE)
        self._spacecraft = UniformBuffer(ctx, SPACECRAFT)
        self._groups = GrowingTarget(ctx, [[0]], Format("u4", 4))
        self._targets = {n: GrowingTarget(ctx, [range(n)]) for n in (_PLAIN, _DETAILED)}

    def group(
        self, tile: RasterTile, visibility: moderngl.Texture, spacecraft: Sequence[DrawnSpacecraft]
    ) -> GBuffer:
        """Group the samples that see the same. No point is looked up yet.

        visibility : of the visibility pass
        spacecraft : of the tile
        """
        columns, rows = tile.cells.size
        size = columns, LAYERS * rows
        detailed = any("DETAILED" in drawn.view.model.variant for drawn in spacecraft)
        (groups,) = self._groups.covering((columns, rows))
        (target,) = self._targets[_DETAILED if detailed else _PLAIN].covering(size)
        self._tile.write(tile_values(tile, tile.slices[0]))
        self._tile.bind()
        visibility.use(_VISIBILITY_UNIT)
        self.colour_only.apply(self._ctx, groups, (0, 0, columns, rows), (0, 0, columns, rows))
        self._grouping_for(tile.cells.texels).draw()
        self.colour_only.apply(self._ctx, target, (0, 0, *size), (0, 0, *size))
        others = ((False,) * 4,) * (len(target.color_attachments) - 1)
        target.color_mask = ((True,) * 4, *others)  # type: ignore[assignment]
        target.clear(EMPTY, EMPTY, EMPTY, EMPTY, viewport=(0, 0, *size))
        depth = target.depth_attachment
        assert isinstance(depth, moderngl.Renderbuffer)
        return GBuffer(
            size=size,
            visibility=visibility,
            groups=textures_of(groups)[0],
            textures=textures_of(target),
            framebuffer=target,
            depth=depth,
        )

    def look_up(self, tile: RasterTile, points: GBuffer, drawn: DrawnSpacecraft) -> None:
        """Fill the points that see one spacecraft."""
        area = (0, 0, *points.size)
        self.depth_only.apply(self._ctx, points.framebuffer, area, area)
        points.framebuffer.clear(depth=1.0, viewport=area)
        self._tile.write(tile_values(tile, tile.slices[0]))
        self._spacecraft.write(spacecraft_values(drawn.view))
        self._tile.bind()
        self._spacecraft.bind()
        points.visibility.use(_VISIBILITY_UNIT)
        points.groups.use(_GROUPS_UNIT)
        self._mark.draw()
        self.state.apply(self._ctx, points.framebuffer, area, area)
        model, lighting = drawn.view.model, drawn.vertex_lighting
        variant = tuple(d for d in model.variant if d == "DETAILED")
        if variant:
            self._meshes.bind_surface(model)
        if drawn.mesh.motion is not None:
            self._meshes.bind_joints(model, drawn.mesh)
            variant = (*variant, "JOINTED")
        if lighting is not None:
            lighting.light.use(_LIGHT_UNIT)
            variant += lighting.defines
        tables = self._meshes.tables(drawn.mesh)
        tables.corners.use(_CORNERS_UNIT)
        tables.vertices.use(_VERTICES_UNIT)
        self._look_up_for(variant).draw()

    def _grouping_for(self, texels: int) -> Screen:
        if texels not in self._grouping:
            self._grouping[texels] = Screen(
                self._ctx,
                "gbuffer/groups",
                0.0,
                [TILE],
                {"visibility": _VISIBILITY_UNIT},
                {"CELL_TEXELS": texels},
            )
        return self._grouping[texels]

    def _look_up_for(self, variant: tuple[str, ...]) -> Screen:
        """The shader for models of a variant; those without images do not pay for them."""
        if variant not in self._lookups:
            detailed, lit = "DETAILED" in variant, "INTERREFLECTION" in variant
            samplers = _POINTS | {
                "triangle_corners": _CORNERS_UNIT,
                "mesh_vertices": _VERTICES_UNIT,
            }
            self._lookups[variant] = Screen(
                self._ctx,
                "gbuffer/gbuffer",
                _LOOKED_UP,
                [TILE, SPACECRAFT] + [MATERIALS] * detailed + [JOINTS] * ("JOINTED" in variant),
                samplers | (IMAGE_UNITS if detailed else {}) | ({"vertex_light": _LIGHT_UNIT} if lit else {}),
                dict.fromkeys(variant, 1),
                spare=[MATERIALS, JOINTS],
            )
        return self._lookups[variant]

    def release(self) -> None:
        """Free everything."""
        targets = (self._groups, *self._targets.values())
        screens = (self._mark, *self._grouping.values(), *self._lookups.values())
        for resource in (*targets, self._tile, self._spacecraft, *screens):
            resource.release()
