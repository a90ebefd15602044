"""Light of other surfaces at single points, by rays: the slow, exact reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask, UIntArray
from simgl.environment_map import cube_directions, cube_solid_angles
from simgl.radiosity.gather_points import LIFT, face_normals
from simgl.radiosity.hemisphere import frames, sky_cell
from simgl.radiosity.reflection_laws import ReflectionLaws
from simgl.rays import AnyRayTracer, ray_tracer
from simgl.scene.mesh import Mesh, cached_with_mesh
from simgl.scene.posed_mesh import PosedMesh

# Cells along an edge of each face of the sky's cube.
SKY_ACROSS = 16
# Where nothing is solved for a body, light that met surfaces so many times before is left out.
_MAX_BOUNCES = 5
# Lobes that send sunlight on are this wide at least, as rays of a point lie apart; and cosines to
# the ray are at least this.
_MIN_WIDTH, _MIN_COSINE = 0.1, np.float32(1e-3)
# Rays that are traced together, some 200 bytes each.
_AT_ONCE = 400_000


@dataclass(frozen=True, kw_only=True, eq=False)
class LitBody:
    """A spacecraft as rays meet it, in its own axes.

    body_from_viewer : (4, 4) float32 to its axes from those of the body that is looked from
    sides : 2 where surfaces are lit and seen from both
    albedo, exitance : (k, 4) of its materials, what they give off by themselves [W m-2]
    laws : by which they reflect sunlight
    sun_direction : (3,) unit, own axes; sun_irradiance : (4,) [W m-2]
    solved : (m * sides, 4) exitance of each triangle's front, then of each one's back, but for the
        Sun's light that comes straight there; None where rays have to go on [W m-2]
    """

    mesh: PosedMesh
    body_from_viewer: Array32
    sides: int
    albedo: Array32
    exitance: Array32
    laws: ReflectionLaws
    sun_direction: Array32
    sun_irradiance: Array32
    solved: Array32 | None

    @cached_property
    def tracer(self) -> AnyRayTracer:
        """For rays in its own axes."""
        return ray_tracer(self.mesh)

    @cached_property
    def faces(self) -> Array32:
        """(m, 3) unit normals of the triangles."""
        return self.mesh.of_triangles(_stored_faces(self.mesh.mesh, None)).astype(np.float32)

    @cached_property
    def worn(self) -> UIntArray:
        """(m,) material of the triangles."""
        mesh = self.mesh.mesh
        return mesh.material[mesh.triangles[:, 0]]

    @cached_property
    def is_viewer(self) -> bool:
        """Whether it is the body that is looked from."""
        return bool(np.array_equal(self.body_from_viewer, np.eye(4)))

    def places(self, here: Array32) -> Array32:
        """(n, 3) places [m] in its axes."""
        if self.is_viewer:
            return here
        return here @ self.body_from_viewer[:3, :3].T + self.body_from_viewer[:3, 3]

    def directions(self, here: Array32) -> Array32:
        """(n, 3) directions in its axes."""
        return here if self.is_viewer else here @ self.body_from_viewer[:3, :3].T

    def near(self, places: Array32, directions: Array32) -> IndexArray:
        """Which rays, in the viewer's axes, may meet it: lines through its bounding sphere."""
        if self.is_viewer:
            return np.arange(len(places))
        R, shift = self.body_from_viewer[:3, :3], self.body_from_viewer[:3, 3]
        offset = places - (self.mesh.centre.astype(np.float32) - shift) @ R
        along = np.einsum("ij,ij->i", offset, directions)
        past = np.einsum("ij,ij->i", offset, offset) - along * along
        ahead = along < np.float32(self.mesh.radius)
        return np.flatnonzero((past < np.float32(self.mesh.radius**2)) & ahead)


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Points of a body that an image shows, in its axes.

    places : (n, 3) [m]; normals, facets : (n, 3) unit, towards the viewer, of the shading and of
        the triangles
    spread : (n, 2) numbers 0..1, even among neighbours in the image
    """

    places: Array32
    normals: Array32
    facets: Array32
    spread: Array

    def of(self, chosen: IndexArray) -> Points:
        """Some of them."""
        return Points(
            places=self.places[chosen],
            normals=self.normals[chosen],
            facets=self.facets[chosen],
            spread=self.spread[chosen],
        )


@cached_with_mesh
def _stored_faces(mesh: Mesh, _: None) -> Array32:
    return face_normals(mesh)[0].astype(np.float32)


def gathered(
    points: Points, bodies: Sequence[LitBody], sky: Array32 | None, rays: int
) -> tuple[Array32, Array32]:
    """What points get: (n, 4) irradiance of all surfaces [W m-2], and (n,) the share of the sky's.

    bodies : the points' own first, then those around
    sky : (6 n^2, 4) mean radiance of its cells in the first body's axes [W m-2 sr-1]
    rays : of each point, their density following the cosine
    """
    count = len(points.places)
    irradiance = np.zeros((count, 4), dtype=np.float32)
    share = np.ones(count, dtype=np.float32)
    step = max(1, _AT_ONCE // rays)
    for start in range(0, count, step):
        part = slice(start, start + step)
        irradiance[part], share[part] = _gathered(points, part, bodies, sky, rays)
    return irradiance, share


def sunlight(points: Points, bodies: Sequence[LitBody]) -> Array32:
    """(n,) irradiance of points by the Sun's centre, bands together [W m-2]."""
    body = bodies[0]
    cosine = np.maximum(points.normals @ body.sun_direction, 0.0).astype(np.float32)
    lit = np.flatnonzero(cosine > 0.0)
    lift = np.float32(LIFT * body.mesh.radius)
    shaded = _shaded(points.places[lit] + lift * points.facets[lit], bodies)
    cosine[lit[shaded]] = 0.0
    return cosine * body.sun_irradiance.sum(dtype=np.float32)


