"""What a glossy panel shows of matt surfaces, by paths of light through Embree.

Normals of microfacets are drawn from GGX's distribution itself, and weighed by everything else that
is in the law of reflection: nothing here is simgl's way to follow lobes.
"""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.radiosity.gather_points import LIFT, face_normals
from simgl.radiosity.hemisphere import frames
from simgl.rays import RayTracer
from simgl.scene.materials import Material
from simgl.scene.state import CameraState, SceneState

_BOUNCES = 6
_AT_ONCE = 400_000


class GlossyPaths:
    """A body at rest at the origin, of flat faces, whose first material alone is glossy.

    Sunlight on glossy faces is left out: that of their own is no part of the light from others.
    """

    def __init__(self, state: SceneState) -> None:
        (body,) = state.bodies.values()
        assert not np.any(body.pose.position)
        np.testing.assert_array_equal(body.pose.R_icrf_from_body, np.eye(3))
        mesh = body.model.mesh
        self._tracer = RayTracer(mesh)
        self._faces = face_normals(mesh)[0]
        self._worn = mesh.material[mesh.triangles[:, 0]]
        self._materials = body.model.materials
        self._matt = np.array([m.reflectance for m in self._materials])
        self._sun = state.sun.seen_from(np.zeros(3))
        self._lift = LIFT * mesh.radius

    def light(
        self, camera: CameraState, pixels: IndexArray, paths: int, rng: np.random.Generator
    ) -> Array:
        """(n, 4) mean radiance over pixels (n, 2), column and row, by so many paths of each.

        Only where the first surface is glossy; 0 of other paths.
        """
        light = np.empty((len(pixels), 4))
        step = max(_AT_ONCE // paths, 1)
        for start in range(0, len(pixels), step):
            part = np.repeat(pixels[start : start + step], paths, axis=0)
            ways = camera.camera.rays(part + rng.random(part.shape)) @ camera.R_camera_from_icrf
            ways /= np.linalg.norm(ways, axis=1, keepdims=True)
            origins = np.broadcast_to(camera.position, ways.shape)
            traced = self._along(origins, ways, rng).reshape(-1, paths, 4)
            light[start : start + step] = traced.mean(axis=1)
        return light

    def _along(self, origins: Array, ways: Array, rng: np.random.Generator) -> Array:
        light, through = np.zeros((len(ways), 4)), np.ones((len(ways), 4))
        alive = np.arange(len(ways))
        for bounce in range(_BOUNCES):
            hit, distance = self._tracer.hits(origins, ways)
            met = np.flatnonzero(hit >= 0)
            triangle = hit[met].astype(np.int64)
            normals, worn = self._faces[triangle], self._worn[triangle]
            ways = ways[met]
            places = origins[met] + distance[met, None] * ways + self._lift * normals
            alive, through = alive[met], through[met]
            outside = np.einsum("ij,ij->i", normals, ways) < 0.0
            keep = outside & (worn == 0) if bounce == 0 else outside
            alive, through, ways = alive[keep], through[keep], ways[keep]
            normals, worn, places = normals[keep], worn[keep], places[keep]
            matt = worn != 0
            albedo = self._matt[worn[matt]]
            sunlight = self._sunlight(places[matt], normals[matt], rng)
            light[alive[matt]] += through[matt] * albedo / np.pi * sunlight
            new = np.empty_like(ways)
            new[matt] = _cosine(normals[matt], rng)
            through[matt] *= albedo
            new[~matt], weight = _glossy(self._materials[0], normals[~matt], -ways[~matt], rng)
            through[~matt] *= weight
            origins, ways = places, new
        return light

    def _sunlight(self, places: Array, normals: Array, rng: np.random.Generator) -> Array:
        """(n, 4) irradiance by one place of the disc each [W m-2]."""
        pairs = rng.random((len(places), 2))
        radius = np.sin(self._sun.angular_radius) * np.sqrt(pairs[:, 0])
        turn = 2.0 * np.pi * pairs[:, 1]
        local = [radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - radius**2)]
        towards = np.stack(local, axis=1) @ frames(self._sun.direction_icrf[None])[0].T
        cosine = np.maximum(np.einsum("ij,ij->i", normals, towards), 0.0)
        cosine[self._tracer.occluded(places, towards)] = 0.0
        return np.asarray(cosine[:, None] * self._sun.irradiance)


def _cosine(normals: Array, rng: np.random.Generator) -> Array:
    pairs = rng.random((len(normals), 2))
    radius, turn = np.sqrt(pairs[:, 0]), 2.0 * np.pi * pairs[:, 1]
    z = np.sqrt(1.0 - pairs[:, 0])
    local = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    return np.einsum("nij,nj->ni", frames(normals), local)


def _glossy(
    material: Material, normals: Array, wo: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """(n, 3) directions of the light, and (n, 4) its reflectance over the density of these.

    Half vectors by D NoH (Walter et al. 2007, eq. 35): weights F G2 VoH / (NoV NoH), with the
    height-correlated masking of Heitz 2014.
    """
    assert material.roughness is not None
    alpha2 = material.roughness**4
    pairs = rng.random((len(normals), 2))
    tangent2 = alpha2 * pairs[:, 0] / (1.0 - pairs[:, 0])
    NoH, turn = 1.0 / np.sqrt(1.0 + tangent2), 2.0 * np.pi * pairs[:, 1]
    sine = np.sqrt(1.0 - NoH**2)
    local = np.stack([sine * np.cos(turn), sine * np.sin(turn), NoH], axis=1)
    h = np.einsum("nij,nj->ni", frames(normals), local)
    VoH, NoV = np.einsum("ij,ij->i", wo, h), np.einsum("ij,ij->i", wo, normals)
    wi = 2.0 * VoH[:, None] * h - wo
    NoL = np.einsum("ij,ij->i", wi, normals)
    valid = (NoL > 0.0) & (VoH > 0.0)
    masks = [np.sqrt(1.0 + alpha2 * (1.0 / np.maximum(c, 1e-9) ** 2 - 1.0)) for c in (NoV, NoL)]
    f0 = 0.04 + material.metallic * (np.asarray(material.reflectance) - 0.04)
    fresnel = f0 + (1.0 - f0) * (1.0 - np.clip(VoH, 0.0, 1.0)[:, None]) ** 5
    weight = np.where(valid, 2.0 / (masks[0] + masks[1]) * VoH / (NoV * NoH), 0.0)
    return wi, fresnel * weight[:, None]
