"""Shadow maps of scenes with one camera."""

from __future__ import annotations

import numpy as np

from simgl.scenario.scenario import Scenario
from simgl.view.shadow_views import ShadowView, shadow_view


def sun_shadow(scenario: Scenario, name: str) -> ShadowView:
    """The Sun's maps of a spacecraft whose body axes are those of the scene, as ``cam`` sees it."""
    state = scenario.at(scenario.epoch_tai_ns)
    camera, body = state.cameras["cam"], state.bodies[name]
    body_from_camera = np.eye(4)
    body_from_camera[:3, :3] = camera.R_camera_from_icrf.T
    body_from_camera[:3, 3] = camera.position
    sun = state.direct_light(body.pose.position).main
    return shadow_view(state, body, camera.camera, sun, body_from_camera)
