"""A scenario with smaller images."""

from __future__ import annotations

from dataclasses import replace

from simgl import Camera, Scenario


def fewer_pixels(scenario: Scenario, shrink: int) -> Scenario:
    """The scenario with fewer, larger pixels and the same fields of view."""

    def camera_of(camera: Camera) -> Camera:
        d = camera.detector
        detector = replace(
            d,
            width=d.width // shrink,
            height=d.height // shrink,
            pixel_pitch=d.pixel_pitch * shrink,
        )
        return replace(camera, detector=detector)

    return replace(scenario, cameras={n: camera_of(c) for n, c in scenario.cameras.items()})
