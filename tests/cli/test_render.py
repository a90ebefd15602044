"""``simgl render``: the files it writes hold what the capture held."""

from __future__ import annotations

import json
import os
import sys
from functools import partial
from pathlib import Path

import moderngl
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from simgl import __version__, cli
from simgl.commands import application
from simgl.display_images import display_from_radiance
from simgl.errors import OutputError
from simgl.mono12p import unpack_mono12p
from simgl.output import complete_file, write_capture
from simgl.physics.frames import matrix_from_quaternion
from simgl.scenario.loader import load_scenario
from simgl.simulator import Capture, Product, Simulator
from tests.cli.small_scene import SCENE
from tests.scenes import USUAL_PRODUCTS

FILES = ["nav.dn.png", "nav.radiance.exr", "nav.view.png"]


@pytest.fixture
def exposure(gl: moderngl.Context, scene: Path) -> Capture:
    """A capture of the scene."""
    scenario = load_scenario(scene)
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(scenario.at(scenario.epoch_tai_ns), "nav", USUAL_PRODUCTS)


def test_render_writes_the_three_files_and_names_them(
    gl: moderngl.Context,
    scene: Path,
    exposure: Capture,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # Brackets in a path are a path, not markup.
    out = tmp_path / "new" / "run [bold] 1"
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))
    monkeypatch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005
    monkeypatch.setattr(sys, "argv", ["simgl", "render", str(scene), "--out", str(out)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert sorted(os.listdir(out)) == FILES
    assert sorted(capsys.readouterr().out.splitlines()) == [str(out / name) for name in FILES]
    assert exposure.digital is not None
    # Same scenario, seed and driver, same bits.
    np.testing.assert_array_equal(np.asarray(Image.open(out / "nav.dn.png")), exposure.digital.dn)


def test_a_colour_camera_leaves_a_picture_and_packed_dn(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace("[camera.nav]", '[camera.nav]\npreset = "imx264_colour"'))
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))
    monkeypatch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005
    command = ["simgl", "render", str(scene), "--out", str(tmp_path / "out"), "--packed"]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert sorted(os.listdir(tmp_path / "out")) == sorted(
        ["nav.colour.png", "nav.dn.mono12p", *FILES]
    )
    dn = np.asarray(Image.open(tmp_path / "out" / "nav.dn.png"))
    packed = (tmp_path / "out" / "nav.dn.mono12p").read_bytes()
    np.testing.assert_array_equal(unpack_mono12p(packed, 32, 48), dn)
    assert np.asarray(Image.open(tmp_path / "out" / "nav.colour.png")).shape == (32, 48, 3)


def test_the_exr_holds_radiance_depth_and_parts_bit_for_bit(
    exposure: Capture, tmp_path: Path
) -> None:
    write_capture(exposure, tmp_path, "nav")
    with OpenEXR.File(str(tmp_path / "nav.radiance.exr"), separate_channels=True) as file:
        channels = {name: c.pixels for name, c in file.parts[0].channels.items()}
    assert sorted(channels) == ["B", "G", "N", "R", "Z", "partId"]
    assert exposure.radiance is not None
    assert exposure.truth is not None
    for index, band in enumerate("RGBN"):
        assert channels[band].dtype == np.float32
        np.testing.assert_array_equal(channels[band], exposure.radiance.radiance[..., index])
    assert channels["Z"].dtype == np.float32
    np.testing.assert_array_equal(channels["Z"], exposure.truth.depth)
    assert channels["partId"].dtype == np.uint32
    np.testing.assert_array_equal(channels["partId"], exposure.truth.part_id)
    # The block is there: 19 m in front of the middle pixel, part 1 of spacecraft 1.
    assert channels["Z"][16, 24] == pytest.approx(19.0, abs=1e-4)
    assert channels["partId"][16, 24] == 65536 + 1


@pytest.mark.parametrize(
    "distortion",
    [
        {"k1": -0.2, "k2": 0.05, "k6": 0.01, "p1": 1e-3, "s2": -2e-3, "tau_x": 0.02},
        {"model": "fisheye", "k1": -0.01, "k4": 2e-3},
        {"model": "double_sphere", "xi": -0.2, "alpha": 0.55},
    ],
)
def test_the_exr_header_says_where_the_pixels_of_any_lens_look(
    gl: moderngl.Context, distortion: dict[str, str | float], scene: Path, tmp_path: Path
) -> None:
    intrinsics = "focal_length_px = [33.0, 31.0]\nprincipal_point_px = [23.1, 17.2]\nskew_px = 0.7"
    table = ", ".join(f"{key} = {json.dumps(value)}" for key, value in distortion.items())
    lens = f"{intrinsics}\noptics.distortion = {{ {table} }}"
    scene.write_text(scene.read_text().replace("focal_length_mm = 0.6", lens))
    loaded = load_scenario(scene)
    with Simulator(loaded, gl) as simulator:
        state = loaded.at(loaded.epoch_tai_ns)
        capture = simulator.capture(state, "nav", {Product.RADIANCE}, draw=3)
    write_capture(capture, tmp_path, "nav")
    with OpenEXR.File(str(tmp_path / "nav.radiance.exr")) as file:
        header = dict(file.header())
    assert header["draw"] == "3"
    fx, fy, cx, cy = map(float, header["intrinsicsFxFyCxCyPx"].split())
    assert (fx, fy, cx, cy) == pytest.approx((33.0, 31.0, 23.1, 17.2), rel=1e-12)
    assert float(header["skewPx"]) == pytest.approx(0.7, rel=1e-12)
    model, *coefficients = header["distortion"].split()
    read = {key: float(value) for key, _, value in (c.partition("=") for c in coefficients)}
    assert {"model": "pinhole"} | distortion == {"model": model} | read


