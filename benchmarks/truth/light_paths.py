"""Radiance that leaves Lambertian spacecraft towards a camera, by paths of light through Embree.

Unbiased: every surface that a path meets is lit by a place of the Sun's disc of its own, and paths
end by Russian roulette. It shares with simgl the ray tracer and the laws of light, no part of the
radiosity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.gather_points import LIFT, face_normals
from simgl.radiosity.hemisphere import frames
from simgl.radiosity.solver import material_light
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh
from simgl.scene.state import CameraState, SceneState

# Paths that are traced together.
_AT_ONCE = 400_000
# Bounces from which on paths end by chance.
_ROULETTE = 3
# Of a path's numbers: place in the pixel, on the Sun's disc, direction of the first bounce.
_DIMENSIONS = 6
PARTS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class PixelLight:
    """Radiance of some pixels.

    radiance, error : (n, 4) mean over the pixel and its standard error [W m-2 sr-1]
    coverage : (n,) share of the pixel that shows a spacecraft
    direct : (n,) share of the radiance that the Sun's light gives at its first surface
    """

    radiance: Array
    error: Array
    coverage: Array
    direct: Array


class LightPaths:
    """The bodies, the Sun and the Earth of a scene, about its first body."""

    def __init__(self, state: SceneState) -> None:
        bodies = list(state.bodies.values())
        self._origin = bodies[0].pose.position
        self._sun = state.sun.seen_from(self._origin)
        self._earth = state.earth
        positions, normals, triangles, albedo, glow, sides = [], [], [], [], [], []
        start = 0
        for body in bodies:
            mesh, R = body.model.posed_mesh.baked(), body.pose.R_icrf_from_body
            offset = body.pose.position - self._origin
            positions.append(mesh.positions.astype(np.float64) @ R.T + offset)
            normals.append(mesh.normals.astype(np.float64) @ R.T)
            triangles.append(mesh.triangles.astype(np.int64) + start)
            start += len(mesh.positions)
            worn = mesh.material[mesh.triangles[:, 0]]
            of_material = material_light(body.model.materials)
            albedo.append(of_material[0][worn])
            glow.append(of_material[1][worn])
            sides.append(np.full(len(mesh.triangles), 2 if body.model.open_sheets else 1))
        corners = np.concatenate(triangles)
        label = np.zeros(start, dtype=np.uint32)
        self._mesh = Mesh(
            positions=np.concatenate(positions).astype(np.float32),
            normals=np.concatenate(normals).astype(np.float32),
            triangles=corners.astype(np.uint32),
            part=label,
            material=label,
        )
        self._corners = self._mesh.positions[corners].astype(np.float64)
        self._normals = self._mesh.normals[corners].astype(np.float64)
        self._faces = face_normals(self._mesh)[0]
        self._albedo, self._glow = np.concatenate(albedo), np.concatenate(glow)
        self._sides = np.concatenate(sides)
        self._tracer = RayTracer(self._mesh)
        self._lift = LIFT * bodies[0].model.mesh.radius

    def seen(self, camera: CameraState) -> Array32:
        """(height, width) share of five rays of each pixel that meet a body."""
        detector = camera.camera.detector
        rows, columns = np.mgrid[0 : detector.height, 0 : detector.width]
        pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float64)
        met = np.zeros(len(pixels), dtype=np.float32)
        for offset in ((0.5, 0.5), (0.1, 0.3), (0.7, 0.1), (0.9, 0.7), (0.3, 0.9)):
            origins, ways = self._rays(camera, pixels + offset)
            met += self._tracer.hits(origins, ways)[0] >= 0
        return (met / 5.0).reshape(rows.shape)

    def light(
        self, camera: CameraState, pixels: IndexArray, paths: int, rng: np.random.Generator
    ) -> PixelLight:
        """Of pixels (n, 2), column and row, by so many paths of each."""
        count, each = len(pixels), paths // PARTS
        sums, squares = np.zeros((count, 4)), np.zeros((count, 4))
        covered, direct = np.zeros(count), np.zeros(count)
        step = max(_AT_ONCE // each, 1)
        for _ in range(PARTS):
            mean = np.zeros((count, 4))
            for start in range(0, count, step):
                part = slice(start, start + step)
                light, first, met = self._part(camera, pixels[part], each, rng)
                mean[part] = light.mean(axis=1)
                direct[part] += first.mean(axis=(1, 2)) / PARTS
                covered[part] += met.mean(axis=1) / PARTS
            sums += mean
            squares += mean**2
        radiance = sums / PARTS
        variance = np.maximum(squares / PARTS - radiance**2, 0.0) / (PARTS - 1)
        total = np.maximum(radiance.mean(axis=1), 1e-30)
        return PixelLight(
            radiance=radiance, error=np.sqrt(variance), coverage=covered, direct=direct / total
        )

    def _part(
        self, camera: CameraState, pixels: IndexArray, each: int, rng: np.random.Generator
    ) -> tuple[Array, Array, Mask]:
        """(n, each, 4) radiance of paths, that of sunlight at their first surface, and (n, each)
        whether they meet a body."""
        # The additive sequence of the root of x^7 = x + 1 (Roberts 2018), shifted by pixel.
        root = 1.0
        for _ in range(40):
            root = (1.0 + root) ** (1.0 / (_DIMENSIONS + 1.0))
        steps = root ** -np.arange(1.0, _DIMENSIONS + 1.0)
        shift = rng.random((len(pixels), 1, _DIMENSIONS))
        even = ((shift + np.arange(each)[:, None] * steps) % 1.0).reshape(-1, _DIMENSIONS)
        origins, ways = self._rays(camera, np.repeat(pixels, each, axis=0) + even[:, :2])
        light, first = np.zeros((len(ways), 4)), np.zeros((len(ways), 4))
        through = np.ones((len(ways), 4))
        alive = np.arange(len(ways))
        met = np.zeros(len(ways), dtype=np.bool_)
        bounce = 0
        while len(alive) > 0:
            first_met, distance = self._tracer.hits(origins, ways)
            triangle = first_met.astype(np.int64)
            missed = triangle < 0
            light[alive[missed]] += through[missed] * self._background(ways[missed])
            if bounce == 0:
                met[~missed] = True
            hit = np.flatnonzero(~missed)
            alive, through, triangle = alive[hit], through[hit], triangle[hit]
            places = origins[hit] + distance[hit, None] * ways[hit]
            faces, normals, front = self._normals_at(triangle, places, ways[hit])
            alive, through, triangle = alive[front], through[front], triangle[front]
            places, faces, normals = places[front], faces[front], normals[front]
            light[alive] += through * self._glow[triangle] / np.pi
            through = through * self._albedo[triangle]
            pairs = even[alive, 2:4] if bounce == 0 else rng.random((len(alive), 2))
            places = places + self._lift * faces
            sun = through * self._sunlight(places, normals, faces, pairs) / np.pi
            light[alive] += sun
            if bounce == 0:
                first[alive] = sun
            if bounce >= _ROULETTE:
                stays = np.clip(through.max(axis=1), 0.05, 1.0)
                on = rng.random(len(alive)) < stays
                through = through[on] / stays[on, None]
                alive, places, normals, faces = alive[on], places[on], normals[on], faces[on]
            pairs = even[alive, 4:6] if bounce == 0 else rng.random((len(alive), 2))
            ways = _about(normals, pairs)
            above = np.einsum("ij,ij->i", ways, faces) > 0.0
            alive, through, origins, ways = alive[above], through[above], places[above], ways[above]
            bounce += 1
        shape = (len(pixels), each)
        return light.reshape(*shape, 4), first.reshape(*shape, 4), met.reshape(shape)

    def _rays(self, camera: CameraState, at: Array) -> tuple[Array, Array]:
        ways = camera.camera.rays(at) @ camera.R_camera_from_icrf
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        return np.broadcast_to(camera.position - self._origin, ways.shape), ways

    def _normals_at(
        self, triangle: IndexArray, places: Array, ways: Array
    ) -> tuple[Array, Array, Mask]:
        """Of the triangle and of the shading, towards the ray, and whether there is a surface."""
        a, b, c = np.moveaxis(self._corners[triangle], 1, 0)
        faces = self._faces[triangle]
        cross = np.cross(b - a, c - a)
        twice = np.maximum(np.einsum("ij,ij->i", cross, cross), 1e-30)
        v = np.einsum("ij,ij->i", np.cross(places - a, c - a), cross) / twice
        w = np.einsum("ij,ij->i", np.cross(b - a, places - a), cross) / twice
        weights = np.clip(np.stack([1.0 - v - w, v, w], axis=1), 0.0, 1.0)
        normals = np.einsum("ik,ikj->ij", weights, self._normals[triangle])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        behind = np.einsum("ij,ij->i", faces, ways) > 0.0
        turn = np.where(behind, -1.0, 1.0)[:, None]
        return faces * turn, normals * turn, ~behind | (self._sides[triangle] == 2)

    def _sunlight(self, places: Array, normals: Array, faces: Array, pairs: Array) -> Array:
        """(n, 4) irradiance by one place of the disc each [W m-2]."""
        radius = np.sin(self._sun.angular_radius) * np.sqrt(pairs[:, :1])
        turn = 2.0 * np.pi * pairs[:, 1:]
        frame = frames(self._sun.direction_icrf[None])[0]
        local = np.concatenate(
            [radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - radius**2)], axis=1
        )
        towards = local @ frame.T
        cosine = np.einsum("ij,ij->i", normals, towards)
        lit = np.flatnonzero((cosine > 0.0) & (np.einsum("ij,ij->i", faces, towards) > 0.0))
        lit = lit[~self._tracer.occluded(places[lit], towards[lit])]
        light = np.zeros((len(places), 4))
        light[lit] = cosine[lit, None] * self._sun.irradiance
        return light

    def _background(self, ways: Array) -> Array:
        """(n, 4) radiance of the Earth along rays that meet no body [W m-2 sr-1]."""
        light = np.zeros((len(ways), 4))
        if self._earth is None:
            return light
        earth = self._earth.earth
        assert earth.albedo is not None
        assert earth.equatorial_radius == earth.polar_radius
        centre = self._earth.position - self._origin
        along = ways @ centre
        inside = along**2 - (centre @ centre - earth.equatorial_radius**2)
        seen = np.flatnonzero((along > 0.0) & (inside > 0.0))
        places = (along[seen] - np.sqrt(inside[seen]))[:, None] * ways[seen] - centre
        cosine = np.maximum(places @ self._sun.direction_icrf / earth.equatorial_radius, 0.0)
        light[seen] = cosine[:, None] * np.asarray(earth.albedo) * self._sun.irradiance / np.pi
        return light


def _about(normals: Array, pairs: Array) -> Array:
    """(n, 3) one direction about each normal by the cosine, from two even numbers each."""
    radius, turn = np.sqrt(pairs[:, 0]), 2.0 * np.pi * pairs[:, 1]
    z = np.sqrt(1.0 - pairs[:, 0])
    local = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    return np.einsum("nij,nj->ni", frames(normals), local)
