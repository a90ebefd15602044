"""The server's description of itself: scenario, cameras and products."""

from __future__ import annotations

from simgl import __version__
from simgl.camera.camera import Camera
from simgl_bridge.messages import CameraDescription, Welcome
from simgl_bridge.render_session import RenderSession
from simgl_bridge.validate_request import PRODUCTS


def welcome(render_session: RenderSession, *, id: int | None, boot: str, window: int) -> Welcome:
    """The reply to Hello (no id) and to Configure."""
    scenario = render_session.scenario
    return Welcome(
        id=id,
        server=__version__,
        boot=boot,
        renderer=render_session.renderer_name,
        scenario=scenario.name,
        scene_hash=render_session.scene_hash,
        epoch_tai_ns=scenario.epoch_tai_ns,
        time_scale="TAI ns since 1970-01-01T00:00:00 TAI",
        frame="GCRF",
        seed=scenario.seed,
        window=window,
        products=tuple(PRODUCTS),
        cameras=tuple(_camera(name, camera) for name, camera in scenario.cameras.items()),
        bodies={name: tuple(j.name for j in m.joints) for name, m in scenario.models.items()},
        scenarios=render_session.scenario_names,
        lamps=tuple(scenario.lamps),
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
    )
