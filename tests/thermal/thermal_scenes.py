"""Scenes whose temperatures have closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np

from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import Mesh
from simgl.scene.state import SceneState
from simgl.thermal.sky_light import EmptySkies, SkyLight

Table = dict[str, Any]
SUNLIGHT = 1367.0  # [W m-2]
# Solar absorptance, infrared emissivity.
FINISHES = {
    "black": (1.0, 1.0),
    "white paint": (0.20, 0.85),
    "black paint": (0.95, 0.90),
    "gold": (0.25, 0.03),
    "optical solar reflector": (0.08, 0.80),
}


def surface(absorptance: float, emissivity: float, conductance: float = 0.0) -> Table:
    """A material as a table."""
    thermal = {
        "solar_absorptance": absorptance,
        "infrared_emissivity": emissivity,
        "conductance_w_m2_k": conductance,
    }
    return {"reflectance": 0.5, "thermal": thermal}


def in_sunlight(model: Table, **more: Any) -> Scenario:
    """A body in deep space, the Sun along +z."""
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {
                "irradiance_w_m2": SUNLIGHT,
                "temperature_k": 5772.0,
                "angular_diameter_deg": 0.526,
                "direction_icrf": [0.0, 0.0, 1.0],
            },
            "earth": {"shape": "none"},
            "spacecraft": {"body": {"model": model, "position_icrf_m": [0.0, 0.0, 0.0]}},
            **more,
        }
    )


def heat_in_space(state: SceneState, name: str = "body") -> SkyLight:
    """What surrounds a body where there is no Earth."""
    return EmptySkies().heat(state, name)


def merged(*meshes: Mesh) -> Mesh:
    """Several meshes as one, a part and a material for each."""
    first = np.cumsum([0, *(len(m.positions) for m in meshes)])
    sizes = [len(m.positions) for m in meshes]
    label = np.repeat(np.arange(len(meshes), dtype=np.uint32), sizes)
    triangles = [m.triangles + np.uint32(n) for m, n in zip(meshes, first[:-1], strict=True)]
    return Mesh(
        positions=np.concatenate([m.positions for m in meshes]),
        normals=np.concatenate([m.normals for m in meshes]),
        triangles=np.concatenate(triangles),
        part=label,
        material=label,
    )


def moved(mesh: Mesh, shift: tuple[float, float, float]) -> Mesh:
    """A mesh elsewhere."""
    return Mesh(
        positions=mesh.positions + np.asarray(shift, dtype=np.float32),
        normals=mesh.normals,
        triangles=mesh.triangles,
        part=mesh.part,
        material=mesh.material,
    )


def turned_inside_out(mesh: Mesh) -> Mesh:
    """A mesh seen from within."""
    return Mesh(
        positions=mesh.positions,
        normals=-mesh.normals,
        triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]),
        part=mesh.part,
        material=mesh.material,
    )
