"""Tables of the air at nodes of the Sun's angle, for steps of a camera's height.

Heights are taken in steps; from space a ray passes the height of its step at another place, where
its table is read. A table's rows lie in parts, each with nodes of its own between those of the
others: while the Sun moves evenly a few rows are marched in each frame. Where the height passes a
step all are needed; a camera that nears it has had them made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import acos, exp, log, log1p, pi

import moderngl
import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.lru_cache import LruCache
from simgl.next_step import NextStep
from simgl.passes.background.air_march import AirMarch, MarchedRows
from simgl.passes.background.earth_air import AirTables, EarthAir
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS

# As in shaders/air/view.glsl; of the half circle of azimuths.
_GROUND_ROWS, _LIMB_ROWS, _SKY_ROWS = 64, 160, 64
_ROWS = _GROUND_ROWS + _LIMB_ROWS + _SKY_ROWS
# The steps of a view: of its height, relative, from space and inside the air, and between the Sun's
# nodes [rad]: 1.6 km at 400 km, and 3.6 s on the way round. At the terminator light falls by e in
# 1.5 degrees, low in the limb's blue within half of one.
_HEIGHT_STEP, _STEP_INSIDE, _NODE_STEP = 2.0**-8, 2.0**-10, 2.0**-8
# Where the Sun stands high over all that is seen nodes may be so many times as far apart: what the
# air lets pass of its light, exp(-t / cos) with t = 0.35, is then interpolated within 5e-5 up to 70
# degrees from the zenith. Past 82 degrees they are closer, and all the way where it is low over the
# brightest that is seen, too: all light there is that of twilight. [rad]
_WIDER, _WIDE = 8.0, 2.0
_LOW_SUN, _NO_DAY, _BLEND = np.radians(75.0), np.radians(84.0), np.radians(3.0)
# Azimuths from the Sun at which light is marched. From low orbits the Earth's shadow is wide enough
# that cubics through fewer of them serve an image's table, which is read linearly.
COLUMNS, _FROM_LOW_ORBIT, _LOW_ORBIT_M = 96, 64, 1e6
# Parts of a table's rows, and the nodes of each that are cached, in turns.
PARTS, SLOTS = 16, 8
NO_NODE = np.iinfo(np.int64).min
# Of nodes that are cached: those of a camera, and of spacecraft near it, by the Sun and the Moon.
HEIGHTS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Nodes:
    """Tables of one height: of light at the nodes that the Sun has passed last.

    light : ``SLOTS`` tables, one under the other
    cached : (parts, slots) index of the node whose rows a part has in a slot, or ``NO_NODE``
    transmitting : parts of the transmittance that are marched
    """

    kind: EarthAir
    height: float
    inside: bool
    transmittance: ImageTarget
    light: ImageTarget
    cached: IndexArray = field(default_factory=lambda: np.full((PARTS, SLOTS), NO_NODE))
    transmitting: set[int] = field(default_factory=set)

    @property
    def rows(self) -> int:
        """Of a table."""
        return self.transmittance.size[1]

    @property
    def part_rows(self) -> int:
        """Of a part of a table."""
        return self.rows // PARTS

    def mixture(self, angle: float) -> tuple[Array, IndexArray]:
        """(parts,) place of an angle of the Sun [rad] from the second of four nodes to the third,
        and (parts, 4) the indices of these."""
        places = _node_place(angle, self.height) - np.arange(PARTS) / PARTS
        below = np.floor(places)
        indices = below[:, None].astype(np.int64) + np.arange(-1, 3)
        return places - below, indices

    def missing(self, indices: IndexArray) -> list[tuple[int, int | None]]:
        """Parts to be marched for the nodes of a mixture: of the transmittance, None, and of
        nodes."""
        parts: list[tuple[int, int | None]] = [
            (part, None) for part in range(PARTS) if part not in self.transmitting
        ]
        present = self.cached[np.arange(PARTS)[:, None], indices % SLOTS] == indices
        if not present.all():
            rows, nodes = np.nonzero(~present)
            parts += zip(rows.tolist(), indices[rows, nodes].tolist(), strict=True)
        return parts


class AirNodes:
    """Owns the nodes of the last heights, and what marches them."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._march = AirMarch(ctx)
        self._nodes = LruCache[tuple[object, ...], Nodes](
            HEIGHTS, lambda nodes: release_all(ctx, nodes.transmittance, nodes.light)
        )

    def values(self) -> list[Nodes]:
        """All that are cached, the least recently used ones first."""
        return self._nodes.values()

    def of(self, kind: EarthAir, height: float, *, moonlit: bool) -> Nodes:
        """Of the Sun or of the Moon: each keeps its own angles while the other's are read.

        Marched as far as earlier views needed it.
        """
        # A step on the other side of the air's top has rows of another kind.
        inside = height < AIR_TOP
        step = _height_of(round(height_place(height)))
        step = min(step, AIR_TOP) if inside else max(step, AIR_TOP)

        def made() -> Nodes:
            # A camera in space looks at no sky.
            rows = _ROWS if inside else _ROWS - _SKY_ROWS
            columns = COLUMNS if inside or step > _LOW_ORBIT_M else _FROM_LOW_ORBIT
            return Nodes(
                kind=kind,
                height=step,
                inside=inside,
                transmittance=new_table(self._ctx, rows, 1),
                light=new_table(self._ctx, SLOTS * rows, columns),
            )

        return self._nodes.get((kind, step, inside, moonlit), made)

    def fill(self, tables: AirTables, nodes: Nodes, indices: IndexArray) -> None:
        """March what the nodes of a mixture lack."""
        for part, index in nodes.missing(indices):
            self._fill_part(tables, nodes, part, index)

    def fill_ahead(
        self, tables: AirTables, kind: EarthAir, step: NextStep, angles: Mapping[bool, float]
    ) -> None:
        """March what is due of the step of height that comes next.

        angles : of the Sun's light and of moonlight when it comes, as far as they are in use [rad]
        """
        height = _height_of(step.index)
        wanted = [
            (self.of(kind, height, moonlit=m), min(max(angle, 0.0), pi))
            for m, angle in angles.items()
        ]
        missing = [
            (nodes, part)
            for nodes, angle in wanted
            for part in nodes.missing(nodes.mixture(angle)[1])
        ]
        for nodes, (part, index) in missing[: step.due(len(missing))]:
            self._fill_part(tables, nodes, part, index)

    def _fill_part(self, tables: AirTables, nodes: Nodes, part: int, index: int | None) -> None:
        """Fill the rows of a part for one node, or of the transmittance."""
        first, count = part * nodes.part_rows, nodes.part_rows
        radius = nodes.kind.radius
        if index is None:
            values = view_values(radius, nodes.height, 0.0)
            rows = MarchedRows(nodes.transmittance, first, count, inside=nodes.inside, light=False)
            self._march.fill(tables, rows, values)
            nodes.transmitting.add(part)
            return
        slot = index % SLOTS
        nodes.cached[part, slot] = NO_NODE
        angle = _node_angle(index + part / PARTS, nodes.height)
        above = slot * nodes.rows
        values = view_values(radius, nodes.height, angle)
        values |= {"first_row": -above, "view_columns": nodes.light.size[0]}
        rows = MarchedRows(nodes.light, above + first, count, inside=nodes.inside, light=True)
        self._march.fill(tables, rows, values)
        nodes.cached[part, slot] = index

    def release(self) -> None:
        """Free everything."""
        self._nodes.clear()
        self._march.release()


