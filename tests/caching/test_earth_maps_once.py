"""What an Earth is drawn with depends on the scenario alone: no second start computes it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Barrier
from typing import Any

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl import assets
from simgl.disk_cache import cache_folder
from simgl.passes.background import cloud_map, earth_maps, earth_textures
from simgl.passes.background.earth_textures import SAMPLERS, EarthTextures
from simgl.scene import noise_projection
from simgl.scene.earth import Clouds, Earth, EarthMaps, load_map
from simgl.scene.noise_projection import LEVELS, SIZE

Start = Callable[[Earth], list[str]]


@pytest.fixture
def start(gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Makes the textures of an Earth as a new process does; returns the names of what it computed.

    What is computed is cheap, and of the right form.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    computed: list[str] = []
    code = np.zeros((8, 16, 4), dtype=np.uint8)
    chart = tuple(np.zeros((SIZE >> n, SIZE >> n, 8), dtype=np.uint8) for n in range(LEVELS))

    def stand_in(module: object, name: str, value: object) -> None:
        def compute(*_: object) -> Any:
            computed.append(name)
            return value

        monkeypatch.setattr(module, name, compute)

    stand_in(earth_maps, "make_land_map", code)
    stand_in(earth_maps, "make_form_map", code[..., :2] + 1)
    stand_in(earth_maps, "make_shore_map", code[..., :1] + 1)
    stand_in(earth_maps, "make_lamp_map", code[..., :1] + 1)
    corners = earth_maps.cell_sums(np.zeros((earth_maps.CELLS, 2 * earth_maps.CELLS), dtype=bool))
    stand_in(earth_maps, "make_shores", (corners,) * 2)
    stand_in(cloud_map, "noise_volume", np.zeros((128, 128, 128, 4), dtype=np.uint8))
    stand_in(cloud_map, "weather_codes", code + 2)
    stand_in(cloud_map, "_from_image", code + 3)
    stand_in(noise_projection, "make_chart", (chart, np.ones((LEVELS, 6), dtype=np.float32)))

    def textures_of(earth: Earth) -> list[str]:
        _forget()
        computed.clear()
        textures = EarthTextures(gl)
        try:
            made = textures.of(earth)
            weather = made[SAMPLERS.index("weather_map")].read()[:1]
        finally:
            textures.release()
        # Of no clouds, nothing.
        assert weather == (b"\2" if earth.clouds else b"\0")
        return sorted(computed)

    yield textures_of
    _forget()


def _forget() -> None:
    """What this process keeps in memory."""
    earth_maps._land_maps.clear()
    earth_maps._form_maps.clear()
    earth_maps._shore_maps.clear()
    earth_maps._lamp_maps.clear()
    earth_textures._weather.clear()
    noise_projection.chart.cache_clear()


ALL = [
    "make_chart",
    "make_form_map",
    "make_lamp_map",
    "make_land_map",
    "make_shore_map",
    "make_shores",
    "noise_volume",
]
WEATHER = ["noise_volume", "weather_codes"]
CLOUDY = Earth(clouds=Clouds(seed=3))


def test_a_second_start_computes_nothing(start: Start) -> None:
    assert start(CLOUDY) == [*ALL, "weather_codes"]
    assert start(CLOUDY) == []


def test_another_weather_computes_the_weather_alone(start: Start) -> None:
    start(CLOUDY)
    assert start(Earth(clouds=Clouds(seed=3, cover=0.2))) == WEATHER
    # Their shadows alone depend on the height.
    assert start(Earth(clouds=Clouds(seed=3, height=7e3))) == []
    assert start(Earth()) == ["make_chart"]
    assert start(CLOUDY) == []


@pytest.mark.parametrize("changed", ["cloud_map/cloud_map.frag", "planet/cloud.glsl"])
def test_a_changed_shader_draws_the_weather_again(
    start: Start, changed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(CLOUDY)
    shaders = tmp_path / "shaders"
    shutil.copytree(assets.shaders(), shaders)
    monkeypatch.setattr(assets, "shaders", lambda: shaders)
    assert start(CLOUDY) == []
    with (shaders / changed).open("a") as file:
        file.write("// changed\n")
    assert start(CLOUDY) == WEATHER


@pytest.mark.parametrize(
    ("changed", "computed"),
    [
        ("land_nir.jpg", ["make_land_map", *WEATHER]),
        ("shore.png", ["make_shore_map", "make_shores", *WEATHER]),
        ("relief_east.png", ["make_form_map"]),
        ("relief_north.png", ["make_form_map"]),
        ("night.jpg", ["make_lamp_map"]),
    ],
)
def test_changed_data_is_read_again_with_the_weather_that_depends_on_it(
    start: Start, changed: str, computed: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(CLOUDY)
    data = tmp_path / "data"
    shutil.copytree(assets.data() / "earth", data / "earth")
    monkeypatch.setattr(assets, "data", lambda: data)
    assert start(CLOUDY) == []
    with (data / "earth" / changed).open("ab") as file:
        file.write(b" ")
    assert start(CLOUDY) == computed


def test_an_image_counts_by_its_content(start: Start, tmp_path: Path) -> None:
    path = tmp_path / "land.png"

    def earth(value: int) -> Earth:
        Image.new("RGB", (16, 8), (value, value, value)).save(path)
        return Earth(maps=EarthMaps(land=load_map(path, "RGB")))

    start(Earth())
    assert start(earth(10)) == ["make_land_map"]
    assert start(earth(20)) == ["make_land_map"]
    assert start(earth(10)) == []


@pytest.mark.parametrize("damage", ["short", "flipped", "another"])
def test_what_is_damaged_is_computed_again(start: Start, damage: str) -> None:
    start(CLOUDY)
    for path in cache_folder("earth").iterdir():
        content = bytearray(path.read_bytes())
        if damage == "another":
            with path.open("wb") as file:
                np.savez(file, codes=np.zeros((3, 5), dtype=np.uint8))
            continue
        content[len(content) // 2] ^= 1
        path.write_bytes(content[: len(content) // 2] if damage == "short" else content)
    assert start(CLOUDY) == [*ALL, "weather_codes"]
    assert start(CLOUDY) == []


def test_without_a_cache_all_is_computed_each_time(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    for _ in range(2):
        assert start(CLOUDY) == [*ALL, "weather_codes"]


class Stages:
    """Records what it is told of."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def begin_stage(self, name: str) -> None:
        self.names.append(name)

    def __call__(self, done: int, total: int) -> None:
        del done, total


