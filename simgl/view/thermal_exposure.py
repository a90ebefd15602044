"""The moments of a moving scene that a thermal detector's pixels hold in one frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simgl.arrays import Array
from simgl.camera.rolling_shutter import MAX_PARTS, PARTS_PER_PIXEL, moments
from simgl.scene.state import SceneState
from simgl.view.image_motion import background_motion, spacecraft_motion

# Of a bolometer: displacement within a time constant that one instant may leave [px], and the time
# constants that are told apart; what is older, 0.7 % of its signal, is taken at its mean age.
_STILL = 0.02
_REACH = 5.0


def bolometer_moments(time_constant: float, motion: float) -> tuple[Array, Array]:
    """Times before a frame is read [s], and the share of each in a bolometer's signal.

    time_constant : tau [s]
    motion : how far anything moves within it [px]

    A pixel's temperature is the mean of its past, weighed by exp(-age / tau) / tau. Slices of the
    past have their shares of that, each at its mean age; that of all is tau for any number of them.
    """
    count = int(np.clip(np.ceil(PARTS_PER_PIXEL * _REACH * motion), 1, MAX_PARTS))
    if motion <= 1.0 / PARTS_PER_PIXEL:
        count = 1
    starts = np.arange(count) * _REACH / count
    left = np.append(np.exp(-starts), 0.0)
    # Of the integral of age e^-age from the start of each slice on.
    moment = np.append((starts + 1.0) * np.exp(-starts), 0.0)
    shares = left[:-1] - left[1:]
    return time_constant * (moment[:-1] - moment[1:]) / shares, shares


def thermal_exposure(
    state: SceneState, name: str, during: Callable[[int], SceneState]
) -> tuple[tuple[SceneState, float], ...]:
    """Scenes whose weighted mean a thermal camera's pixels hold; none where nothing moves visibly,
    and the state itself is enough.

    during : the scene at other epochs [TAI ns]

    A bolometer is read at the epoch and sees the time before it; the epoch of a photon detector is
    the middle of its integration time.
    """
    camera = state.cameras[name].camera
    assert camera.thermal is not None
    length = camera.exposure_time

    def at(offset: float) -> SceneState:
        scene = during(state.tai_ns + round(offset * 1e9))
        # As it is used for this image.
        placed = replace(scene.cameras[name], camera=camera)
        return replace(scene, cameras={**scene.cameras, name: placed})

    def moved(offset: float) -> float:
        end = at(offset)
        return max(background_motion(state, end, name), spacecraft_motion(state, end, name))

    if camera.thermal.reads_at_epoch:
        motion = moved(-length)
        if motion <= _STILL:
            return ()
        ages, shares = bolometer_moments(length, motion)
        offsets = -ages
    else:
        offsets = moments(camera, moved(-0.5 * length) + moved(0.5 * length))
        if len(offsets) == 1:
            return ()
        shares = np.full(len(offsets), 1.0 / len(offsets))
    weighed = zip(offsets.tolist(), shares.tolist(), strict=True)
    return tuple((at(offset), share) for offset, share in weighed)
