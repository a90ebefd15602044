"""From the float64 scene to what one camera draws, float32 and relative to the camera.

Large coordinates are subtracted here, and the Earth's in ``background``. Camera axes are used
throughout (z boresight, x right, y down); the projection puts row 0 of the image at row 0 of the
target.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.distortion import drawn_points, warped_disc_share, warped_points
from simgl.camera.pinhole_fields import FINER, PinholeField, pinhole_fields
from simgl.camera.pixel_ramp import SHARP, Ramps
from simgl.radiosity.transport_store import JointLight
from simgl.scene.state import CameraState, SceneState, SunSeen
from simgl.view.background import Background, background
from simgl.view.exposure_parts import ExposurePart
from simgl.view.lamp_views import LampView, lamp_views
from simgl.view.light_spread import light_spread
from simgl.view.raster_tiles import RasterTile, pixel_centre_tile, raster_tiles
from simgl.view.row_clock import RowClock, pose_motion
from simgl.view.spacecraft_view import ShadowsOf, SpacecraftView, spacecraft_views
from simgl.view.tile_parts import parts

Gather = Literal["vertex", "pixel"]
# While that light is still unknown: drawn with the same programs, as if there were none of it.
Dark = Literal["dark"]

# Larger tiles are lit in parts: a sample takes some 30 bytes while it is worked on.
_SAMPLES_AT_ONCE = 10_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameView:
    """Everything that the passes need for one image.

    field : the pinhole images that are drawn for a lens that distorts; None where it does not
    other_pinholes : for a lens too wide for one pinhole, the views through the others
    background : Earth and Sun, of the finer one of them
    spacecraft : all that the camera does not see behind the Earth
    tiles : of the other pinhole image, the farthest first
    gather : where light from other surfaces is worked out
    glossy_reflections : it is followed by rays in the lobes of glossy surfaces
    joint_light : how it is worked out between parts that joints have moved
    ramps : of each band between neighbouring pixels, for lenses that spread light [px]
    light_parts : of the time for which it stands, in each of which lobes are averaged apart
    """

    camera: Camera
    field: PinholeField | None
    background: Background
    spacecraft: tuple[SpacecraftView, ...]
    tiles: tuple[RasterTile, ...]
    lamps: tuple[LampView, ...]
    gather: Gather | Dark = "vertex"
    glossy_reflections: bool = False
    joint_light: JointLight = "exact"
    other_pinholes: tuple[FrameView, ...] = ()
    ramps: Ramps = SHARP
    light_parts: int = 1

    @property
    def pinholes(self) -> tuple[FrameView, ...]:
        """The view through each pinhole; all pixels are drawn through one of them."""
        return self, *self.other_pinholes

    @property
    def hides_much(self) -> bool:
        """Whether the spacecraft of the first tile may hide so much of the background that it is
        worth waiting for them, and not to draw it while the CPU does other work."""
        if self.field is not None or not self.tiles or self.tiles[0].window is not None:
            return False
        tile, d = self.tiles[0], self.camera.detector
        return 2 * tile.width * tile.height > d.width * d.height

    @property
    def touched(self) -> tuple[int, int, int, int]:
        """x, y, width, height of the pixels that spacecraft may touch."""
        d = self.camera.detector
        if self.field is not None:
            return 0, 0, d.width, d.height
        if not self.tiles:
            return 0, 0, 0, 0
        # A ramp brings light to the next pixel.
        more = 0 if self.ramps == SHARP else 1
        x0 = max(min(tile.x for tile in self.tiles) - more, 0)
        y0 = max(min(tile.y for tile in self.tiles) - more, 0)
        x1 = min(max(tile.x + tile.width for tile in self.tiles) + more, d.width)
        y1 = min(max(tile.y + tile.height for tile in self.tiles) + more, d.height)
        return x0, y0, x1 - x0, y1 - y0

    @property
    def shows_nothing_behind(self) -> bool:
        """Whether all that is behind spacecraft is black."""
        return all(
            seen.background.planet is None and seen.background.celestial is None
            for seen in self.pinholes
        )

    @property
    def lit_area(self) -> tuple[int, int, int, int]:
        """x, y, width, height of the pixels that anything may light; the others are black."""
        d = self.camera.detector
        return self.touched if self.shows_nothing_behind else (0, 0, d.width, d.height)


def frame_view(
    state: SceneState,
    camera_name: str,
    *,
    sample_budget: int,
    samples_per_pixel: int | None = None,
    inter_reflection: bool = True,
    between_spacecraft: bool = False,
    gather: Gather | Dark = "vertex",
    glossy_reflections: bool = False,
    joint_light: JointLight = "exact",
    margin: int = 0,
    part: ExposurePart | None = None,
) -> FrameView:
    """What one camera of the scene draws.

    sample_budget : geometry samples that a tile may take where ``samples_per_pixel`` is None
    samples_per_pixel : of geometry; more where spacecraft are small
    inter_reflection : light between the surfaces of a spacecraft, and the Earth hidden by them
    between_spacecraft : light from one to another, too
    gather : that light at vertices, or by rays from every sample, or none of it
    glossy_reflections : that light in the lobes of glossy surfaces by rays, not uniform
    joint_light : that light where joints have moved parts: pair by pair of rigid groups, or by a
        bake of each pose
    margin : so many pixels around the image are drawn, too. Not by a state with a larger camera:
        what does not depend on cameras is worked out once for each state
    part : of an exposure, of which this state is the middle; None for the state itself

    Raises ConfigError where the camera is inside a body or the Earth.
    """
    placed = state.cameras[camera_name]
    placed = replace(placed, camera=placed.camera.with_margin(margin))
    real = placed.camera
    rows = None if part is None else part.rows
    if part is not None and part.names is not None:
        # The samples of all snapshots of a layer add up.
        sample_budget = int(sample_budget * part.exposure_time / real.exposure_time)

    def through(seen: PinholeField | None) -> FrameView:
        camera = _through(placed, seen)
        # Rays from every sample find the others by themselves.
        near = between_spacecraft and gather == "vertex"
        shadows = None
        if part is not None and part.shadows is not None:
            lit = _through(part.shadows.cameras[camera_name], seen)
            shadows = ShadowsOf(
                state=part.shadows,
                camera=lit,
                turn=part.shadow_turn,
                while_open=part.turn_while_open,
            )
        views = spacecraft_views(
            state,
            camera,
            inter_reflection,
            between_spacecraft=near,
            shadows=shadows,
            samples_per_pixel=samples_per_pixel,
            shown=None if part is None else part.names,
        )
        ends = _ends_of_rows(part, real, seen)
        lamps = lamp_views(state, camera, ends)
        if part is not None and rows is not None:
            # Where a lamp moves, what stands still before the camera has other light in each row.
            lamps_move = any(lamp.motion is not None for lamp in lamps)
            views = [_moving(view, part, rows, real, seen, lamps_move) for view in views]
        if part is not None and part.blurs:
            views = [_lit_by_time(view, part, real, seen) for view in views]
        return FrameView(
            camera=real,
            field=seen,
            background=_background_through(state, placed, seen),
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
            glossy_reflections=glossy_reflections,
            joint_light=joint_light,
            light_parts=1 if part is None else part.light_parts,
        )

    first, *others = map(through, [None] if real.is_pinhole else pinhole_fields(real))
    return replace(first, other_pinholes=tuple(others))


def _through(placed: CameraState, seen: PinholeField | None) -> CameraState:
    """The pinhole through which a part of a camera's field is drawn; the camera itself for None."""
    if seen is None:
        return placed
    R = seen.R_pinhole_from_camera @ placed.R_camera_from_icrf
    return replace(placed, camera=seen.pinhole, R_camera_from_icrf=R)