def test_the_exr_header_says_what_it_is_with_units(exposure: Capture, tmp_path: Path) -> None:
    write_capture(exposure, tmp_path, "nav")
    with OpenEXR.File(str(tmp_path / "nav.radiance.exr")) as file:
        header = dict(file.header())
    expected = {
        "simglVersion": __version__,
        "scenario": "scene",
        "camera": "nav",
        "bandsNm": "R 600-700, G 500-600, B 400-500, N 700-1000",
        "unitsRGBN": "W m-2 sr-1, integrated over the band",
        "unitsZ": "m along the boresight, 0 where no spacecraft is",
        "epochUtc": "2026-03-20T12:00:00",
        # 2026-03-20T12:00:00 is POSIX second 1774008000, and TAI is 37 s ahead.
        "epochTaiNs": "1774008037000000000",
        "exposureTimeS": "0.0005",
        "positionGcrfM": "7000000.0 0.0 20.0",
        "fNumber": "4.0",
        "sunDirectionIcrf": "0.0 0.0 1.0",
        "seed": "0",
        "draw": "0",
        "skewPx": "0.0",
        "distortion": "none",
        "partNames": "65537=block/block",
    }
    assert {key: header[key] for key in expected} == expected
    fx, fy, cx, cy = map(float, header["intrinsicsFxFyCxCyPx"].split())
    assert fx == fy == pytest.approx(160.0)  # 0.6 mm / 3.75 um
    assert (cx, cy) == (24.0, 16.0)
    # The camera looks along -z: its boresight z is -z of ICRF.
    q = np.array([float(v) for v in header["quaternionCameraFromIcrfXyzw"].split()])
    R_camera_from_icrf = matrix_from_quaternion(q)
    np.testing.assert_allclose(
        R_camera_from_icrf, exposure.info.R_camera_from_icrf, rtol=0.0, atol=1e-15
    )
    np.testing.assert_allclose(R_camera_from_icrf[2], [0.0, 0.0, -1.0], rtol=0.0, atol=1e-15)
    light = [float(v) for v in header["sunIrradianceRGBNWM2"].split()]
    # 5772 K and 1361 W/m2: close to the source study's 5777 K and 1367 W/m2.
    np.testing.assert_allclose(light, [154.439, 174.774, 171.947, 313.358], rtol=0.01)


def test_the_dn_png_has_16_bits_and_equals_the_capture(exposure: Capture, tmp_path: Path) -> None:
    write_capture(exposure, tmp_path, "nav")
    content = (tmp_path / "nav.dn.png").read_bytes()
    # Bit depth and colour type stand in the header chunk: 16 bits, grey.
    assert (content[24], content[25]) == (16, 0)
    picture = Image.open(tmp_path / "nav.dn.png")
    assert picture.size == (48, 32)
    assert exposure.digital is not None
    np.testing.assert_array_equal(np.asarray(picture), exposure.digital.dn)


def test_the_view_png_is_the_radiance_as_srgb(exposure: Capture, tmp_path: Path) -> None:
    write_capture(exposure, tmp_path, "nav")
    picture = np.asarray(Image.open(tmp_path / "nav.view.png"))
    assert picture.shape == (32, 48, 3)
    assert exposure.radiance is not None
    np.testing.assert_array_equal(picture, display_from_radiance(exposure.radiance.radiance))
    # A Lambert face of 0.5 towards the Sun of 1361 W/m2, where 1367 W/m2 on white is full scale.
    linear = 0.5 * 1361.0 / 1367.0
    expected = 255.0 * (1.055 * linear ** (1 / 2.4) - 0.055)
    # Rounding to a whole code, and 5 K of temperature that shift the bands by 1e-3: 0.6 codes.
    np.testing.assert_allclose(picture[16, 24], expected, rtol=0.0, atol=0.6)


