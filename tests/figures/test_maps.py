"""The maps of an exposure as files."""

from __future__ import annotations

from pathlib import Path

import moderngl
from PIL import Image

from simgl.figures.maps import write_maps
from simgl.simulator import Product, Simulator
from tests.scenes import lambert, scene

KINDS = (
    "radiance",
    "flux",
    "false_colour",
    "photons",
    "electrons",
    "range",
    "lidar",
    "lidar_return",
)


def test_every_map_is_a_picture_with_room_for_its_scale(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    model = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.5)}}
    scenario = scene(
        {"plate": {"model": model, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 100], "look_at": "plate", "lidar": {}},
    )
    wanted = {Product.RADIANCE, Product.IRRADIANCE, Product.ELECTRONS, Product.TRUTH, Product.LIDAR}
    with Simulator(scenario, gl) as simulator:
        exposure = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", wanted)
    paths = write_maps(exposure, tmp_path, "cam")
    assert [p.name for p in paths] == [f"cam.map.{kind}.png" for kind in KINDS]
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    for path in paths:
        with Image.open(path) as picture:
            # Pixels five times as large, and margins.
            assert picture.width > 640
            assert picture.height > 640
            assert len(picture.convert("RGB").getcolors(1 << 20) or ()) > 10
