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
from simgl_bridge.basilisk.viz_scene import Say, camera_name, scene_of
from simgl_bridge.render_session import RenderSession


def png_of(
    render_session: RenderSession,
    update: Update,
    camera_id: int,
    overrides: CameraOverrides,
    say: Say,
) -> bytes:
    """PNG of what a camera sees of a state.

    Raises NoPictureError where there is none, ConfigError from within a body, GpuLostError.
    """
    state = scene_of(update, camera_id, render_session.scenario, overrides, say)
    exposure = render_session.capture(state, camera_name(camera_id))
    assert exposure.digital is not None
    return png_from_dn(exposure.digital.dn, exposure.info.camera, state.sun)


def png_from_dn(dn: Image16, camera: Camera, sun: Sun) -> bytes:
    """8-bit PNG, linear in the light: the upper bits of a monochrome detector's numbers.

    A colour detector's are developed, so that white in sunlight is neutral.
    """
    detector = camera.detector
    if detector.mosaic is None:
        picture = (dn >> (detector.bits - 8)).astype(np.uint8)
    else:
        white = sun.photons_per_joule * sun.seen_from(np.zeros(3)).irradiance
        linear = np.clip(develop(dn, detector, white), 0.0, 1.0)
        picture = np.round(255.0 * linear).astype(np.uint8)
    buffer = io.BytesIO()
    # Noise hardly compresses; the first level is ten times as fast as the default.
    Image.fromarray(picture).save(buffer, format="PNG", compress_level=1)
    return buffer.getvalue()
