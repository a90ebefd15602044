"""What a thermal camera sees of a scene: values at vertices, the Earth's climate, Planck's law.

The passes draw it (simgl/passes/thermal.py, simgl/passes/background/infrared_earth.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.infrared_detector import InfraredDetector
from simgl.physics.earth_infrared import Emission
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import SceneState
from simgl.thermal.between_bodies import Neighbours, neighbours, reflected_between
from simgl.thermal.body import ThermalBody
from simgl.thermal.history import ThermalState
from simgl.thermal.infrared_surroundings import (
    InfraredSurroundings,
    sunlight_in_band,
    surroundings_in_band,
)
from simgl.thermal.scene_temperatures import history_of, name_of
from simgl.thermal.sky_light import SkyLight, light_of_sky

# Light goes on between patches until a reflection adds less than this share of the brightest one.
_DARK = 1e-5

Bodies = Mapping[str, tuple[ThermalBody, ThermalState]]


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalLight:
    """A body in the thermal infrared.

    mesh : as it is drawn
    values : (vertices, sides, 4) float32: temperature [K], hemispherical emissivity, and the mean
        radiance that is reflected, in W and as the detector counts
    """

    mesh: PosedMesh
    values: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalView:
    """All that a thermal frame takes besides the camera's view.

    lights : by spacecraft
    digest : of the thermal states of all spacecraft
    history : how these came about
    """

    lights: Mapping[str, ThermalLight]
    surroundings: InfraredSurroundings
    digest: str
    history: str


def thermal_view(
    state: SceneState,
    detector: InfraredDetector,
    bodies: Bodies,
    skies: Mapping[str, SkyLight],
) -> ThermalView:
    """A scene in the band of a detector.

    bodies : every spacecraft with its temperatures
    skies : what each has around it in the band (``Skies.in_band``)

    A patch sends emissivity times Planck's law, and reflects diffusely what the Earth, the Sun, and
    other patches of its body and of bodies near it send in the band. Temperatures are means at the
    corners of triangles of one part and material, and go over from one to the next.
    """
    return ThermalView(
        lights=_lights(state, bodies, skies, detector),
        surroundings=surroundings_in_band(state, detector),
        digest=name_of({name: of for name, (_, of) in bodies.items()}),
        history=history_of({name: of for name, (_, of) in bodies.items()}),
    )


def posed_as(scene: ThermalView, state: SceneState) -> ThermalView:
    """The same temperatures and light with the joints of a state some milliseconds away."""

    def posed(name: str, light: ThermalLight) -> ThermalLight:
        now = state.bodies[name].model.posed_mesh
        mesh = PosedMesh(mesh=light.mesh.mesh, joints=now.joints, motion=now.motion)
        return replace(light, mesh=mesh)

    return replace(scene, lights={name: posed(name, one) for name, one in scene.lights.items()})


def _lights(
    state: SceneState, bodies: Bodies, skies: Mapping[str, SkyLight], detector: InfraredDetector
) -> dict[str, ThermalLight]:
    """Every body, with what it reflects of the others near it."""
    near = neighbours({name: body for name, (body, _) in bodies.items()}, state)
    no_neighbours = Neighbours(factors={}, hidden={})
    lights: dict[str, ThermalLight] = {}
    for name in bodies.keys() - near.hidden.keys():
        lights |= _reflected(state, {name: bodies[name]}, skies, no_neighbours, detector)
    if near.hidden:
        together = {name: bodies[name] for name in near.hidden}
        lights |= _reflected(state, together, skies, near, detector)
    return {name: lights[name] for name in bodies}


def _reflected(
    state: SceneState,
    bodies: Bodies,
    skies: Mapping[str, SkyLight],
    near: Neighbours,
    detector: InfraredDetector,
) -> dict[str, ThermalLight]:
    # A bolometer counts watts.
    emissions: list[Emission] = [detector.watts]
    if detector.table.kind == "photon":
        emissions.append(detector.emission)
    outside = {
        name: light_of_sky(body, state, skies[name], near.hidden.get(name)).T
        for name, (body, _) in bodies.items()
    }
    reflected = []
    for number, emission in enumerate(emissions):
        sent = {
            name: np.pi * body.emissivity * emission(of.temperatures[: body.patch_count])
            for name, (body, of) in bodies.items()
        }
        others = near.received(sent)
        first = {
            name: outside[name][number]
            + of.sunlight * sunlight_in_band(detector)[number]
            + body.views.factors @ sent[name]
            + others.get(name, 0.0)
            for name, (body, of) in bodies.items()
        }
        meshes = {name: body for name, (body, _) in bodies.items()}
        rho = {name: 1.0 - body.emissivity for name, body in meshes.items()}
        reflected.append(reflected_between(meshes, near, first, rho, _DARK))
    return {
        name: _at_vertices(state, body, of, [light[name] / np.pi for light in reflected])
        for name, (body, of) in bodies.items()
    }


def _at_vertices(
    state: SceneState, body: ThermalBody, thermal: ThermalState, reflected: Sequence[Array]
) -> ThermalLight:
    kelvin = thermal.temperatures[: body.patch_count]
    patches = np.stack([kelvin, body.emissivity, reflected[0], reflected[-1]], axis=1)
    posed = state.bodies[body.name].model.posed_mesh
    return ThermalLight(
        mesh=PosedMesh(mesh=body.mesh, joints=posed.joints, motion=posed.motion),
        values=(body.at_vertices @ patches).reshape(-1, body.sides, 4).astype(np.float32),
    )