def _gathered(
    points: Points, part: slice, bodies: Sequence[LitBody], sky: Array32 | None, rays: int
) -> tuple[Array32, Array32]:
    normals = points.normals[part]
    count = len(normals)
    k = np.arange(rays)
    u = (points.spread[part, None, 0] + k * 0.7548776662466927) % 1.0
    v = (points.spread[part, None, 1] + k * 0.5698402909980532) % 1.0
    directions = _about(normals, u, v).reshape(-1, 3)
    lift = np.float32(LIFT * bodies[0].mesh.radius)
    origins = np.repeat(points.places[part] + lift * points.facets[part], rays, axis=0)
    light, open_ = _light_along(origins, directions, bodies, sky)
    scale = np.float32(np.pi / rays)
    irradiance = scale * light.reshape(count, rays, 4).sum(axis=1)
    if sky is None:
        return irradiance, np.ones(count, dtype=np.float32)
    if np.all(open_):
        return irradiance, np.ones(count, dtype=np.float32)
    before = sky.mean(axis=1)[_cell(directions, sky)].reshape(count, rays)
    seen = scale * np.where(open_.reshape(count, rays), before, 0.0).sum(axis=1)
    free = np.maximum(_free_irradiance(normals, sky), np.float32(0.01 * np.pi * before.max()))
    # With few rays a share may pass 1; its mean over a pixel is what counts. Where a surface gets
    # less than a hundredth of the brightest sky's light, some of it is lost.
    return irradiance, (seen / np.maximum(free, np.float32(1e-30))).astype(np.float32)


def _free_irradiance(normals: Array32, sky: Array32) -> Array32:
    """(n,) of a free surface by the sky, mean of the bands [W m-2]."""
    across = round((len(sky) / 6) ** 0.5)
    flux = sky.mean(axis=1) * np.tile(cube_solid_angles(across).ravel(), 6)
    towards = cube_directions(across).reshape(-1, 3).astype(np.float32)
    rounded, row = np.unique(np.round(normals * 512.0), axis=0, return_inverse=True)
    free = np.empty(len(rounded), dtype=np.float32)
    for start in range(0, len(rounded), 4096):
        part = slice(start, start + 4096)
        unit = rounded[part] / np.linalg.norm(rounded[part], axis=1, keepdims=True)
        free[part] = np.maximum(unit @ towards.T, 0.0) @ flux
    return free[row.ravel()]


def _about(normals: Array32, u: Array, v: Array) -> Array32:
    """(n, k, 3) directions about normals (n, 3) by the cosine, from even numbers u, v (n, k)."""
    radius, turn = np.sqrt(u), 2.0 * np.pi * v
    z = np.sqrt(np.maximum(1.0 - u, 0.0))
    local = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1)
    turned = np.matmul(local, np.swapaxes(frames(normals.astype(np.float64)), 1, 2))
    return np.asarray(turned, dtype=np.float32)


def _cell(directions: Array32, sky: Array32) -> IndexArray:
    return sky_cell(directions.astype(np.float64), round((len(sky) / 6) ** 0.5))


def _light_along(
    origins: Array32, directions: Array32, bodies: Sequence[LitBody], sky: Array32 | None
) -> tuple[Array32, Mask]:
    """(n, 4) radiance of the surfaces that rays meet [W m-2 sr-1], and (n,) whether they meet none.

    Where a body is solved a path ends; elsewhere it goes on in one direction after the cosine.
    """
    light = np.zeros((len(origins), 4), dtype=np.float32)
    through = np.ones((len(origins), 4), dtype=np.float32)
    alive = np.arange(len(origins))
    free = np.zeros(len(origins), dtype=np.bool_)
    for bounce in range(_MAX_BOUNCES):
        body, triangle, distance = first_met(origins, directions, bodies)
        missed = body < 0
        if bounce == 0:
            free[missed] = True
        elif sky is not None:
            light[alive[missed]] += through[missed] * sky[_cell(directions[missed], sky)]
        met = np.flatnonzero(~missed)
        places = origins[met] + distance[met, None] * directions[met]
        radiance, goes_on, albedo, normals = leaving(
            places, directions[met], body[met], triangle[met], bodies
        )
        light[alive[met]] += through[met] * radiance
        on = np.flatnonzero(goes_on)
        if len(on) == 0:
            break
        alive = alive[met[on]]
        through = through[met[on]] * albedo[on]
        lift = np.float32(LIFT * bodies[0].mesh.radius)
        origins = places[on] + lift * normals[on]
        directions = _about(normals[on], *_random(alive, bounce))[:, 0]
    return light, free


