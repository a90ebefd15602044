"""What a thermal camera sees of a scene: values at vertices, the Earth's climate, Planck's law.

The passes draw it (simgl/passes/thermal.py, simgl/passes/background/infrared_earth.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.infrared_detector import InfraredDetector
from simgl.physics.earth_infrared import Emission, InfraredAir
from simgl.physics.thermal_radiation import band_photon_radiance, band_radiance
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import SceneState
from simgl.thermal.between_bodies import Neighbours, neighbours, reflected_between
from simgl.thermal.body import ThermalBody
from simgl.thermal.ground_seen import (
    day_of_year,
    infrared_air,
    sky_radiance,
    sunlight_in,
    total_sunlight,
)
from simgl.thermal.heat_loads import light_of_sky
from simgl.thermal.history import ThermalState
from simgl.thermal.network import SPACE_TEMPERATURE
from simgl.thermal.scene_temperatures import history_of, name_of

# Light goes on between patches until a reflection adds less than this share of the brightest one.
_DARK = 1e-5
# Planck's law is looked up at so many temperatures up to the highest [K]: 1e-5 at 300 K in 3 to
# 5 um.
PLANCK_STEPS, HOTTEST = 4096, 1024.0

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
class InfraredEarth:
    """The Earth in a band.

    air : and clouds
    day : of the year
    sunlight : the Sun's irradiance of the ground in the band, in W and as counted [m-2]
    """

    air: InfraredAir
    day: float
    sunlight: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalView:
    """All that a thermal frame takes besides the camera's view.

    lights : by spacecraft
    planck : (PLANCK_STEPS, 2) float32, radiance of a black body at 0..``HOTTEST`` K, in
        W m-2 sr-1 and as the detector counts
    space : (2,) the same of deep space
    earth : None where there is none
    digest : of the thermal states of all spacecraft
    history : how these came about
    """

    lights: Mapping[str, ThermalLight]
    planck: Array32
    space: tuple[float, float]
    earth: InfraredEarth | None
    digest: str
    history: str


def thermal_view(state: SceneState, detector: InfraredDetector, bodies: Bodies) -> ThermalView:
    """A scene in the band of a detector.

    bodies : every spacecraft with its temperatures

    A patch sends emissivity times Planck's law, and reflects diffusely what the Earth, the Sun, and
    other patches of its body and of bodies near it send in the band. Temperatures are means at the
    corners of triangles of one part and material, and go over from one to the next.
    """
    emissions = detector.watts, detector.emission
    watts, counted = (float(e(np.array(SPACE_TEMPERATURE))) for e in emissions)
    return ThermalView(
        lights=_lights(state, bodies, detector),
        planck=_planck(detector.table.kind, detector.band),
        space=(watts, counted),
        earth=_earth(state, detector),
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


@lru_cache(maxsize=16)
def _planck(kind: str, band: tuple[float, float]) -> Array32:
    temperatures = np.linspace(0.0, HOTTEST, PLANCK_STEPS)[1:]
    counted = band_radiance if kind == "bolometer" else band_photon_radiance
    columns = [radiance(band, temperatures) for radiance in (band_radiance, counted)]
    return np.concatenate([np.zeros((1, 2)), np.stack(columns, axis=1)]).astype(np.float32)


def _earth(state: SceneState, detector: InfraredDetector) -> InfraredEarth | None:
    earth = state.earth
    if earth is None:
        return None
    total = total_sunlight(state.sun.seen_from(earth.position).irradiance)
    watts, counted = (sunlight_in(e, total) for e in (detector.watts, detector.emission))
    return InfraredEarth(
        air=infrared_air(earth, detector.band),
        day=day_of_year(state.tai_ns),
        sunlight=(watts, counted),
    )


def _lights(
    state: SceneState, bodies: Bodies, detector: InfraredDetector
) -> dict[str, ThermalLight]:
    """Every body, with what it reflects of the others near it."""
    near = neighbours({name: body for name, (body, _) in bodies.items()}, state)
    no_neighbours = Neighbours(factors={}, hidden={})
    lights: dict[str, ThermalLight] = {}
    for name in bodies.keys() - near.hidden.keys():
        lights |= _reflected(state, {name: bodies[name]}, no_neighbours, detector)
    if near.hidden:
        together = {name: bodies[name] for name in near.hidden}
        lights |= _reflected(state, together, near, detector)
    return {name: lights[name] for name in bodies}


def _reflected(
    state: SceneState, bodies: Bodies, near: Neighbours, detector: InfraredDetector
) -> dict[str, ThermalLight]:
    # A bolometer counts watts.
    emissions: list[Emission] = [detector.watts]
    if detector.table.kind == "photon":
        emissions.append(detector.emission)
    skies = {}
    for name, (body, _) in bodies.items():
        position = state.bodies[name].pose.position
        radiances = partial(_sky, state, position, detector, emissions)
        skies[name] = light_of_sky(body, state, radiances, near.hidden.get(name)).T
    reflected = []
    for number, emission in enumerate(emissions):
        sent = {
            name: np.pi * body.emissivity * emission(of.temperatures[: body.patch_count])
            for name, (body, of) in bodies.items()
        }
        others = near.received(sent)
        first = {
            name: skies[name][number]
            + of.sunlight * sunlight_in(emission, 1.0)
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


def _sky(
    state: SceneState,
    position: Array,
    detector: InfraredDetector,
    emissions: Sequence[Emission],
    lines: Array,
) -> Array:
    return sky_radiance(state, position, lines, detector.band, emissions)


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