def new_table(ctx: moderngl.Context, rows: int, columns: int) -> ImageTarget:
    """For so many rows and columns of a view."""
    target = ImageTarget(ctx, (columns, rows), (Format("f4", 4),))
    for texture in target.textures:
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
    return target


def height_place(height: float) -> float:
    """Number of steps up to a height [m]; the tables of the nearest serve a view from there."""
    above = log(height / AIR_TOP)
    return above / (_HEIGHT_STEP if above > 0.0 else _STEP_INSIDE)


def _height_of(place: float) -> float:
    """The inverse of ``height_place`` [m]."""
    return AIR_TOP * exp(place * (_HEIGHT_STEP if place > 0.0 else _STEP_INSIDE))


def _closer(height: float) -> tuple[tuple[float, float], ...]:
    """Angles of the Sun from the zenith of a height about which nodes get closer, and by how many
    times their number to a step."""
    # On the horizon the Sun stands lower, or higher, by the angle between both zeniths.
    dip = acos(WGS84_EQUATORIAL_RADIUS / (WGS84_EQUATORIAL_RADIUS + height))
    wide = 1.0 / _WIDE
    return (float(_LOW_SUN) - dip, wide - 1.0 / _WIDER), (float(_NO_DAY) + dip, 1.0 - wide)


def _node_place(angle: float, height: float) -> float:
    """Number of nodes up to an angle of the Sun from the zenith of a height [rad, m]."""
    steps = angle / _WIDER
    for about, more in _closer(height):
        # Of steps from wide to close, the integral of a logistic function.
        past = (angle - about) / _BLEND
        steps += more * _BLEND * (max(past, 0.0) + log1p(exp(-abs(past))))
    return steps / _NODE_STEP


def _node_angle(place: float, height: float) -> float:
    """Angle of the Sun up to which there are so many nodes: the inverse of ``_node_place``."""
    angle = 2.0 * pi
    # Steps get closer as the angle grows, so that Newton's method comes from there without passing
    # the root, until nothing is left of the last steps.
    while True:
        over = _node_place(angle, height) - place
        nearer = angle - over / nodes_per_radian(angle, height)
        if nearer >= angle:
            return angle
        angle = nearer


def nodes_per_radian(angle: float, height: float) -> float:
    """How close nodes are at an angle of the Sun from the zenith of a height [rad, m]."""
    steps = 1.0 / _WIDER
    for about, more in _closer(height):
        steps += more / (1.0 + exp(-(angle - about) / _BLEND))
    return steps / _NODE_STEP


def view_values(radius: float, height: float, angle: float) -> dict[str, object]:
    """The block AIR_VIEW as a table's drawing reads it."""
    outside = height * (2.0 * radius + height) / radius**2
    reach = AIR_TOP * (2.0 * radius + AIR_TOP) / radius**2
    return {
        "camera_up": np.zeros(4),
        "sun_side": np.zeros(4),
        "camera_sun": (np.cos(angle), np.sin(angle)),
        "outside_air": outside,
        "horizon_reach": min(outside, reach),
        "camera_nearness": 1.0 / np.sqrt(1.0 + outside),
        "camera_height": height / 1e3,
        "view_columns": COLUMNS,
        "first_row": 0.0,
    }