def _moving(
    view: SpacecraftView,
    part: ExposurePart,
    rows: RowClock,
    camera: Camera,
    field: PinholeField | None,
    lamps_move: bool,
) -> SpacecraftView:
    """A spacecraft as the rows of a part of an exposure see it one after the other."""
    states = (part.before, part.state, part.after)
    seen = [
        (_through(state.cameras[camera.name], field), state.bodies[view.name])
        for state in states
        if state is not None
    ]
    motion = pose_motion(rows, camera, field, seen)
    return replace(view, motion=motion) if motion.moves or lamps_move else view


def _ends_of_rows(
    part: ExposurePart | None, camera: Camera, field: PinholeField | None
) -> list[tuple[SceneState, CameraState]]:
    """The scene and the camera at the first and the last row's time; none where there are none."""
    ends = () if part is None else (part.before, part.after)
    return [(end, _through(end.cameras[camera.name], field)) for end in ends if end is not None]


def _lit_by_time(
    view: SpacecraftView, part: ExposurePart, camera: Camera, field: PinholeField | None
) -> SpacecraftView:
    """A spacecraft with the light of all of a part of an exposure."""
    states = part.first, part.state, part.last
    seen = [
        (_through(state.cameras[camera.name], field), state.bodies[view.name]) for state in states
    ]
    share = 0.5 * part.exposure_time / part.half_span
    return replace(view, light_spread=light_spread(seen, share))


