"""Scenes whose surfaces are all Lambertian: the law that both renderers share to the letter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from simgl.radiosity.reflection_laws import hemispherical_albedo
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.mean_materials import mean_materials
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.textures import SurfaceTextures


def lambertian_scenario(path: Path) -> Scenario:
    """A scenario with every material replaced by a Lambertian one of the same reflectance."""
    return as_lambertian(load_scenario(path))


def as_lambertian(scenario: Scenario) -> Scenario:
    """The same of a scenario that is loaded."""
    models = {name: _lambertian(model) for name, model in scenario.models.items()}
    return replace(scenario, models=models)


def _lambertian(model: SpacecraftModel) -> SpacecraftModel:
    materials = tuple(_plain(m) for m in mean_materials(model))
    mesh = replace(model.mesh, uv=None, colour=None)
    return replace(model, mesh=mesh, materials=materials, textures=SurfaceTextures())


def _plain(material: Material) -> Material:
    r, g, b, n = (float(v) for v in hemispherical_albedo(material))
    return Material(name=material.name, reflectance=(r, g, b, n), emission=material.emission)
