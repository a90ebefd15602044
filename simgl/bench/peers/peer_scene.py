"""The scene that other renderers draw, as plain arrays, and simgl's image of it.

Places are relative to the spacecraft, in the camera's axes: x right, y down, z forward. Sunlight
has 1 W m-2 in each colour, which no comparison of images at the same mean depends on.

python -m simgl.bench.peers.peer_scene FILE.npz
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from simgl.arrays import AnyArray
from simgl.bench.peers.lambertian import lambertian_scenario
from simgl.bench.scenes import scene_files
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator

SCENE = "source_600"
GREEN = 1


def peer_arrays() -> dict[str, AnyArray]:
    """What ``run_peers`` hands to the renderers, by name.

    positions, normals : (n, 3)
    triangles, material : (t, 3) of positions and (t,) of reflectance
    reflectance : (m, 3)
    sun_direction : (3,) towards the Sun; sun_angle : its diameter [rad]
    camera_position : (3,) [m]; fov : across the image [rad]
    simgl : (h, w) radiance in green
    """
    scenario = replace(lambertian_scenario(scene_files()[SCENE]), earth=None, stars=None)
    camera = next(iter(scenario.cameras))
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario) as simulator:
        capture = simulator.capture(state, camera, {Product.RADIANCE})
    assert capture.radiance is not None
    return {**_geometry(state, camera), "simgl": capture.radiance.radiance[..., GREEN]}


def _geometry(state: SceneState, camera_name: str) -> dict[str, AnyArray]:
    camera = state.cameras[camera_name]
    body = next(iter(state.bodies.values()))
    mesh = body.model.posed_mesh.baked()
    R_camera_from_body = camera.R_camera_from_icrf @ body.pose.R_icrf_from_body
    sun = state.sun.seen_from(body.pose.position)
    return {
        "positions": (mesh.positions @ R_camera_from_body.T).astype(np.float32),
        "normals": (mesh.normals @ R_camera_from_body.T).astype(np.float32),
        "triangles": mesh.triangles.astype(np.int32),
        "material": mesh.material[mesh.triangles[:, 0]].astype(np.int32),
        "reflectance": np.array([m.reflectance[:3] for m in body.model.materials]),
        "sun_direction": camera.R_camera_from_icrf @ sun.direction_icrf,
        "sun_angle": np.array(2.0 * sun.angular_radius),
        "camera_position": camera.R_camera_from_icrf @ (camera.position - body.pose.position),
        "fov": np.array(camera.camera.fields_of_view[0]),
    }


def main() -> None:
    """Write the scene."""
    np.savez(Path(sys.argv[1]), **peer_arrays())  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
