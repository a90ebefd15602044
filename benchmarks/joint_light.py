"""Error of quick light between moved parts: ``examples/servicer.toml``, its arm at random poses.

python -m benchmarks.joint_light [--poses 20]

Rays of the vertices are traced against the whole body at each pose, with the same triangles and the
same light of the patches. Numbers are of the surface that is outside all other parts, sunlit as in
the scenario.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from simgl import load_scenario
from simgl.arrays import Array, Array32
from simgl.radiosity.gather_points import (
    LIFT,
    cast,
    counts,
    face_normals,
    gather_points_of,
    nearest_open,
)
from simgl.radiosity.incident_light import incident_light
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.occlusion import inside_others, moved_into_open
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.solver import vertex_irradiance
from simgl.radiosity.transport_store import STEPS, TransportStore
from simgl.rays import RayTracer
from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import PosedMesh

# As many as a bake traces.
RAYS = 256
ARM = {"yaw": 25.0, "shoulder": 50.0, "elbow": -85.0, "pitch": 35.0, "roll": 90.0}


def traced_light(mesh: Mesh, transport: LightTransport, exitance: Array32) -> Array:
    """(v, 4) irradiance of the vertices by rays of their own against the whole body [W m-2]."""
    tracer = RayTracer(mesh)
    points = moved_into_open(mesh, tracer, gather_points_of(mesh, 1))
    seen = cast(mesh, tracer, points, 1, RAYS, lambda _: None)
    patch = transport.patch_of_side
    to_patch = counts(np.arange(len(patch)), patch, (len(patch), len(transport.areas)))
    instead = nearest_open(mesh, points, seen.buried)
    rows = instead[points.of_vertex[0]]
    return np.asarray((seen.hits[rows] @ to_patch) @ exitance / RAYS)


def outside(mesh: Mesh) -> Array:
    """(v,) surface about each vertex that is outside all other parts [m2]."""
    faces, areas = face_normals(mesh)
    middles = mesh.positions[mesh.triangles].astype(np.float64).mean(axis=1)
    inside = inside_others(mesh, RayTracer(mesh), middles + LIFT * mesh.radius * faces, faces)
    weights = np.repeat(areas * ~inside / 3.0, 3)
    sums = np.bincount(mesh.triangles.ravel(), weights, minlength=len(mesh.positions))
    return np.asarray(sums, dtype=np.float64)


def measure(
    scenario: Scenario, angles: dict[str, float], store: TransportStore
) -> dict[str, float]:
    """Differences at one pose, as shares of all interreflected light in green."""
    epoch = scenario.epoch_tai_ns
    joints = {"servicer": {f"arm_{name}": np.radians(a) for name, a in angles.items()}}
    state = scenario.with_poses(epoch, scenario.poses(epoch), joint_angles=joints)
    body = state.bodies["servicer"]
    model = body.model.coarsely_posed(STEPS["quick"])
    transport = store.of(model, "quick")
    assert transport is not None
    exitance = PatchLight().exitance(model, transport, None, incident_light(state, body))
    matrix = transport.of_vertices
    values = vertex_irradiance(matrix, exitance).reshape(*matrix.shape, 4)
    motion = model.posed_mesh.motion
    mesh = PosedMesh(mesh=transport.mesh, joints=model.joints, motion=motion).baked()
    weight = outside(mesh)
    quick, traced = values[:, 0, 1], traced_light(mesh, transport, exitance)[:, 1]
    total = float(weight @ traced)
    difference = quick - traced
    return {
        "sum_percent": round(100.0 * float(weight @ difference) / total, 2),
        "mean_absolute_percent": round(100.0 * float(weight @ np.abs(difference)) / total, 2),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.joint_light")
    parser.add_argument("--poses", type=int, default=20)
    scenario = load_scenario(Path(__file__).parents[1] / "examples" / "servicer.toml")
    random, store, differences = np.random.default_rng(5), TransportStore(), []
    for _ in range(parser.parse_args().poses):
        angles = {name: a + float(random.uniform(-40.0, 40.0)) for name, a in ARM.items()}
        differences.append(measure(scenario, angles, store))
        print(json.dumps(differences[-1]), flush=True)
    sums = np.array([f["sum_percent"] for f in differences])
    rms = round(float(np.sqrt(np.mean(sums**2))), 2)
    print(json.dumps({"poses": len(differences), "sum_percent_rms": rms}))


if __name__ == "__main__":
    main()
