"""What glossy surfaces see of their own spacecraft and of those near it, by rays on the CPU.

mask: which points have lobes -> a list of them -> what rays need of each, read back -> rays ->
what each lobe sees, as a texture for the surface pass.
"""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.arrays import Array32, IndexArray
from simgl.gpu.context import wait_for_draws
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import Format, GrowingTarget
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shading_points import (
    COLUMNS,
    ENTRIES,
    GBUFFER,
    PAGE_ENTRIES,
    POINT_GROUPS,
    UNLISTED,
    PointScreen,
    ShadingPoints,
    gbuffer_units,
    in_list_order,
    listed_points,
    point_shader,
)
from simgl.passes.shared_blocks import MATERIALS, SPACECRAFT, TILE
from simgl.passes.view_blocks import ViewBlocks
from simgl.radiosity.final_gather import LitBody
from simgl.radiosity.lobe_gather import Lobes, seen_in_lobes
from simgl.view.raster_tiles import RasterTile

_SURFACES_UNIT, _POINTS_UNIT = 12, 22
_DETAILED = ("textured_reflectance", "textured_emission", "textured_normal")
# Three texels of a point in one row, as in shaders/surface/seen_lobes.glsl.
_SEEN_COLUMNS = 1023
# Reflectance of clear coats at normal incidence, as in shaders/surface/material.glsl.
_COAT_F0 = 0.04
# A lobe that is not followed.
_NOT_FOLLOWED = -1.0


class GlossyPass:
    """Follows the lobes of glossy points, where a spacecraft is to be seen in its own surfaces."""

    # Every texel is drawn.
    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, meshes: MeshStore, blocks: ViewBlocks) -> None:
        self._ctx, self._meshes, self._blocks = ctx, meshes, blocks
        self._screens: dict[tuple[str, ...], tuple[PointScreen, PointScreen]] = {}
        self._masks = GrowingTarget(ctx, [[0]], Format("u1"))
        self._points = GrowingTarget(ctx, [[0]], Format("u4"))
        self._pages = GrowingTarget(ctx, [[0]], Format("u4"))
        self._lobes = GrowingTarget(ctx, [range(4)])
        self._seen = GrowingTarget(ctx, [[0]])

    def draw(
        self, tile: RasterTile, points: ShadingPoints, drawn: DrawnSpacecraft
    ) -> tuple[moderngl.Texture, ...]:
        """What the lobes of points see, and where it is (shaders/surface/seen_lobes.glsl).

        points : those of this spacecraft have been looked up last
        returns : two textures, valid until the next draw; none where no lobe sees anything
        """
        if not drawn.mirrored:
            return ()
        self._bind(tile, points, drawn)
        mask, lobes = self._screens_for(_variant(drawn))
        area = (0, 0, ENTRIES, len(points.entries))
        (masks,) = self._masks.covering(area[2:])
        mask.draw(self.state, masks, area)
        wait_for_draws(self._ctx)
        data = masks.read(viewport=area, components=1, alignment=1, dtype="u1")
        pages = np.zeros((len(points.entries), ENTRIES), dtype=np.uint32)
        listed = listed_points(np.frombuffer(data, dtype=np.uint8).reshape(pages.shape), pages)
        if not len(listed):
            return ()
        self._points.written(listed).use(_POINTS_UNIT)
        area = (0, 0, COLUMNS, len(listed))
        (target,) = self._lobes.covering(area[2:])
        lobes.draw(self.state, target, area)
        at = in_list_order(listed)
        at = at[at != UNLISTED].astype(np.int64)
        row, column = points.cells_of(at >> 16, at & 0xFFFF)
        values = [_read(target, area, channel)[: len(at)] for channel in range(4)]
        seen = _seen(values, row, column, drawn.mirrored)
        return self._seen.written(_table(seen)), self._pages.written(pages)

    def _bind(self, tile: RasterTile, points: ShadingPoints, drawn: DrawnSpacecraft) -> None:
        self._blocks.bind_tile(tile)
        self._blocks.bind_spacecraft(drawn)
        self._meshes.bind_materials(drawn.view.model)
        for unit, texture in enumerate(points.textures):
            texture.use(unit)
        _, surfaces = points.visibility
        surfaces.use(_SURFACES_UNIT)
        points.bind()

    def _screens_for(self, variant: tuple[str, ...]) -> tuple[PointScreen, PointScreen]:
        """Of the mask, and of the listed points."""
        if variant not in self._screens:
            defines = dict.fromkeys(variant, 1)
            known = gbuffer_units("position", "normal_roughness")
            detail = {name: unit for unit, name in enumerate(_DETAILED, len(GBUFFER))}
            masked, listed = dict(known), known | gbuffer_units("face_normal")
            if "DETAILED" in variant:
                masked |= {"textured_normal": detail["textured_normal"]}
                listed |= detail
            if "INTERREFLECTION" in variant:
                masked |= gbuffer_units("face_normal", "indirect")
            masked |= POINT_GROUPS | PAGE_ENTRIES | {"seen_surfaces": _SURFACES_UNIT}
            listed |= {"listed_points": _POINTS_UNIT}
            blocks = [SPACECRAFT, MATERIALS]
            self._screens[variant] = (
                point_shader(self._ctx, "glossy/mask", 0.0, [TILE, *blocks], masked, defines),
                point_shader(self._ctx, "glossy/glossy", 0.0, blocks, listed, defines),
            )
        return self._screens[variant]

    def release(self) -> None:
        """Free everything."""
        for target in (self._masks, self._points, self._pages, self._lobes, self._seen):
            target.release()
        for screen in sum(self._screens.values(), ()):
            screen.release()