def behind_spacecraft(view: FrameView, state: SceneState) -> FrameView:
    """A view without spacecraft, before the background of another state."""
    placed = replace(state.cameras[view.camera.name], camera=view.camera)

    def through(one: FrameView) -> FrameView:
        behind = _background_through(state, placed, one.field)
        return replace(one, background=behind, spacecraft=(), tiles=())

    first, *others = map(through, view.pinholes)
    return replace(first, other_pinholes=tuple(others))


def backgrounds(
    state: SceneState, camera_name: str, margin: int = 0
) -> Iterator[tuple[Background, tuple[int, int]]]:
    """What the images of one camera show behind spacecraft, each with its width and height.

    Raises ConfigError where the camera is inside the Earth.
    """
    placed = state.cameras[camera_name]
    placed = replace(placed, camera=placed.camera.with_margin(margin))
    real = placed.camera
    for seen in (None,) if real.is_pinhole else pinhole_fields(real):
        detector = (real if seen is None else seen.fine).detector
        yield _background_through(state, placed, seen), (detector.width, detector.height)


def _background_through(
    state: SceneState, placed: CameraState, seen: PinholeField | None
) -> Background:
    if seen is None:
        return background(state, placed)
    behind = background(state, replace(_through(placed, seen), camera=seen.fine))
    sun = state.sun.seen_from(placed.position)
    return _with_all_their_light(behind, sun, placed, seen)


def _with_all_their_light(
    behind: Background, sun: SunSeen, placed: CameraState, seen: PinholeField
) -> Background:
    """A background whose stars and Sun make up for what a distorting lens's warp loses, adds or
    displaces."""
    beyond = behind.celestial
    if beyond is None:
        return behind
    stars, disc = beyond.stars, beyond.sun
    if stars is not None:
        rays = seen.pinhole.rays(stars.pixels.astype(np.float64) / FINER)
        rays = rays @ seen.R_pinhole_from_camera
        warped = warped_points(placed.camera, rays)
        moved, widths = drawn_points(placed.camera, seen, rays, warped.offset)
        stars = replace(
            stars,
            pixels=(stars.pixels + moved).astype(np.float32),
            irradiance=(stars.irradiance / warped.share[:, None]).astype(np.float32),
            widths=widths.astype(np.float32),
        )
    if disc is not None:
        ray = placed.R_camera_from_icrf @ sun.direction_icrf
        of_sun = warped_disc_share(placed.camera, ray, sun.angular_radius)
        disc = replace(disc, radiance=(disc.radiance / of_sun).astype(np.float32))
    return replace(behind, celestial=replace(beyond, stars=stars, sun=disc))


def truth_tile(view: FrameView) -> RasterTile | None:
    """One tile over the whole image with a single sample at each pixel's centre; where the lens
    distorts, over the finer image of its pinhole."""
    names = {one.name for tile in view.tiles for one in tile.spacecraft}
    spacecraft = tuple(one for one in view.spacecraft if one.name in names)
    if not spacecraft:
        return None
    camera = view.camera if view.field is None else view.field.centred
    return pixel_centre_tile(spacecraft, camera)


def lit_parts(tile: RasterTile, view: FrameView) -> list[RasterTile]:
    """A tile of a view in parts of so many samples as can be lit at once, finer along lit limbs."""
    columns, rows = tile.raster_size
    if columns * rows <= _SAMPLES_AT_ONCE and not tile.cuts:
        return [tile]
    if view.field is None:
        # A ramp brings light from the next pixel.
        return parts(tile, view.camera, _SAMPLES_AT_ONCE, int(view.ramps != SHARP))
    return parts(tile, view.field.pinhole, _SAMPLES_AT_ONCE, view.field.reach)
