"""A user's own maps: read where they are whole, refused in one line where they are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from simgl.errors import ConfigError
from simgl.scenario.loader import load_scenario

EARTH = '[epoch]\nutc = "2026-03-20T12:00:00"\n[earth]\n'
CAMERA = """
[camera.cam]
position_icrf_m = [7.0e6, 0, 0]
boresight = [-1, 0, 0]
"""


def file_with(folder: Path, earth: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(EARTH + earth + CAMERA)
    return path


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    grey = np.random.default_rng(0).integers(0, 256, (16, 32), dtype=np.uint8)
    Image.fromarray(grey).save(tmp_path / "whole.png")
    Image.fromarray(grey[:, :31]).save(tmp_path / "narrow.png")
    whole = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.png").write_text("no picture")
    return tmp_path


def test_pictures_beside_the_file_take_the_place_of_shipped_maps(pictures: Path) -> None:
    text = 'land_picture = "whole.png"\nwind_m_s = 3.0\n'
    text += '[earth.clouds]\npicture = "whole.png"\noptical_thickness = 20.0\nheight_km = 8.0\n'
    earth = load_scenario(file_with(pictures, text)).earth
    assert earth is not None
    assert earth.clouds is not None
    assert earth.maps.land == earth.clouds.image
    assert earth.clouds.image is not None
    assert earth.clouds.image.path == pictures / "whole.png"
    assert (earth.wind, earth.clouds.thickness, earth.clouds.height) == (3.0, 20.0, 8000.0)


def test_weather_has_a_cover_and_a_seed(tmp_path: Path) -> None:
    earth = load_scenario(file_with(tmp_path, "[earth.clouds]\ncover = 0.3\nseed = 9\n")).earth
    assert earth is not None
    assert earth.clouds is not None
    assert (earth.clouds.cover, earth.clouds.seed) == (0.3, 9)
    clear = load_scenario(file_with(tmp_path, "clouds = { cover = 0.0 }\n")).earth
    assert clear is not None
    assert clear.clouds is None


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('land_picture = "none.png"', "[earth]: land_picture there is no file {}/none.png"),
        (
            'water_picture = "narrow.png"',
            "[earth]: water_picture {}/narrow.png must be twice as wide as high and at most 16384 "
            "pixels wide, it is 31 x 16",
        ),
        (
            'night_picture = "text.png"',
            "[earth]: night_picture {}/text.png is not an image that Pillow can read",
        ),
        ('[earth.clouds]\npicture = "cut.png"', "[earth.clouds]: picture {}/cut.png is damaged: "),
        (
            '[earth.clouds]\npicture = "whole.png"\nseed = 1',
            "[earth.clouds]: seed contradicts picture, which says where clouds are",
        ),
        (
            "[earth.clouds]\noptical_thickness = 5.0",
            "[earth.clouds]: optical_thickness requires picture, which is missing",
        ),
        (
            "[earth.clouds]\ncover = 1.5",
            "[earth]: clouds.cover must be a number >= 0.0, <= 1.0, got 1.5",
        ),
        ("wind_m_s = -1.0", "[earth]: wind_m_s must be a number >= 0.0, <= 40.0, got -1.0"),
        (
            "albedo = 0.3\nwind_m_s = 5.0",
            "[earth]: wind_m_s requires an Earth with maps, got albedo",
        ),
        (
            'shape = "none"\n[earth.clouds]\ncover = 0.5',
            '[earth]: clouds requires an Earth with maps, got shape = "none"',
        ),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(
    pictures: Path, text: str, problem: str
) -> None:
    path = file_with(pictures, text + "\n")
    with pytest.raises(ConfigError) as raised:
        load_scenario(path)
    message = str(raised.value)
    assert message.startswith(f"{path} {problem.format(pictures)}")
    assert "\n" not in message