def _variant(drawn: DrawnSpacecraft) -> tuple[str, ...]:
    variant = drawn.view.lit_variant
    if "DETAILED" in drawn.view.model.variant:
        variant += ("DETAILED",)
    # What is near may be seen where none of its light arrives.
    if drawn.interreflects and len(drawn.mirrored) == 1:
        variant += ("INTERREFLECTION",)
    return variant


def _read(target: moderngl.Framebuffer, area: tuple[int, int, int, int], channel: int) -> Array32:
    """(n, 4) of the points in the order of their list."""
    data = target.read(viewport=area, components=4, attachment=channel, dtype="f4")
    return in_list_order(np.frombuffer(data, dtype=np.float32).reshape(-1, COLUMNS, 4))


def _seen(
    values: list[Array32], row: IndexArray, column: IndexArray, bodies: Sequence[LitBody]
) -> Array32:
    """(n, 3, 4) texels of points.

    values : (n, 4) each, of the targets of shaders/glossy/glossy.frag
    row, column : (n,) of their cells
    """
    place, normal, facet, viewer = values
    seen = np.zeros((len(row), 3, 4), dtype=np.float32)
    seen[:, 2] = _NOT_FOLLOWED
    coat_f0 = np.full(len(row), _COAT_F0, dtype=np.float32)
    for lobe, (alpha, f0) in enumerate(((place[:, 3], facet[:, 3]), (normal[:, 3], coat_f0))):
        chosen = np.flatnonzero(alpha > 0.0)
        if not len(chosen):
            continue
        lobes = Lobes(
            places=place[chosen, :3],
            normals=normal[chosen, :3],
            facets=facet[chosen, :3],
            viewer=viewer[chosen, :3],
            alpha=alpha[chosen],
            f0=f0[chosen],
            label=viewer[chosen, 3].astype(np.int64),
            row=row[chosen],
            column=column[chosen],
        )
        seen[chosen, lobe], seen[chosen, 2, lobe] = seen_in_lobes(lobes, bodies)
    return seen


def _table(seen: Array32) -> Array32:
    """(rows, columns, 4) of (n, 3, 4) texels."""
    texels = seen.reshape(-1, 4)
    rows = -(-len(texels) // _SEEN_COLUMNS)
    table = np.zeros((rows * _SEEN_COLUMNS, 4), dtype=np.float32)
    table[: len(texels)] = texels
    return table.reshape(rows, _SEEN_COLUMNS, 4)
