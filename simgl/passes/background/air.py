"""The air before a camera: which tables its image reads, drawn where they are not there yet.

A view's table holds for one height and one angle of the Sun, and for all directions. Heights are
taken in steps, and rays from space read the table of a step where they pass its height; angles of
the Sun lie between four nodes, whose tables are marched and then mixed, so that a moving Sun costs
a march only when it passes a node. Nodes lie
close where the Sun is low over some of what is seen, and eight times as far apart where it is high
over all of it. What the air lets through does not depend on the Sun. Images from one place share
the tables: those of a camera, and the six that a spacecraft near it sees around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.lru_cache import LruCache
from simgl.next_step import StepWatch
from simgl.passes.background.air_march import AIR_VIEW, MARCHED, STEPS
from simgl.passes.background.air_nodes import (
    COLUMNS,
    PARTS,
    SLOTS,
    AirNodes,
    Nodes,
    height_place,
    new_table,
    nodes_per_radian,
    view_values,
)
from simgl.passes.background.air_tables import AIR, medium_defines
from simgl.passes.background.earth_air import PAIRS, AirTables, EarthAir, medium_samplers
from simgl.passes.shared_blocks import AirBetween
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.frames import angle_between, norm
from simgl.progress import ProgressCallback
from simgl.scene.earth import Earth
from simgl.view.aerial_perspective import AirSegment
from simgl.view.background import PlanetView

# What a variant of a shader that looks through the air reads, besides the blocks.
AIR_SAMPLERS = ("transmittance_table", "diffuse_down", "view_light", "view_transmittance")

_SEGMENT = Block(
    "AirSegment",
    23,
    np.dtype(
        [
            # Height [km], cosine of the view direction, and both ends [km].
            ("segment_place", "f4", 4),
            # Cosines of the Sun's direction from the zenith, and from the view direction.
            ("segment_sun", "f4", 2),
            ("segment_padding", "f4", 2),
        ]
    ),
)

# Tables that are cached, mixed: a camera's and those of spacecraft near it.
_CAPACITY = 8

# Atmospheres whose tables are cached, some megabytes each.
_MAX_KINDS = 4

_MIX = Block(
    "AirMix",
    24,
    np.dtype(
        [
            # Of the Sun in each part, from the second node to the third, the rest of a row unused;
            # and slots of its four nodes.
            ("node_places", "f4", (PARTS, 4)),
            ("node_slots", "i4", (PARTS, 4)),
            # Rows of a slot, and of a part.
            ("slot_rows", "i4"),
            ("part_rows", "i4"),
            # Of the nodes, to a radian.
            ("nodes_per_radian", "f4"),
            # Height of the camera above that of the nodes, over its distance from the centre.
            ("rise", "f4"),
        ]
    ),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBefore:
    """What a shader binds to look through the air.

    inside : whether the camera stands in it
    textures : in the order of AIR_SAMPLERS
    pairs : table of what passes it twice, of an air in which light falls by no one exponential
    """

    inside: bool
    textures: tuple[moderngl.Texture | moderngl.Texture3D, ...]
    pairs: moderngl.Texture | moderngl.Texture3D | None


class AtmospherePass:
    """Owns the tables of every air in use, and of the views last drawn."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._between: dict[bool, FullscreenProgram] = {}
        self._view = UniformBuffer(ctx, AIR_VIEW)
        self._tables = LruCache[EarthAir, AirTables](_MAX_KINDS, AirTables.release)
        self._mix = FullscreenProgram(ctx, "air/mix", _MIX, ["node_light"], shared=[AIR_VIEW])
        self._nodes = AirNodes(ctx)
        self._unused: list[ImageTarget] = []
        self._views = LruCache[tuple[object, ...], ImageTarget](_CAPACITY, self._unused.append)
        self._last: tuple[tuple[object, ...], AirTables, AirBefore] | None = None
        self._watches: dict[str, StepWatch] = {}
        # Angles of the Sun, and of the Moon (True), that the images since the last ``ahead`` saw,
        # and what they were at the last one of each viewer.
        self._angles: dict[bool, float] = {}
        self._last_angles: dict[str, dict[bool, float]] = {}

    def prepare(self, earth: Earth, progress: ProgressCallback | None = None) -> None:
        """Make the tables that do not depend on a view, so that no frame waits for them."""
        kind = _kind_of(earth)
        if kind is not None:
            self._tables_of(kind, progress)

    def _tables_of(self, kind: EarthAir, progress: ProgressCallback | None = None) -> AirTables:
        return self._tables.get(kind, lambda: AirTables(self._ctx, kind, progress))

    def stands_inside(self, planet: PlanetView) -> bool | None:
        """Whether a pinhole stands in the air; None where there is none."""
        return None if _kind_of(planet.earth) is None else planet.height < AIR_TOP

    def before(self, planet: PlanetView) -> AirBefore | None:
        """The air before a pinhole, its blocks bound; None where there is none.

        May draw: to be called before a pass sets its state.
        """
        kind = _kind_of(planet.earth)
        if kind is None:
            return None
        # The faces of a sky look from one place.
        place = planet.earth.radii, planet.camera_in_sphere.tobytes(), planet.outside
        key = kind, *place, planet.sun_direction_itrf.tobytes()
        if self._last is None or self._last[0] != key:
            tables = self._tables_of(kind)
            height, sun = planet.height, _sun_in_sphere(planet)
            angle = angle_between(planet.camera_in_sphere.astype(np.float64), sun)
            nodes = self._nodes.of(kind, height, moonlit=planet.moonlit)
            self._angles[planet.moonlit] = angle
            self._last = None
            self._view.write(_values_of(planet, sun, kind.radius, height, angle))
            light = self._light(tables, nodes, height, angle)
            shared = (tables.textures[name] for name in AIR_SAMPLERS[:2])
            of_view = *light.textures, *nodes.transmittance.textures
            pairs = tables.textures.get(PAIRS)
            air = AirBefore(inside=nodes.inside, textures=(*shared, *of_view), pairs=pairs)
            self._last = key, tables, air
        _, tables, air = self._last
        tables.block.bind()
        self._view.bind()
        return air

    def ahead(self, planet: PlanetView, viewer: str) -> None:
        """March a part of the tables that a viewer comes to next, before its image, so that no
        image waits for all of them.

        viewer : whose height is followed from image to image
        """
        angles, self._angles = self._angles, {}
        last, self._last_angles[viewer] = self._last_angles.get(viewer, {}), angles
        step = self._watches.setdefault(viewer, StepWatch()).next_step(height_place(planet.height))
        kind = _kind_of(planet.earth)
        if step is not None and kind is not None:
            # Those known are of the image before.
            images = step.enters + 1
            coming = {
                moonlit: angle + images * (angle - last.get(moonlit, angle))
                for moonlit, angle in angles.items()
            }
            self._nodes.fill_ahead(self._tables_of(kind), kind, step, coming)

    def between(self, segment: AirSegment | None) -> AirBetween | None:
        """The air before a spacecraft; None where there is none. Read back: 4 ms on a CPU."""
        kind = None if segment is None else _kind_of(segment.earth)
        if segment is None or kind is None:
            return None
        target = ImageTarget(self._ctx, (1, 1), (Format("f4", 4),) * 2)
        ends = segment.near / 1e3, segment.far / 1e3
        values = {
            "segment_place": (segment.height / 1e3, segment.mu, *ends),
            "segment_sun": (segment.mu_sun, segment.nu),
        }
        light, transmittance = np.zeros(4), np.zeros(4)
        for part in self._tables_of(kind).parts:
            samplers = [*medium_samplers(part.air), *MARCHED]
            absorbs = bool(part.air.absorbers)
            if absorbs not in self._between:
                self._between[absorbs] = FullscreenProgram(
                    self._ctx,
                    "air/between",
                    _SEGMENT,
                    samplers,
                    {"STEPS": STEPS} | medium_defines(part.air),
                    shared=[AIR],
                )
            self.state.apply(self._ctx, target.framebuffer, (0, 0, 1, 1))
            part.block.bind()
            self._between[absorbs].draw(values, [part.textures[name] for name in samplers])
            of_terms = (target.read(i)[0, 0].astype(np.float64) for i in (0, 1))
            of_bands = [part.shares @ one for one in of_terms]
            light, transmittance = light + of_bands[0], transmittance + of_bands[1]
        release_all(self._ctx, target)
        return AirBetween(light=light * segment.sun_irradiance, transmittance=transmittance)

    def _light(self, tables: AirTables, nodes: Nodes, height: float, angle: float) -> ImageTarget:
        """The light of a view: between that of the nodes on both sides of the Sun's angle."""
        key = nodes.kind, height, angle
        return self._views.get(key, lambda: self._draw_mixed(tables, nodes, height, angle))

    def _draw_mixed(
        self, tables: AirTables, nodes: Nodes, height: float, angle: float
    ) -> ImageTarget:
        places, indices = nodes.mixture(angle)
        self._nodes.fill(tables, nodes, indices)
        while self._unused and self._unused[-1].size[1] != nodes.rows:
            release_all(self._ctx, self._unused.pop())
        target = self._unused.pop() if self._unused else new_table(self._ctx, nodes.rows, COLUMNS)
        self.state.apply(self._ctx, target.framebuffer, (0, 0, *target.size))
        # Inside the air the light between two heights counts, and the steps are finer.
        rise = 0.0 if nodes.inside else height - nodes.height
        values = {
            "node_places": places[:, None],
            "node_slots": indices % SLOTS,
            "slot_rows": nodes.rows,
            "part_rows": nodes.part_rows,
            "nodes_per_radian": nodes_per_radian(angle, nodes.height),
            "rise": rise / (nodes.kind.radius + height),
        }
        self._view.bind()
        self._mix.draw(values, nodes.light.textures)
        return target

    def release(self) -> None:
        """Free everything."""
        self._last = None
        self._views.clear()
        release_all(self._ctx, *self._unused)
        self._unused.clear()
        self._nodes.release()
        self._mix.release()
        self._tables.clear()
        for program in self._between.values():
            program.release()
        self._between.clear()
        self._view.release()


