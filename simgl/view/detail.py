"""How exactly each part of a spacecraft has to be drawn for one camera: a function of the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.scene.detail_steps import step_below
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, CameraState, SceneState


@dataclass(frozen=True)
class Detail:
    """What may stand for a spacecraft.

    errors : that each of its parts may have [m]; none at all for the model as it is
    exchanging : it is drawn from the mesh that carries the light between its surfaces
    """

    errors: tuple[float, ...] = ()
    exchanging: bool = False

    @property
    def key(self) -> bytes:
        """Equal keys mean that the same is drawn."""
        return np.array([self.exchanging, *self.errors]).tobytes()

    def for_other(self, model: SpacecraftModel) -> Detail:
        """For another body, errors no larger than any of these."""
        least = min(self.errors, default=0.0)
        if least == 0.0 or not may_be_coarse(model, exchanging=self.exchanging):
            return WHOLE
        return Detail((least,) * len(model.parts), self.exchanging)


# The model as it is.
WHOLE = Detail()


def camera_from_body(camera: CameraState, body: BodyState) -> Array:
    """(4, 4) from body axes to camera axes [m]."""
    matrix = np.eye(4)
    matrix[:3, :3] = camera.R_camera_from_icrf @ body.pose.R_icrf_from_body
    matrix[:3, 3] = camera.R_camera_from_icrf @ (body.pose.position - camera.position)
    return matrix


def may_be_coarse(model: SpacecraftModel, *, exchanging: bool) -> bool:
    """Whether a model has levels: not where it is drawn whole, and with light between its surfaces
    only with its joints as stored, since each pose has its own mesh."""
    return not (model.exact or (exchanging and model.stored is not None))


def far_models(state: SceneState, error_px: float, *, exchanging: bool) -> list[SpacecraftModel]:
    """The spacecraft that some camera of the scene is so far from that less may stand for them."""
    return [
        body.model
        for body in state.bodies.values()
        if any(
            detail(body.model, place, seen.camera, error_px, exchanging=exchanging).errors
            for seen in state.cameras.values()
            for place in [camera_from_body(seen, body)]
        )
    ]


def detail(
    model: SpacecraftModel,
    matrix: Array,
    camera: Camera,
    error_px: float,
    *,
    exchanging: bool = False,
) -> Detail:
    """What may stand for a spacecraft before a pinhole.

    A place that is off by d at depth z moves in the picture by at most f d / (z cos a), where a is
    its angle from the boresight, so by at most so much with the depth of a part's nearest place
    and the angle of the picture's corner.

    matrix : (4, 4) camera_from_body
    camera : whose pixels are meant; the field of a lens that distorts ends where its pinhole's does
    error_px : how far anything may be moved [pixels]
    exchanging : its surfaces light each other
    """
    if error_px <= 0.0 or not may_be_coarse(model, exchanging=exchanging):
        return WHOLE
    spheres = model.mesh.part_spheres
    depth = matrix[2, :3] @ spheres[:, :3].T + matrix[2, 3] - spheres[:, 3]
    d, f = camera.detector, camera.focal_length_px
    corner = 1.0 / np.sqrt(1.0 + (d.width**2 + d.height**2) / (2.0 * f) ** 2)
    # A part without vertices is infinitely deep, and takes any level.
    errors = tuple(step_below(float(e)) for e in error_px * corner / f * depth)
    return Detail(errors, exchanging) if any(errors) else WHOLE
