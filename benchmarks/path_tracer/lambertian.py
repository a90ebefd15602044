"""Scenes that mean the same to both renderers to the letter: Lambertian facets.

A smooth normal on a flat triangle describes no surface: where it faces the Sun and the triangle
does not, each renderer has its own way out. Normals of the triangles themselves leave none.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.means import mean_materials
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.textures import SurfaceTextures
from simgl.transport.sites import face_normals
from simgl.transport.solve import hemispherical_albedo


def lambertian_scenario(path: Path) -> Scenario:
    """A scenario of facets, every material replaced by a Lambertian one of its reflectance."""
    scenario = load_scenario(path)
    models = {name: _lambertian(model) for name, model in scenario.models.items()}
    return replace(scenario, models=models)


def _lambertian(model: SpacecraftModel) -> SpacecraftModel:
    materials = tuple(_plain(m) for m in mean_materials(model))
    mesh = faceted(replace(model.mesh, uv=None, colour=None))
    return replace(model, mesh=mesh, materials=materials, textures=SurfaceTextures())


def faceted(mesh: Mesh) -> Mesh:
    """The same triangles with their own normals; corners of one plane stay one vertex."""
    triangles = mesh.triangles.ravel().astype(np.int64)
    normals = np.repeat(face_normals(mesh)[0], 3, axis=0).astype(np.float32)
    # float32 corners turn a plane's triangles against each other by some 1e-5.
    plane = np.round(normals * 1e4).astype(np.int64)
    _, first, corner = np.unique(
        np.column_stack([triangles, plane]), axis=0, return_index=True, return_inverse=True
    )
    chosen = triangles[first]
    return replace(
        mesh,
        positions=mesh.positions[chosen],
        normals=normals[first],
        triangles=corner.reshape(-1, 3).astype(np.uint32),
        part=mesh.part[chosen],
        material=mesh.material[chosen],
        joint=None if mesh.joint is None else mesh.joint[chosen],
    )


def _plain(material: Material) -> Material:
    r, g, b, n = (float(v) for v in hemispherical_albedo(material))
    return Material(name=material.name, reflectance=(r, g, b, n), emission=material.emission)
