"""The images of the gallery: which light each of them shows, and how bright."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from examples.fewer_pixels import fewer_pixels
from simgl import (
    Product,
    Simulator,
    contact_sheet,
    display_from_layers,
    display_from_radiance,
    load_scenario,
)
from simgl.arrays import Array32, Image8
from simgl.images import LayersFrame
from simgl.progress import ProgressCallback

BAY = Path(__file__).with_name("bay.toml")
BOARD = Path(__file__).parents[1] / "materials.toml"
AZIMUTHS = Path(__file__).parents[1] / "azimuths.toml"

# What of the daylight each image shows, one light more in each.
DAYLIGHT = {
    "sun": ("sun", "background"),
    "earth": ("sun", "background", "earth"),
    "all": ("sun", "background", "earth", "inter_reflected"),
}
HALF_AN_ORBIT_NS = 2_777 * 10**9
# The lamp's images are brighter than those of the day by this.
LAMP_GAIN = 128.0


def gallery_images(
    shrink: int = 1, progress: ProgressCallback | None = None
) -> Iterator[tuple[str, Image8]]:
    """Name and 8-bit sRGB image, one after the other.

    shrink : images are smaller by this factor
    progress : told of the light between surfaces while it is traced
    """
    scenario = fewer_pixels(load_scenario(BAY), shrink)
    with Simulator(scenario, progress=progress) as simulator:
        for camera in scenario.cameras:
            day = _layers(simulator, scenario.epoch_tai_ns, camera)
            for name, lights in DAYLIGHT.items():
                seen = np.sum([day.layers[light] for light in lights], axis=0)
                yield f"{camera}_{name}", display_from_radiance(seen)
            if camera == "bay":
                yield f"{camera}_layers", display_from_layers(_halved(day))
            night = _layers(simulator, scenario.epoch_tai_ns + HALF_AN_ORBIT_NS, camera)
            yield f"{camera}_lamp", display_from_radiance(night.total, LAMP_GAIN)
    yield "azimuths", contact_sheet(_by_camera(AZIMUTHS, 3 * shrink), columns=3)
    yield "materials", _by_camera(BOARD, shrink)["board"]


def _by_camera(scenario_file: Path, shrink: int) -> dict[str, Image8]:
    """The image of each camera at the scenario's epoch."""
    scenario = fewer_pixels(load_scenario(scenario_file), shrink)
    state = scenario.at(scenario.epoch_tai_ns)
    images = {}
    with Simulator(scenario) as simulator:
        for camera in scenario.cameras:
            radiance = simulator.capture(state, camera, {Product.RADIANCE}).radiance
            assert radiance is not None
            images[camera] = display_from_radiance(radiance.radiance)
    return images


def _layers(simulator: Simulator, tai_ns: int, camera: str) -> LayersFrame:
    state = simulator.scenario.at(tai_ns)
    frame = simulator.capture(state, camera, {Product.LAYERS}).layers
    assert frame is not None
    return frame


def _halved(frame: LayersFrame) -> LayersFrame:
    """Each four pixels as one."""

    def half(layer: Array32) -> Array32:
        height, width = (side // 2 * 2 for side in layer.shape[:2])
        blocks = layer[:height, :width].reshape(height // 2, 2, width // 2, 2, 4)
        return np.asarray(blocks.mean(axis=(1, 3)), dtype=np.float32)

    return replace(frame, layers={name: half(layer) for name, layer in frame.layers.items()})
