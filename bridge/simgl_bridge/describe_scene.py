"""What a renderer tells its server of the scenario."""

from __future__ import annotations

from simgl.camera.camera import Camera
from simgl.scenario.scenario import Scenario
from simgl_bridge.hashes import scene_hash
from simgl_bridge.message_parts import CameraDescription
from simgl_bridge.plane_compression import available
from simgl_bridge.renderer_messages import ServedJoint, ServedModel, ServedScene


def served_scene(scenario: Scenario, renderer: str, camera_files: str = "") -> ServedScene:
    """A scenario as its server describes it to clients.

    renderer : OpenGL renderer and version
    camera_files : of Basilisk's cameras
    """
    models = {
        name: ServedModel(
            joints=tuple(
                ServedJoint(name=j.name, limits=j.limits, unit=j.unit) for j in model.joints
            )
        )
        for name, model in scenario.models.items()
    }
    return ServedScene(
        renderer=renderer,
        name=scenario.name,
        scene_hash=scene_hash(scenario),
        epoch_tai_ns=scenario.epoch_tai_ns,
        seed=scenario.seed,
        cameras={name: _camera(name, camera) for name, camera in scenario.cameras.items()},
        models=models,
        lamps=tuple(scenario.lamps),
        camera_files=camera_files,
        compressions=available(),
    )


def _camera(name: str, camera: Camera) -> CameraDescription:
    d, K = camera.detector, camera.intrinsics
    return CameraDescription(
        name=name,
        width=d.width,
        height=d.height,
        bits=d.bits,
        pedestal_dn=d.pedestal,
        full_well_e=d.full_well,
        gain_dn_per_e=d.gain_dn_per_e,
        focal_length_px=camera.focal_length_px,
        cx=float(K[0, 2]),
        cy=float(K[1, 2]),
        exposure_time_s=camera.exposure_time,
        readout_time_s=camera.readout_time,
        transport_latency_s=camera.transport_latency,
        lidar=camera.lidar is not None,
        thermal=camera.thermal is not None,
    )
