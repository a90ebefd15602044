"""FMUs of a camera, in FMPy: the checker, the images, time, two at once, servers that die."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client, launched_server
from simgl_bridge.fmu.archive import camera_model, write_fmu
from simgl_bridge.fmu.command import fmu
from simgl_bridge.fmu.compiler import find_compilers, fmi_platform

from simgl import Scenario, load_scenario
from simgl.errors import ConfigError
from tests.bridge.compiled import WARNINGS
from tests.bridge.fmu_importer import Importer, imported
from tests.bridge.harness import LIT_SCENARIO, TURNING, Proxy, Running, finish, free_address, start
from tests.patience import limit, run_to_end, wait_until

fmpy = pytest.importorskip(
    "fmpy", minversion="0.3.32", reason="needs FMPy (pip install fmpy), which needs numpy 2.1.3"
)
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

# Joints, and a name that is no identifier.
_JOINTED = """
[spacecraft.sat-2]
model = "cubesat_12u"
position_icrf_m = [1.0, 1.0, 10.0]
"""
SCENE = LIT_SCENARIO.replace("[render]", f"{_JOINTED}[render]\ninter_reflection = false")
# Of the chaser.
POSE = TURNING


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fmu")


@pytest.fixture(scope="module")
def exported(folder: Path) -> tuple[Path, Scenario]:
    """An FMU with a binary, and its scenario; the target is not its importer's to place."""
    compilers = find_compilers(folder)
    if isinstance(compilers, str):
        pytest.skip(compilers)
    (folder / "scene.toml").write_text(SCENE)
    scenario = load_scenario(folder / "scene.toml")
    model = camera_model(scenario, camera="nav", bodies=("chaser", "sat-2"), sends_sun=True)
    write_fmu(model, folder / "scene.fmu")
    return folder / "scene.fmu", scenario


@pytest.fixture(scope="module")
def server(exported: tuple[Path, Scenario]) -> Iterator[Running]:
    """A server of the same scenario."""
    running = start(exported[1])
    yield running
    finish(running)


@pytest.fixture
def camera(exported: tuple[Path, Scenario], tmp_path: Path) -> Iterator[Importer]:
    """An instance of the FMU."""
    with imported(exported[0], tmp_path) as importer:
        yield importer


def place(importer: Importer, pose: BodyPose) -> None:
    """Set the pose of the chaser."""
    importer.set("chaser.position_icrf_m", pose.position_m)
    importer.set("chaser.velocity_icrf_m_s", pose.velocity_m_s)
    importer.set("chaser.q_icrf_from_body_xyzw", pose.q_icrf_from_body_xyzw)
    importer.set("chaser.angular_velocity_body_rad_s", pose.angular_velocity_rad_s)


def at(x: float, z: float) -> BodyPose:
    """The pose of the chaser at another place."""
    return replace(POSE, position_m=(x, 0.0, z))