def _kind_of(earth: Earth) -> EarthAir | None:
    if earth.air is None:
        return None
    return EarthAir(air=earth.air, radius=earth.equatorial_radius, albedo=earth.mean_albedo)


def _sun_in_sphere(planet: PlanetView) -> Array:
    """Unit direction towards the Sun, stretched like everything in sphere space."""
    radii = np.array(planet.earth.radii)
    stretched = radii[0] / radii * planet.sun_direction_itrf.astype(np.float64)
    return stretched / norm(stretched)


def _values_of(
    planet: PlanetView, sun: Array, radius: float, height: float, angle: float
) -> dict[str, object]:
    """The block as an image reads it: its own horizon, the table's layout.

    sun : (3,) unit towards it, and its angle from the zenith of the camera, in sphere space
    """
    place = planet.camera_in_sphere.astype(np.float64)
    up = place / norm(place)
    side = sun - np.dot(sun, up) * up
    length = norm(side)
    if length < 1e-9:
        side = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        length = norm(side)
    reach = AIR_TOP * (2.0 * radius + AIR_TOP) / radius**2
    return view_values(radius, height, angle) | {
        "camera_up": (*up, 0.0),
        "sun_side": (*(side / length), 0.0),
        "outside_air": planet.outside,
        "horizon_reach": min(planet.outside, reach),
        "camera_nearness": 1.0 / np.sqrt(1.0 + planet.outside),
    }
