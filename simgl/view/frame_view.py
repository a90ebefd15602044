"""From the float64 scene to what one camera draws, float32 and relative to the camera.

Large coordinates are subtracted here, and the Earth's in ``background``. Camera axes are used
throughout (z boresight, x right, y down); the projection puts row 0 of the image at row 0 of the
target.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.distortion import PinholeField, field, warped_point_share
from simgl.radiosity.transport_store import JointLight
from simgl.scene.state import SceneState
from simgl.view.background import Background, background
from simgl.view.exposure_parts import ExposurePart
from simgl.view.lamp_views import LampView, lamp_views
from simgl.view.raster_tiles import RasterTile, pixel_centre_tile, raster_tiles
from simgl.view.row_clock import RowClock, pose_motion
from simgl.view.spacecraft_view import SpacecraftView, spacecraft_views

Gather = Literal["vertex", "pixel"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameView:
    """Everything that the passes need for one image.

    field : pinhole images that hold the view of a lens that distorts; None where it does not
    background : Earth and Sun, of the finer one of them
    spacecraft : all that the camera does not see behind the Earth
    tiles : of the other pinhole image, the farthest first
    gather : where light from other surfaces is worked out
    joint_light : how it is worked out between parts that joints have moved
    """

    camera: Camera
    field: PinholeField | None
    background: Background
    spacecraft: tuple[SpacecraftView, ...]
    tiles: tuple[RasterTile, ...]
    lamps: tuple[LampView, ...]
    gather: Gather = "vertex"
    joint_light: JointLight = "exact"


def frame_view(
    state: SceneState,
    camera_name: str,
    *,
    sample_budget: int,
    samples_per_pixel: int | None = None,
    inter_reflection: bool = True,
    gather: Gather = "vertex",
    joint_light: JointLight = "exact",
    part: ExposurePart | None = None,
) -> FrameView:
    """What one camera of the scene draws.

    sample_budget : geometry samples that a tile may take where ``samples_per_pixel`` is None
    samples_per_pixel : of geometry; more where spacecraft are small
    inter_reflection : light between the surfaces of a spacecraft, and the Earth hidden by them
    gather : that light at vertices, or by rays from every sample
    joint_light : that light where joints have moved parts: pair by pair of rigid groups, or by a
        bake of each pose
    part : of an exposure, of which this state is the middle; None for the state itself

    Raises ConfigError where the camera is inside a body or the Earth.
    """
    camera = fine = state.cameras[camera_name]
    real = camera.camera
    seen = None if real.is_pinhole else field(real)
    if seen is not None:
        camera, fine = replace(camera, camera=seen.pinhole), replace(camera, camera=seen.fine)
    views = spacecraft_views(state, camera, inter_reflection)
    rows = None if part is None else part.rows
    if part is not None and rows is not None:
        views = [_moving(view, part, rows, real, camera.camera) for view in views]
    lamps = lamp_views(state, camera)
    return FrameView(
        camera=real,
        field=seen,
        background=_with_all_their_light(background(state, fine), real),
        spacecraft=tuple(views),
        tiles=raster_tiles(
            views,
            camera.camera,
            sample_budget,
            samples_per_pixel,
            with_lamps=bool(lamps) or real.lidar is not None,
            rows=None if rows is None or seen is not None else (rows.first, rows.end),
        ),
        lamps=lamps,
        gather=gather,
        joint_light=joint_light,
    )


def _moving(
    view: SpacecraftView, part: ExposurePart, rows: RowClock, camera: Camera, pinhole: Camera
) -> SpacecraftView:
    """A spacecraft as the rows of a part of an exposure see it one after the other."""
    states = (part.before, part.state, part.after)
    seen = [
        (state.cameras[camera.name], state.bodies[view.name])
        for state in states
        if state is not None
    ]
    motion = pose_motion(rows, camera, pinhole, seen)
    return replace(view, motion=motion) if motion.moves else view


def behind_spacecraft(view: FrameView, state: SceneState) -> FrameView:
    """A view without spacecraft, before the background of another state."""
    camera = state.cameras[view.camera.name]
    fine = view.camera if view.field is None else view.field.fine
    behind = background(state, replace(camera, camera=fine))
    return replace(
        view, background=_with_all_their_light(behind, view.camera), spacecraft=(), tiles=()
    )


def _with_all_their_light(behind: Background, camera: Camera) -> Background:
    """A background whose stars make up for what a distorting lens's warp loses or adds of them."""
    beyond = behind.celestial
    if camera.is_pinhole or beyond is None or beyond.stars is None:
        return behind
    share = warped_point_share(camera, beyond.stars.pixels)
    irradiance = np.asarray(beyond.stars.irradiance / share[:, None], dtype=np.float32)
    stars = replace(beyond.stars, irradiance=irradiance)
    return replace(behind, celestial=replace(beyond, stars=stars))


def truth_tile(view: FrameView) -> RasterTile | None:
    """One tile over the whole image with a single sample at each pixel's centre; where the lens
    distorts, over the finer image of its pinhole."""
    names = {one.name for tile in view.tiles for one in tile.spacecraft}
    spacecraft = tuple(one for one in view.spacecraft if one.name in names)
    if not spacecraft:
        return None
    camera = view.camera if view.field is None else view.field.centred
    return pixel_centre_tile(spacecraft, camera)