def gone(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False


def own_server(importer: Importer) -> int:
    """Process of the server that an FMU started."""
    lines = [line for _, category, line in importer.log if category == "server"]
    return int(next(m[1] for line in lines if (m := re.search(r"process (\d+)", line))))


def test_the_checker_accepts_what_is_written(exported: tuple[Path, Scenario]) -> None:
    assert validate_fmu(str(exported[0])) == []


def test_build_description_and_sources_are_complete(
    exported: tuple[Path, Scenario], tmp_path: Path
) -> None:
    from lxml import etree

    schema = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3BuildDescription.xsd"
    zipfile.ZipFile(exported[0]).extractall(tmp_path)
    build = etree.parse(str(tmp_path / "sources" / "buildDescription.xml"))
    etree.XMLSchema(etree.parse(str(schema))).assertValid(build)
    # The C files by this description and folder alone; test_cpp compiles the client's.
    for sources in build.iter("SourceFileSet"):
        for source in sources.iter("SourceFile"):
            assert (tmp_path / "sources" / source.get("name")).exists()
            if sources.get("language") == "C99":
                command = ["gcc", "-std=c99", *WARNINGS, "-c", source.get("name"), "-o", "made.o"]
                run_to_end(command, cwd=tmp_path / "sources")


def test_the_binary_needs_nothing_that_importers_lack(
    exported: tuple[Path, Scenario], tmp_path: Path
) -> None:
    zipfile.ZipFile(exported[0]).extractall(tmp_path)
    binaries = tmp_path / "binaries" / str(fmi_platform())
    packed = {path.name for path in binaries.iterdir()}
    for path in binaries.iterdir():
        lines = run_to_end(["readelf", "-d", str(path)]).stdout
        needed = set(re.findall(r"NEEDED.*\[(.*)\]", lines)) - packed
        usual = r"lib(c|m|rt|pthread|dl|stdc\+\+|gcc_s)\.so\.\d|ld-linux.*"
        assert all(re.fullmatch(usual, name) for name in needed), needed
    assert any(name.startswith("libzmq") for name in packed)


def test_the_image_is_that_of_the_native_client(
    camera: Importer, exported: tuple[Path, Scenario], server: Running
) -> None:
    scenario = exported[1]
    sun = (1e11, -5e10, 9e10)
    camera.start(server_address=server.address, motion_blur=True)
    assert camera.get("server") == f"found {server.address}"
    assert camera.get("status") == camera.get("frame_number") == 0
    assert not camera.image().any()
    place(camera, POSE)
    camera.set("sun.position_icrf_m", sun)
    camera.set("'sat-2'.joint.panel_left", 0.75)
    camera.set("lamp.flood", 0.5)
    camera.set("exposure_time_s", 0.001)
    camera.set("gain_dn_per_e", 0.125)
    camera.set("draw", 2**32 - 1)
    camera.step(0.3)
    now = scenario.epoch_tai_ns
    standing = BodyPose.from_pose(scenario.poses(now)["sat-2"])
    joints = {"panel_left": 0.75, "panel_right": 0.0}
    with Client(server.address, timeout_s=limit(20.0)) as client:
        image = client.render(
            now + 300_000_000,
            "nav",
            {"chaser": POSE, "sat-2": replace(standing, joints=joints)},
            0.001,
            gain_dn_per_e=0.125,
            lamps={"flood": 0.5},
            sun_position_m=sun,
            moving=True,
            draw=2**32 - 1,
        )
    pixels = camera.image()
    assert np.array_equal(pixels, image.dn)
    assert len(np.unique(pixels)) > 10
    assert camera.get("image_binary") == image.dn.tobytes()
    assert camera.get("frame_hash") == image.plane_hash()
    assert (
        camera.get("frame_hash") == hashlib.blake2b(image.dn.tobytes(), digest_size=16).hexdigest()
    )
    assert camera.get("state_hash") == image.state_hash
    assert image.saturated_pixels is not None
    assert camera.get("saturated_share") == image.saturated_pixels / image.dn.size
    assert camera.get("mid_exposure_tai_ns") == image.tai_ns
    assert camera.get("mid_exposure_s") == pytest.approx(0.3, abs=1e-12)
    available = (image.available_tai_ns - now) * 1e-9
    assert camera.get("available_s") == pytest.approx(available, abs=1e-12)
    assert camera.get("camera.position_icrf_m") == list(image.camera_position_m)
    assert camera.get("camera.intrinsics") == image.intrinsics.ravel().tolist()
    assert (camera.get("status"), camera.get("frame_number"), camera.get("time")) == (1, 1, 0.4)


def test_simulate_fmu_shows_at_the_end_of_a_step_what_was_given_at_its_start(
    exported: tuple[Path, Scenario], camera: Importer, server: Running
) -> None:
    distances = (60.0, 55.0, 50.0)
    inputs = np.array(
        [(0.1 * step, (0.0, 0.0, distance)) for step, distance in enumerate(distances)],
        dtype=[("time", "f8"), ("chaser.position_icrf_m", "f8", (3,))],
    )
    steps = fmpy.simulate_fmu(
        str(exported[0]),
        stop_time=0.3,
        output_interval=0.1,
        input=inputs,
        output=["image", "mid_exposure_s", "frame_number"],
        start_values={"server_address": server.address},
    )
    assert steps["frame_number"].tolist() == [0, 1, 2, 3]
    assert steps["mid_exposure_s"] == pytest.approx([0.0, 0.0, 0.1, 0.2], abs=1e-12)
    camera.start(server_address=server.address)
    for step, distance in enumerate(distances):
        camera.set("chaser.position_icrf_m", (0.0, 0.0, distance))
        camera.step(0.1 * step)
        assert np.array_equal(steps["image"][step + 1], camera.image())


def test_time_is_the_importers(
    camera: Importer, server: Running, exported: tuple[Path, Scenario]
) -> None:
    camera.start(server_address=server.address, exposure_offset_s=0.25, epoch_tai_ns=2 * 10**18)
    for begin, length in ((0.0, 0.5), (0.5, 0.01), (0.51, 7.0)):
        camera.step(begin, length)
        assert camera.get("mid_exposure_tai_ns") == 2 * 10**18 + round(1e9 * (begin + 0.25))
        assert camera.get("time") == begin + length
    with pytest.raises(FMICallException, match=r"fmi3DoStep failed with status 3 \(error\)"):
        camera.step(0.5)
    assert "TIME_BACKWARDS" in camera.errors()[-1]
    # A reset begins again, with another time.
    camera.reset()
    camera.start(server_address=server.address)
    camera.step(0.0)
    assert camera.get("mid_exposure_tai_ns") == exported[1].epoch_tai_ns


def test_without_a_trigger_the_image_is_held_and_says_so(camera: Importer, server: Running) -> None:
    before = server.simulator.captured
    camera.start(server_address=server.address)
    camera.set("trigger", False)
    camera.step(0.0)
    assert (camera.get("status"), camera.get("frame_number")) == (0, 0)
    camera.set("trigger", True)
    camera.step(0.1)
    first = camera.get("frame_hash")
    camera.set("trigger", False)
    camera.set("chaser.position_icrf_m", (0.0, 0.0, 30.0))
    camera.step(0.2)
    assert camera.get("frame_hash") == first
    assert camera.get("mid_exposure_s") == pytest.approx(0.1)
    assert (camera.get("status"), camera.get("frame_number")) == (2, 1)
    assert server.simulator.captured == before + 1


def test_two_at_once_have_servers_and_images_of_their_own(
    exported: tuple[Path, Scenario], tmp_path: Path
) -> None:
    path, scenario = exported
    with (
        imported(path, tmp_path / "a", "a") as left,
        imported(path, tmp_path / "b", "b") as right,
        ThreadPoolExecutor(2) as threads,
    ):
        both = (left, right)
        nobody = free_address()

        def fly(importer: Importer, x: float) -> list[str]:
            importer.start(server_address=nobody)
            hashes = []
            for step in range(3):
                place(importer, at(x, 40.0 - step))
                importer.step(0.1 * step)
                hashes.append(importer.get("frame_hash"))
            return hashes

        flown = list(threads.map(fly, both, (-1.0, 1.0)))
        processes = [own_server(importer) for importer in both]
        addresses = [importer.get("server").removeprefix("started ") for importer in both]
        assert len(set(processes)) == len(set(addresses)) == 2
        assert all(any("no server" in line for *_, line in i.log) for i in both)
        # Each against the other's server.
        for x, hashes, address in zip((-1.0, 1.0), flown, addresses[::-1], strict=True):
            with Client(address, timeout_s=limit(20.0)) as client:
                nav = client.welcome.cameras[0]
                for step, shown in enumerate(hashes):
                    image = client.render(
                        scenario.epoch_tai_ns + 100_000_000 * step,
                        "nav",
                        {"chaser": at(x, 40.0 - step)},
                        nav.exposure_time_s,
                        gain_dn_per_e=nav.gain_dn_per_e,
                        sun_position_m=left.get("sun.position_icrf_m"),
                    )
                    assert image.plane_hash() == shown
        folders = [Path(address.removeprefix("ipc://")).parent for address in addresses]
        assert all(folder.stat().st_mode & 0o777 == 0o700 for folder in folders)
    assert all(map(gone, processes))
    assert not any(folder.exists() for folder in folders)


def test_a_killed_server_is_an_error_at_once_and_no_old_image(camera: Importer) -> None:
    camera.start(server_address="", timeout_s=limit(60.0))
    camera.step(0.0)
    assert camera.image().any()
    os.kill(own_server(camera), signal.SIGKILL)
    begin = time.monotonic()
    with pytest.raises(FMICallException, match="status 3"):
        camera.step(0.1)
    # Not after its timeout.
    assert time.monotonic() - begin < limit(10.0)
    assert re.search("ended by signal 9|the connection broke", camera.errors()[-1])
    for name in ("image", "image_binary", "frame_hash", "mid_exposure_s"):
        with pytest.raises(FMICallException, match="status 3"):
            camera.get(name)
    assert camera.errors()[-1] == "mid_exposure_s: the step failed, there is no image"
    with pytest.raises(FMICallException, match="status 3"):
        camera.step(0.2)
    assert camera.errors()[-1] == "no step is possible after an error, only a reset"
    camera.reset()
    camera.start(server_address="")
    camera.step(0.0)
    assert camera.image().any()


def test_a_found_server_that_dies_or_freezes_is_an_error_in_time(
    exported: tuple[Path, Scenario], camera: Importer
) -> None:
    with launched_server(exported[1].source or "") as (process, address):
        # Below 10 s, after which the client's heartbeats break the connection to a frozen server.
        timeout = min(limit(2.0), 8.0)
        camera.start(server_address=address, timeout_s=timeout)
        camera.step(0.0)
        process.send_signal(signal.SIGSTOP)
        begin = time.monotonic()
        with pytest.raises(FMICallException, match="status 3"):
            camera.step(0.1)
        assert time.monotonic() - begin < timeout + limit(2.0)
        assert f"no answer within {timeout:g} s, waiting for render" in camera.errors()[-1]
        process.send_signal(signal.SIGCONT)
        camera.reset()
        camera.start(server_address=address)
        camera.step(0.0)
        process.kill()
        process.wait()
        begin = time.monotonic()
        with pytest.raises(FMICallException, match="status 3"):
            camera.step(0.1)
        # Not after the timeout of 60 s.
        assert time.monotonic() - begin < 3.0 + limit(2.0)
        assert address in camera.errors()[-1]
        with pytest.raises(FMICallException, match="status 3"):
            camera.get("image")


@pytest.mark.parametrize("losses", [1, 2])
def test_a_lost_renderer_is_an_error_only_where_the_next_one_is_lost_too(
    camera: Importer, server: Running, losses: int
) -> None:
    left, asked = losses, 0

    def lose(header: Any) -> Any:
        nonlocal left, asked
        if header["type"] != "render":
            return None
        asked += 1
        if not left:
            return None
        left -= 1
        said = {"detail": "the renderer died of SIGKILL", "field": "", "retryable": True}
        return {"type": "error", "id": header["id"], "code": "RENDERER_LOST", **said}

    proxy = Proxy(server.address, answer=lose)
    try:
        camera.start(server_address=proxy.address)
        if losses == 1:
            camera.step(0.0)
            through = camera.get("frame_hash")
        else:
            with pytest.raises(FMICallException, match="status 3"):
                camera.step(0.0)
            assert camera.errors()[-1] == (
                f"{proxy.address}: RENDERER_LOST: the renderer died of SIGKILL"
            )
            with pytest.raises(FMICallException, match="status 3"):
                camera.get("image")
        assert asked == 2
    finally:
        proxy.close()
    if losses == 1:
        camera.reset()
        camera.start(server_address=server.address)
        camera.step(0.0)
        assert camera.get("frame_hash") == through


def test_a_server_ends_with_an_importer_that_is_killed(
    exported: tuple[Path, Scenario], tmp_path: Path
) -> None:
    program = (
        "import pathlib, sys, time\n"
        "from tests.bridge.fmu_importer import Importer\n"
        "importer = Importer(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), 'camera')\n"
        "importer.start(server_address='')\n"
        "print([line for *_, line in importer.log if 'process' in line][0], flush=True)\n"
        "time.sleep(1000)\n"
    )
    command = [sys.executable, "-c", program, str(exported[0]), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as importer:
        assert importer.stdout is not None
        line = importer.stdout.readline()
        process = int(line.split()[-1])
        assert not gone(process)
        importer.kill()
    wait_until(lambda: gone(process), "the end of the server", 20.0)
    shutil.rmtree(re.findall(r"ipc://(/tmp/simgl-fmu-\w+)", line)[0])


def test_what_is_refused_names_the_field(camera: Importer, server: Running) -> None:
    for name, value, named in (
        ("chaser.q_icrf_from_body_xyzw", (0.0,) * 4, "bodies.chaser.q_icrf_from_body_xyzw"),
        ("chaser.position_icrf_m", (np.nan, 0.0, 0.0), "bodies.chaser.position_m"),
        ("exposure_time_s", -1.0, "cameras[0].exposure_time_s"),
        ("lamp.flood", 2.0, "lamps.flood"),
        ("draw", -1, "draw must lie in 0..4294967295, got -1"),
    ):
        camera.start(server_address=server.address)
        camera.set(name, value)
        with pytest.raises(FMICallException, match="status 3"):
            camera.step(0.0)
        assert named in camera.errors()[-1]
        camera.reset()
    camera.start(server_address=server.address)
    with pytest.raises(FMICallException):
        camera.set("server_address", "tcp://127.0.0.1:1")
    assert camera.errors()[-1] == "server_address: cannot be set now"
    with pytest.raises(FMICallException):
        camera.set("saturated_share", 0.5)


def test_a_server_that_cannot_be_had_is_one_line(
    camera: Importer, tmp_path: Path, running: Running
) -> None:
    changed = tmp_path / "changed.toml"
    changed.write_text(SCENE.replace("2.0, 1.0, 1.0", "2.0, 1.0, 1.5"))
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[epoch]\n")
    cases: list[tuple[dict[str, Any], str]] = [
        ({"scenario": ""}, "and python or scenario is empty: none can be started"),
        (
            {"python": "/nowhere/python"},
            'cannot start "/nowhere/python": No such file or directory',
        ),
        ({"scenario": str(wrong)}, "the server of this FMU has ended: simgl: "),
        ({"scenario": str(changed)}, "is not what it was when this FMU was written"),
    ]
    for parameters, line in cases:
        with pytest.raises(FMICallException, match=r"fmi3ExitInitializationMode.*status 3"):
            # A server of another scene is not used.
            camera.start(server_address=running.address, **parameters)
        assert line in camera.errors()[-1]
        assert any("serves another scene; it is not used" in text for *_, text in camera.log)
        camera.reset()


def test_a_model_description_of_another_fmu_is_refused(
    exported: tuple[Path, Scenario], tmp_path: Path
) -> None:
    ours = zipfile.ZipFile(exported[0])
    with zipfile.ZipFile(tmp_path / "mixed.fmu", "w") as mixed:
        for name in ours.namelist():
            content = ours.read(name)
            if name == "modelDescription.xml":
                content = re.sub(rb'instantiationToken="[^"]*"', b'instantiationToken="x"', content)
            mixed.writestr(name, content)
    with pytest.raises(Exception, match="Failed to instantiate FMU"):
        Importer(tmp_path / "mixed.fmu", tmp_path / "mixed", "mixed")


def test_without_a_compiler_sources_are_written_and_said(
    scenario_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr("shutil.which", lambda _: None)
    path = tmp_path / "sources.fmu"
    fmu(scenario_path, path, camera="nav")
    assert capsys.readouterr().out.splitlines() == [
        f"{path}: camera nav, 12 inputs, sources only",
        "no binary: no C++ compiler (Debian: g++); importers compile the sources",
    ]
    assert validate_fmu(str(path)) == []
    assert not any(name.startswith("binaries") for name in zipfile.ZipFile(path).namelist())


def test_bad_options_name_what_is_allowed_and_leave_no_file(
    scenario_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "a.fmu"
    cases: list[tuple[dict[str, Any], str]] = [
        ({}, "simgl fmu: --camera is missing; .* has nav, side"),
        ({"camera": "nva"}, 'simgl fmu: --camera "nva" is not in .*did you mean "nav"'),
        ({"camera": "nav", "body": ["chasr"]}, '--body "chasr" is not in .*did you mean "chaser"'),
        ({"camera": "nav", "out": tmp_path / "a.zip"}, "--out must end in .fmu, got"),
    ]
    for arguments, line in cases:
        with pytest.raises(ConfigError, match=line):
            fmu(scenario_path, **({"out": path} | arguments))
    assert not list(tmp_path.iterdir())


def test_names_that_fmi_does_not_have_are_refused(folder: Path) -> None:
    text = LIT_SCENARIO.replace("chaser", "camera")
    (folder / "named.toml").write_text(text)
    model = camera_model(load_scenario(folder / "named.toml"), camera="nav")
    with pytest.raises(ConfigError, match=r"camera\.position_icrf_m would be two variables"):
        write_fmu(model, folder / "named.fmu")
    assert not (folder / "named.fmu").exists()