def _random(index: IndexArray, stream: int) -> tuple[Array, Array]:
    """Two numbers (n, 1) in 0..1 for each index (a multiplicative hash; Steele et al. 2014)."""
    words = (index.astype(np.uint64) * np.uint64(8) + np.uint64(stream + 1)) * np.uint64(
        0x9E3779B97F4A7C15
    )
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        words = (words ^ (words >> np.uint64(shift))) * np.uint64(factor)
    words ^= words >> np.uint64(31)
    low = (words & np.uint64(0xFFFFFFFF)).astype(np.float64)
    high = (words >> np.uint64(32)).astype(np.float64)
    return (low[:, None] + 0.5) / 2.0**32, (high[:, None] + 0.5) / 2.0**32


def first_met(
    origins: Array32, directions: Array32, bodies: Sequence[LitBody]
) -> tuple[IndexArray, IndexArray, Array32]:
    """What rays meet first: (n,) the body, -1 for none, its triangle, and the distance [m]."""
    count = len(origins)
    body = np.full(count, -1)
    triangle = np.zeros(count, dtype=np.int64)
    distance = np.full(count, np.inf, dtype=np.float32)
    for number, one in enumerate(bodies):
        near = one.near(origins, directions)
        if not len(near):
            continue
        hit, reach = one.tracer.hits(one.places(origins[near]), one.directions(directions[near]))
        first = np.flatnonzero((hit >= 0) & (reach < distance[near]))
        body[near[first]] = number
        triangle[near[first]] = hit[first]
        distance[near[first]] = reach[first]
    return body, triangle, distance


def leaving(
    places: Array32,
    directions: Array32,
    body: IndexArray,
    triangle: IndexArray,
    bodies: Sequence[LitBody],
) -> tuple[Array32, Mask, Array32, Array32]:
    """What surfaces send against rays (n, 4) [W m-2 sr-1], where paths go on, albedo, normals."""
    radiance = np.zeros((len(places), 4), dtype=np.float32)
    albedo = np.zeros((len(places), 4), dtype=np.float32)
    normals = np.zeros((len(places), 3), dtype=np.float32)
    goes_on = np.zeros(len(places), dtype=np.bool_)
    cosine, law = np.zeros(len(places), dtype=np.float32), np.zeros(len(places), dtype=np.int64)
    for number, one in enumerate(bodies):
        at = np.flatnonzero(body == number)
        n = one.faces[triangle[at]]
        behind = np.einsum("ij,ij->i", n, one.directions(directions[at])) > 0.0
        if one.sides == 1:
            # From within a closed body nothing comes.
            at, n, behind = at[~behind], n[~behind], behind[~behind]
        n = np.where(behind[:, None], -n, n)
        worn = one.worn[triangle[at]]
        albedo[at], law[at] = one.albedo[worn], worn
        normals[at] = n @ one.body_from_viewer[:3, :3]
        cosine[at] = n @ one.sun_direction
        if one.solved is None:
            radiance[at] = one.exitance[worn]
            goes_on[at] = True
        else:
            radiance[at] = one.solved[triangle[at] + len(one.worn) * behind]
    lift = np.float32(LIFT * bodies[0].mesh.radius)
    lit = np.flatnonzero(cosine > 0.0)
    lit = lit[~_shaded(places[lit] + lift * normals[lit], bodies)]
    sun = bodies[0].sun_direction
    for number, one in enumerate(bodies):
        at = lit[body[lit] == number]
        viewer = np.maximum(-np.einsum("ij,ij->i", normals[at], directions[at]), _MIN_COSINE)
        share = one.laws.towards(law[at], cosine[at], viewer, -directions[at] @ sun, _MIN_WIDTH)
        radiance[at] += share * one.sun_irradiance * cosine[at, None]
    return radiance / np.float32(np.pi), goes_on, albedo, normals


def _shaded(places: Array32, bodies: Sequence[LitBody]) -> Mask:
    """Whether anything stands between places and the Sun's centre."""
    shaded = np.zeros(len(places), dtype=np.bool_)
    direction = bodies[0].sun_direction
    for one in bodies:
        rest = np.flatnonzero(~shaded)
        near = one.near(places[rest], np.broadcast_to(direction, (len(rest), 3)))
        origins = one.places(places[rest[near]])
        rays = np.broadcast_to(one.sun_direction, origins.shape)
        shaded[rest[near]] = one.tracer.occluded(origins, rays)
    return shaded
