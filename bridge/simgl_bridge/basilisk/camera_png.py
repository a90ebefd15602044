"""From a state to the 8-bit PNG that Basilisk's camera takes."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from simgl.arrays import Image16
from simgl.camera.camera import Camera
from simgl.camera.demosaic import develop
from simgl.scene.state import Sun
from simgl_bridge.basilisk.camera_overrides import CameraOverrides
from simgl_bridge.basilisk.viz_messages import Update
from simgl_bridge.basilisk.viz_scene import Warn, camera_name, scene_of
from simgl_bridge.render_session import RenderSession


def png_of(
    render_session: RenderSession,
    update: Update,
    camera_id: int,
    overrides: CameraOverrides,
    warn: Warn,
) -> bytes:
    """PNG image of a state.

    Raises NoImageError where there is none, ConfigError from within a body, GpuLostError.
    """
    state = scene_of(update, camera_id, render_session.scenario, overrides, warn)
    capture = render_session.capture(state, camera_name(camera_id))
    assert capture.digital is not None
    return png_from_dn(capture.digital.dn, capture.info.camera, state.sun)


def png_from_dn(dn: Image16, camera: Camera, sun: Sun) -> bytes:
    """8-bit PNG, linear in the light: the upper 8 bits of a monochrome detector's DN.

    A colour detector's DN are demosaiced, so that white in sunlight is neutral.
    """
    detector = camera.detector
    if detector.mosaic is None:
        pixels = (dn >> (detector.bits - 8)).astype(np.uint8)
    else:
        white = sun.photons_per_joule * sun.seen_from(np.zeros(3)).irradiance
        linear = np.clip(develop(dn, detector, white), 0.0, 1.0)
        pixels = np.round(255.0 * linear).astype(np.uint8)
    buffer = io.BytesIO()
    # Noise hardly compresses; level 1 is ten times as fast as the default.
    Image.fromarray(pixels).save(buffer, format="PNG", compress_level=1)
    return buffer.getvalue()
