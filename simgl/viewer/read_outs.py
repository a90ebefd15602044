"""What the window says of an image and of a pixel, in words."""

from __future__ import annotations

import math

from simgl.figures.displays import CameraImages, pixel_values
from simgl.images import saturation_level
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.scenario.scenario import Scenario
from simgl.scene.sights import sights
from simgl.scene.state import CameraState, SceneState
from simgl.viewer.view_commands import camera_text, exposure_text, gain_text, sun_text, time_text
from simgl.viewer.view_settings import ViewSettings

# Spacecraft whose range and phase angle are listed, the nearest first.
_MAX_LISTED = 3


def info_lines(
    scenario: Scenario,
    settings: ViewSettings,
    state: SceneState,
    placed: CameraState,
    images: CameraImages,
) -> list[str]:
    """What is seen, when, from where, and with which settings.

    placed : the camera of the images
    """
    seen = sorted(sights(state, placed), key=lambda sight: sight[1])[:_MAX_LISTED]
    lines = [
        f"{utc_from_tai_ns(state.tai_ns)[:23]} UTC",
        time_text(settings, scenario),
        camera_text(settings, scenario),
        *(
            f"{name}: range {distance:.5g} m, phase angle {math.degrees(phase):.1f} deg"
            for name, distance, phase in seen
        ),
        exposure_text(settings, scenario),
    ]
    if settings.camera is not None:
        lines.append(gain_text(settings, scenario))
    if images.saturated_share is not None:
        lines.append(f"saturated {100.0 * images.saturated_share:.3g} %")
    if settings.sun_deg is not None:
        lines.append(sun_text(settings, scenario))
    lines.append(f"drawn in {1e3 * images.seconds:.0f} ms; h for help")
    return lines


def pixel_lines(images: CameraImages, column: int, row: int) -> list[str]:
    """A pixel's values with their units; none outside the image."""
    values = pixel_values(images, column, row)
    if values is None:
        return []
    lines = [f"pixel {column}, {row}"]
    if (radiance := values["radiance_w_m2_sr"]) is not None:
        bands = "  ".join(
            f"{band} {value:.4g}" for band, value in zip("RGBN", radiance, strict=True)
        )
        lines += [f"radiance {bands}", f"  sum {sum(radiance):.4g} W m-2 sr-1"]
    if values["electrons"] is not None:
        lines.append(f"mean electrons {values['electrons']:.5g} e-")
    if (dn := values["dn"]) is not None:
        full = dn >= saturation_level(images.camera.detector)
        lines.append(f"DN {dn}{', saturated' if full else ''}")
    if values["depth_m"]:
        lines.append(f"depth {values['depth_m']:.6g} m")
    return lines