@pytest.mark.parametrize("earth", [CLOUDY, Earth()], ids=["cloudy", "clear"])
def test_what_no_earlier_run_has_computed_is_so_before_the_first_frame(
    start: Start, gl: moderngl.Context, earth: Earth
) -> None:
    shown = Stages()
    textures = EarthTextures(gl)
    textures.prepare(earth, shown)
    assert shown.names == ["maps of the Earth"]
    textures.release()
    assert start(earth) == []


@pytest.mark.usefixtures("start")
def test_noise_and_maps_are_made_beside_each_other(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    together = Barrier(2, timeout=60.0)

    def beside(module: object, name: str) -> None:
        make = getattr(module, name)

        def made(*arguments: object) -> Any:
            together.wait()
            return make(*arguments)

        monkeypatch.setattr(module, name, made)

    beside(noise_projection, "make_chart")
    beside(earth_maps, "make_form_map")
    textures = EarthTextures(gl)
    textures.prepare(CLOUDY)
    textures.release()


@pytest.mark.parametrize("earth", [CLOUDY, Earth()], ids=["cloudy", "clear"])
def test_what_files_have_waits_for_a_frame_that_shows_the_earth(
    start: Start, gl: moderngl.Context, earth: Earth
) -> None:
    start(earth)
    shown = Stages()
    textures = EarthTextures(gl)
    textures.prepare(earth, shown)
    assert shown.names == []
    assert textures.cells is None