def test_an_exposure_writes_only_what_it_holds(exposure: Capture, tmp_path: Path) -> None:
    paths = write_capture(Capture(info=exposure.info, digital=exposure.digital), tmp_path, "a")
    assert paths == [tmp_path / "a.dn.png"]
    assert exposure.radiance is not None
    paths = write_capture(Capture(info=exposure.info, radiance=exposure.radiance), tmp_path, "b")
    assert paths == [tmp_path / "b.radiance.exr", tmp_path / "b.view.png"]
    with OpenEXR.File(str(paths[0]), separate_channels=True) as file:
        assert sorted(file.parts[0].channels) == ["B", "G", "N", "R"]


def test_a_file_that_fails_half_way_leaves_the_old_one_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    path.write_text("yesterday")

    def write_half() -> None:
        with complete_file(path) as temporary:
            temporary.write_text("half")
            assert path.read_text() == "yesterday"
            raise RuntimeError("the disk is gone")

    with pytest.raises(RuntimeError, match="the disk is gone"):
        write_half()
    assert os.listdir(tmp_path) == ["a.exr"]
    assert path.read_text() == "yesterday"


def test_a_complete_file_replaces_the_old_one_and_others_may_read_it(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "a.txt"
    for content in ("one", "two"):
        with complete_file(path) as temporary:
            temporary.write_text(content)
        assert path.read_text() == content
    assert os.listdir(path.parent) == ["a.txt"]
    assert path.stat().st_mode & 0o777 == 0o644


def test_whoever_reads_the_old_file_meanwhile_reads_all_of_it(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("yesterday")
    with path.open() as reader:
        with complete_file(path) as temporary:
            temporary.write_text("today")
        # Renamed over, not written over.
        assert reader.read() == "yesterday"
    assert path.read_text() == "today"


def test_a_folder_in_place_of_the_file_is_refused(exposure: Capture, tmp_path: Path) -> None:
    path = tmp_path / "a.dn.png"
    path.mkdir()
    digital = Capture(info=exposure.info, digital=exposure.digital)
    with pytest.raises(OutputError) as caught:
        write_capture(digital, tmp_path, "a")
    assert str(caught.value) == f"{path}: cannot be written (Is a directory)"
    assert sorted(os.listdir(tmp_path)) == ["a.dn.png", "scene.toml"]


def test_layers_are_written_where_they_are_asked_for(
    gl: moderngl.Context,
    scene: Path,
    exposure: Capture,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))
    monkeypatch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005
    out = tmp_path / "out"
    arguments = ["simgl", "render", str(scene), "--out", str(out), "--layers"]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert sorted(os.listdir(out)) == sorted([*FILES, "nav.layers.exr", "nav.layers.png"])
    with OpenEXR.File(str(out / "nav.layers.exr"), separate_channels=True) as file:
        channels = {name: c.pixels for name, c in file.parts[0].channels.items()}
        header = dict(file.header())
    names = ["sun", "earth", "inter_reflected", "lamp", "emitted", "background"]
    assert set(channels) == {f"{n}.{b}" for n in names for b in "RGBN"} | set("RGBN")
    assert header["layers"] == f"R, G, B, N of {', '.join(names)} and their sum"
    assert header["unitsRGBN"] == "W m-2 sr-1, integrated over the band"
    assert header["epochTaiNs"] == "1774008037000000000"
    assert exposure.radiance is not None
    for index, band in enumerate("RGBN"):
        assert channels[f"sun.{band}"].dtype == np.float32
        # The block in deep space has the Sun's light alone.
        np.testing.assert_array_equal(channels[f"sun.{band}"], channels[band])
        np.testing.assert_allclose(
            channels[band], exposure.radiance.radiance[..., index], rtol=1e-6, atol=1e-6
        )
        assert not any(channels[f"{name}.{band}"].any() for name in names[1:])
    # The whole and the Sun's layer, each with its name above it.
    sheet = np.asarray(Image.open(out / "nav.layers.png"))
    assert sheet.shape == (32 + 11, 3 * 48, 3)
    np.testing.assert_array_equal(sheet[11:, :48], sheet[11:, 48:96])
    assert sheet[11 + 16, 24].min() > 128


def test_a_layers_file_that_cannot_be_written_is_refused_by_name(
    gl: moderngl.Context, scene: Path, tmp_path: Path
) -> None:
    scenario = load_scenario(scene)
    with Simulator(scenario, gl) as simulator:
        exposure = simulator.capture(scenario.at(scenario.epoch_tai_ns), "nav", {Product.LAYERS})
    (tmp_path / "out" / "a.layers.exr").mkdir(parents=True)
    with pytest.raises(OutputError) as caught:
        write_capture(exposure, tmp_path / "out", "a")
    path = tmp_path / "out" / "a.layers.exr"
    assert str(caught.value) == f"{path}: cannot be written (Is a directory)"
    assert os.listdir(tmp_path / "out") == ["a.layers.exr"]
