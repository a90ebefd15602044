"""The uniform blocks that several passes share, and how a view fills them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.row_curve import TERMS
from simgl.errors import AssetError
from simgl.gpu.uniform_blocks import Block
from simgl.sample_grid import SampleGrid
from simgl.scene.materials import MAX_MATERIALS, Material
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.textures import Image, SurfaceTextures
from simgl.view.lamp_views import MAP_SIZE, LampView
from simgl.view.raster_tiles import RasterTile
from simgl.view.row_clock import PoseMotion
from simgl.view.shadow_views import CELL, REACHES
from simgl.view.spacecraft_view import SpacecraftView

MAX_LAMPS = 4
# Columns of the bounds on a lamp's map.
LAMP_BOUNDS = len(REACHES) * MAP_SIZE // CELL
MAX_JOINTS = 255


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBetween:
    """The air before a spacecraft, the same for all of it.

    light : (4,) scattered towards the camera [W m-2 sr-1]
    transmittance : (4,)
    """

    light: Array
    transmittance: Array


TILE = Block(
    "Tile",
    0,
    np.dtype(
        [
            ("clip_from_camera", "f4", (4, 4)),
            # Planes through the pinhole and the tile's edges: inside, their products with a place
            # in camera axes are positive.
            ("tile_edges", "f4", (4, 4)),
            # Steps of the line of sight from one sample to the next along rows and along columns,
            # and the line of sight through the raster's corner, camera axes at depth 1.
            ("sample_steps", "f4", (2, 4)),
            ("sight_origin", "f4", 4),
            # Columns of the 2 x 2 matrices from raster directions to those of the cells and back.
            ("cell_from_raster", "f4", 4),
            ("raster_from_cell", "f4", 4),
            # The corner of the first cell in the raster.
            ("raster_origin", "f4", 2),
            # Columns and rows of cells.
            ("cells", "i4", 2),
            # From a cell's middle to its samples along an axis of the raster [texels].
            ("cell_reach", "f4"),
            # Of surfaces at a depth of 1 m whose samples may share a cell's shading [rad m-1].
            ("largest_curvature", "f4"),
            ("tile_padding", "f4", 2),
        ]
    ),
)

SPACECRAFT = Block(
    "Spacecraft",
    1,
    np.dtype(
        [
            ("camera_from_body", "f4", (4, 4)),
            # Where it moves: what a time, its square and its cube add to that
            # (shaders/common/moving.glsl).
            ("pose_rate", "f4", (4, 4)),
            ("pose_change", "f4", (4, 4)),
            ("pose_third", "f4", (4, 4)),
            # Rotation vector by which a time turns the directions of the light, camera axes [rad].
            ("light_turn", "f4", 4),
            # Where its light spreads over times (shaders/common/light_spread.glsl): rotation
            # vectors by which half the exposure turns it against the camera and the stars, and its
            # shift, camera axes [rad, m]; beside them the focal length [px], the angle of the
            # larger turn from start to end [rad], and cells along the edge of a pixel.
            ("spread_turn", "f4", 4),
            ("spread_sun", "f4", 4),
            ("spread_shift", "f4", 4),
            # Turns directions to the axes of the environment probe.
            ("sky_from_camera", "f4", (4, 4)),
            ("sun_direction", "f4", 4),
            ("sun_irradiance", "f4", 4),
            # Darkening of the Sun's disc towards its limb, u and v per band (physics/sun.py).
            ("sun_limb_u", "f4", 4),
            ("sun_limb_v", "f4", 4),
            # Of the air before it: light scattered towards the camera, and transmittance.
            ("air_light", "f4", 4),
            ("air_transmittance", "f4", 4),
            ("sun_angular_radius", "f4"),
            ("instance", "u4"),
            # Slope and offset of a row's time over y / z of its lines of sight.
            ("row_clock", "f4", 2),
            # The time where the rows are bent (simgl/camera/row_curve.py), four terms each.
            ("row_curve", "f4", (TERMS // 4, 4)),
        ]
    ),
)

SHADOW = Block(
    "Shadow",
    9,
    np.dtype(
        [
            # Rows: x, y across the sunlight, height towards the Sun.
            ("light_from_camera", "f4", (4, 4)),
            # Whole and close map. Rows: column, row [texels], height [m].
            ("shadow_from_body", "f4", (2, 4, 4)),
            # Edge of a texel, height of depth 0, height from there to depth 1 [m]; inset [texels].
            ("shadow_frame", "f4", (2, 4)),
            # Texels along an edge, first column among the depths, and among the bounds; texels that
            # the Sun's radius spans for each metre of height.
            ("shadow_atlas", "f4", (2, 4)),
            # Directions within the Sun's disc that a cell of samples tries.
            ("shadow_taps", "f4"),
            ("shadow_padding", "f4"),
            # How far the Sun's light moves across the maps for each metre of height [m].
            ("shadow_lean", "f4", 2),
        ]
    ),
)

JOINTS = Block(
    "Joints",
    11,
    # Three rows a rigid group, from where a place is stored to where the joints put it, body axes;
    # the first three for what no joint carries.
    np.dtype([("joint_rows", "f4", (3 * (1 + MAX_JOINTS), 4))]),
)

JOINT_RATES = Block(
    "JointRates",
    13,
    # The same rows: what a time adds to a place where the joints have put it.
    np.dtype([("joint_rate_rows", "f4", (3 * (1 + MAX_JOINTS), 4))]),
)

# Of a lamp, as in shaders/surface/lamp.glsl.
_LAMP_ROWS = 10

LAMPS = Block(
    "Lamps",
    12,
    np.dtype(
        [
            # Ten rows a lamp: place and radius of the aperture [m]; axis and half angle of the cone
            # [rad]; intensity [W sr-1]; column and row of its map (simgl.view.lamp_views); edge,
            # first columns of the map and of its bounds, hard_near, negative where all casters are
            # closed; what a time and its square (shaders/common/moving.glsl) add to the place [m],
            # and to the axis.
            ("lamp_rows", "f4", (_LAMP_ROWS * MAX_LAMPS, 4)),
            ("lamp_count", "i4"),
            ("lamp_map_size", "i4"),
            ("lamp_padding", "i4", 2),
        ]
    ),
)

MATERIALS = Block(
    "Materials",
    2,
    np.dtype(
        [
            ("material_reflectance", "f4", (MAX_MATERIALS, 4)),
            # metallic, roughness, 1 where Lambertian, 1 where it conserves energy
            ("material_law", "f4", (MAX_MATERIALS, 4)),
            # Clear coat: strength, roughness. Crinkle: facet size [m], slope. 0: there is none.
            ("material_layers", "f4", (MAX_MATERIALS, 4)),
            # Solar cells: width, height, gap [m]; width 0 where there are none.
            ("material_cells", "f4", (MAX_MATERIALS, 4)),
            # Pitch and width of their fingers, pitch and width of their busbars [m].
            ("material_lines", "f4", (MAX_MATERIALS, 4)),
            ("material_gap_reflectance", "f4", (MAX_MATERIALS, 4)),
            ("material_metal_reflectance", "f4", (MAX_MATERIALS, 4)),
            # [W m-2 sr-1]
            ("material_emission", "f4", (MAX_MATERIALS, 4)),
            # Images of base colour, law, normal, emission: 16 times the layer plus the wrap along u
            # plus 4 times that along v; -1 where there is none.
            ("material_images", "f4", (MAX_MATERIALS, 4)),
            # Scale of the normal map, coverage, coverage below which nothing is there.
            ("material_image_use", "f4", (MAX_MATERIALS, 4)),
            # A bit for each that is more than one reflection law: an element of an array costs
            # every sample a load of its own.
            ("layered_materials", "u4", 4),
        ]
    ),
)


# Over a cell, some 2.2 samples across, normals that turn by less [rad] are as good as their mean:
# the mean cosine is right to 5e-5, and a highlight is widened by no more than that.
_LARGEST_TURN, _CELL_WIDTH = 0.035, 2.2


def tile_values(tile: RasterTile, clip_from_camera: Any) -> dict[str, Any]:
    """The Tile block for one depth slice of a tile."""
    to_raster = tile.cells.raster_from_cell
    sample_edge = float(np.linalg.norm(tile.sample_steps[0, :3]))
    return {
        "clip_from_camera": clip_from_camera,
        "tile_edges": tile.edges,
        "sample_steps": tile.sample_steps,
        "sight_origin": tile.sight_origin,
        "cell_from_raster": tile.cells.cell_from_raster.T.ravel(),
        "raster_from_cell": to_raster[:, :2].T.ravel(),
        "raster_origin": to_raster[:, 2],
        "cells": tile.cells.size,
        "cell_reach": tile.cells.reach,
        "largest_curvature": _LARGEST_TURN / (_CELL_WIDTH * sample_edge),
    }


def joint_values(model_name: str, posed: PosedMesh) -> dict[str, Any]:
    """The Joints block of a mesh, some of which joints have moved.

    Raises AssetError for more joints than the block holds.
    """
    if len(posed.joints) > MAX_JOINTS:
        problem = f"has {len(posed.joints)} joints, at most {MAX_JOINTS} can move"
        raise AssetError(f'model "{model_name}" {problem}')
    assert posed.motion is not None
    return {"joint_rows": _joint_rows(posed.motion)}


def joint_rate_values(motion: PoseMotion) -> dict[str, Any]:
    """The JointRates block of a spacecraft whose joints move."""
    assert motion.joint_rates is not None
    return {"joint_rate_rows": _joint_rows(motion.joint_rates)}


def _joint_rows(matrices: Array) -> Array32:
    rows = np.zeros((3 * (1 + MAX_JOINTS), 4), dtype=np.float32)
    filled = matrices[:, :3].reshape(-1, 4)
    rows[: len(filled)] = filled
    return rows


_standing, _no_curve = np.zeros((4, 4)), np.zeros((TERMS // 4, 4))


def spacecraft_values(view: SpacecraftView, air: AirBetween | None = None) -> dict[str, Any]:
    """The Spacecraft block of a spacecraft.

    air : before it
    """
    motion, spread = view.motion, view.light_spread
    return {
        "camera_from_body": view.camera_from_body,
        "pose_rate": _standing if motion is None else motion.rate,
        "pose_change": _standing if motion is None else motion.change,
        "pose_third": _standing if motion is None else motion.third,
        "light_turn": np.zeros(4) if motion is None else (*motion.light_turn, 0.0),
        "spread_turn": np.zeros(4) if spread is None else (*spread.turn, spread.focal_px),
        "spread_sun": np.zeros(4)
        if spread is None
        else (*spread.turn_in_space, 2.0 * spread.farthest),
        "spread_shift": np.zeros(4) if spread is None else (*spread.shift, spread.cells),
        "row_clock": (0.0, 0.0) if motion is None else motion.line,
        "row_curve": _no_curve
        if motion is None or motion.curve is None
        else motion.curve.reshape(-1, 4),
        "sky_from_camera": view.sky_from_camera,
        "sun_direction": (*view.sun_direction, 0.0),
        "sun_irradiance": view.sun_irradiance,
        "sun_limb_u": view.sun_limb[0],
        "sun_limb_v": view.sun_limb[1],
        "air_light": 0.0 if air is None else air.light,
        "air_transmittance": 1.0 if air is None else air.transmittance,
        "sun_angular_radius": view.sun_angular_radius,
        "instance": view.instance,
    }


# Directions that stand for the Sun's disc in a pixel, and in a cell of samples.
_DIRECTIONS_PER_PIXEL = 400
_MIN_DIRECTIONS, _MAX_DIRECTIONS = 16, 100


def shadow_values(view: SpacecraftView, sample_grid: SampleGrid) -> dict[str, Any]:
    """The Shadow block of a spacecraft drawn on a sample grid."""
    taps = _DIRECTIONS_PER_PIXEL // sample_grid.cells_per_edge**2
    maps = view.shadow.maps
    from_body = np.zeros((2, 4, 4), dtype=np.float32)
    frame = np.zeros((2, 4), dtype=np.float32)
    atlas = np.zeros((2, 4), dtype=np.float32)
    # Nothing lies within the inset of a map that is not there.
    frame[1, 3] = np.inf
    column = bounds = 0
    for row, one in enumerate(maps):
        from_body[row] = one.texel_from_body
        frame[row] = one.texel, one.top, one.depth, one.inset
        atlas[row] = one.size, column, bounds, np.tan(view.sun_angular_radius) / one.texel
        column += one.size
        bounds += one.bounds_width
    light_from_camera = np.eye(4, dtype=np.float32)
    light_from_camera[:3, :3] = view.shadow.R_light_from_body @ view.camera_from_body[:3, :3].T
    return {
        "light_from_camera": light_from_camera,
        "shadow_from_body": from_body,
        "shadow_frame": frame,
        "shadow_atlas": atlas,
        "shadow_taps": min(max(taps, _MIN_DIRECTIONS), _MAX_DIRECTIONS),
        "shadow_lean": view.shadow.lean,
    }


def _image_code(layer: int | None, images: tuple[Image, ...]) -> float:
    """How the Materials block tells a layer."""
    if layer is None:
        return -1.0
    u, v = images[layer].wrap
    return 16.0 * layer + u + 4.0 * v


def lamp_values(lamps: Sequence[LampView]) -> dict[str, Any]:
    """The Lamps block."""
    rows = np.zeros((_LAMP_ROWS * MAX_LAMPS, 4), dtype=np.float32)
    for index, view in enumerate(lamps):
        solid = not any(caster.both_sides for caster in view.casters)
        first = _LAMP_ROWS * index
        rows[first : first + 6] = (
            (*view.place, view.lamp.radius),
            (*view.axis, view.lamp.half_angle),
            view.intensity,
            view.column,
            view.row,
            (
                view.lamp.edge,
                index * MAP_SIZE,
                index * LAMP_BOUNDS,
                -view.hard_near if solid else view.hard_near,
            ),
        )
        if view.motion is not None:
            rows[first + 6 : first + _LAMP_ROWS, :3] = (*view.motion.place, *view.motion.axis)
    return {"lamp_rows": rows, "lamp_count": len(lamps), "lamp_map_size": MAP_SIZE}


def material_values(
    model_name: str, materials: tuple[Material, ...], textures: SurfaceTextures
) -> dict[str, Any]:
    """The Materials block of a model."""
    if len(materials) > MAX_MATERIALS:
        raise AssetError(
            f'model "{model_name}" has {len(materials)} materials, at most {MAX_MATERIALS} fit'
        )
    names = [name for name in MATERIALS.dtype.names or () if name.startswith("material_")]
    values = {name: np.zeros((MAX_MATERIALS, 4), dtype=np.float32) for name in names}
    for row, material in enumerate(materials):
        values["material_reflectance"][row] = material.reflectance
        values["material_emission"][row] = material.emission
        maps = material.maps
        values["material_images"][row] = (
            _image_code(maps.base_colour, textures.base_colour),
            _image_code(maps.law, textures.law),
            _image_code(maps.normal, textures.normal),
            _image_code(maps.emission, textures.emission),
        )
        cutoff = -1.0 if material.cutoff is None else material.cutoff
        values["material_image_use"][row, :3] = maps.normal_scale, material.coverage, cutoff
        flags = float(material.roughness is None), float(material.conserving)
        values["material_law"][row] = material.metallic, material.roughness or 1.0, *flags
        if material.coat is not None:
            coat = material.coat
            values["material_layers"][row, :2] = coat.strength, coat.roughness
        if material.crinkle is not None:
            crinkle = material.crinkle
            values["material_layers"][row, 2:] = crinkle.facet_size, crinkle.slope
        if material.cells is not None:
            cells = material.cells
            values["material_cells"][row, :3] = cells.width, cells.height, cells.gap
            values["material_lines"][row] = (
                cells.finger_pitch,
                cells.finger_width,
                cells.busbar_pitch,
                cells.busbar_width,
            )
            values["material_gap_reflectance"][row] = cells.gap_reflectance
            values["material_metal_reflectance"][row] = cells.metal_reflectance
    layered = np.zeros(128, dtype=bool)
    layered[: len(materials)] = [material.layered for material in materials]
    bits = np.packbits(layered, bitorder="little").view("<u4")
    return {**values, "layered_materials": bits}
