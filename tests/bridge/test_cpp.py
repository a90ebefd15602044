"""The C++17 client and its C interface, built with the system's compiler and libzmq, and run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client, ClientKeys, Shot, launched_server
from simgl_bridge.access import Access, make_keys
from zmq.auth import load_certificate

from simgl import Scenario, load_scenario
from tests.bridge.compiled import c_program
from tests.bridge.harness import LIT_SCENARIO, TURNING, Running
from tests.bridge.test_responsive_server import SLOW_LOAD, served
from tests.patience import limit, run_to_end

Starter = Callable[..., Running]
ROOT = Path(__file__).parents[2]
# Deadlines of a probe [s]: an answer is soon there; this one would be waited for in vain.
SOON, LATE = f"{limit(20.0):g}", f"{limit(60.0):g}"

PROBE = """
#include <simgl.hpp>
#include <cstdlib>
#include <iostream>
// address, timeout, then lines of commands; one line of answer each.
int main(int, char **argv) {
    simgl::Options options;
    options.timeout_s = std::atof(argv[2]);
    if (argv[3]) { options.server_key = argv[3]; options.public_key = argv[4];
                   options.secret_key = argv[5]; }
    try {
        simgl::Client client(argv[1], options);
        std::cout << client.welcome().cameras.at(0).width << std::endl;
        std::string word;
        while (std::cin >> word) {
            try {
                const std::int64_t now = client.welcome().epoch_tai_ns;
                if (word == "all") {
                    simgl::Pose pose{{0.5, -0.25, 40.0}, {0.0, 0.0, -0.1}, {0.0, 0.0, 0.0, 1.0}};
                    simgl::Shot nav{"nav", 0.001, {}, {"dn", "radiance"}};
                    simgl::Shot side{"side", {}, 0.125, {"depth", "part_id"}};
                    const auto tick = client.render(now + 7, {nav, side}, {{"chaser", pose}},
                                                    simgl::Vector{1e11, -5e10, 9e10});
                    unsigned long dn = 0, parts = 0;
                    for (auto v : tick.image("nav").plane("dn").u16()) dn += v;
                    double radiance = 0.0, depth = 0.0;
                    for (auto v : tick.image("nav").plane("radiance").f32()) radiance += v;
                    for (auto v : tick.image("side").plane("depth").f32()) depth += v;
                    for (auto v : tick.image("side").plane("part_id").u32()) parts += v;
                    std::cout.precision(17);
                    std::cout << tick.state_hash << ' ' << dn << ' ' << radiance << ' ' << depth
                              << ' ' << parts << ' ' << tick.image("nav").exposure_end_tai_ns - now
                              << ' ' << tick.image("side").gain_dn_per_e << std::endl;
                } else if (word == "moving") {
                    simgl::Pose pose{{0.5, -0.25, 40.0}, {0.0, 0.0, -0.1}, {0.0, 0.0, 0.0, 1.0}};
                    pose.angular_velocity_rad_s = {0.25, -0.5, 0.125};
                    const auto tick = client.render(now + 7, {{"nav", 0.1}}, {{"chaser", pose}},
                                                    simgl::Scene{{}, {}, true});
                    unsigned long dn = 0;
                    for (auto v : tick.image("nav").plane("dn").u16()) dn += v;
                    std::cout << tick.state_hash << ' ' << dn << std::endl;
                } else if (word == "nav") {
                    const auto tick = client.render(now, {{"nav"}}, {}, {}, true);
                    std::cout << tick.sequence << ' ' << client.restarts() << std::endl;
                } else {
                    client.render(now, {{word}});
                }
            } catch (const simgl::Refused &e) {
                std::cout << "refused " << e.code << ' ' << e.field << std::endl;
            } catch (const std::exception &e) {
                std::cout << "error " << e.what() << std::endl;
            }
        }
    } catch (const std::exception &e) {
        std::cout << "error " << e.what() << std::endl;
    }
}
"""

C_PROGRAM = """
#include <simgl.h>
#include <stdio.h>
#include <stdlib.h>
int main(int argc, char **argv) {
    char error[300] = "";
    simgl_client *client = simgl_connect(argv[1], 20.0, error, sizeof error);
    simgl_body chaser = {.name = "chaser", .position_m = {0.5, -0.25, 40.0},
                         .velocity_m_s = {0.0, 0.0, -0.1},
                         .q_icrf_from_body_xyzw = {0.0, 0.0, 0.0, 1.0}};
    simgl_image info;
    int32_t width, height;
    uint16_t *pixels;
    unsigned long sum = 0;
    int i, code;
    (void)argc;
    if (client == NULL) { printf("%s", error); return 1; }
    if (simgl_camera_size(client, "nav", &width, &height) != SIMGL_OK) return 2;
    pixels = malloc(sizeof *pixels * (size_t)width * (size_t)height);
    code = simgl_render_dn(client, simgl_epoch_tai_ns(client), "nav", &chaser, 1, 0.0, pixels,
                           (size_t)width * (size_t)height, &info, error, sizeof error);
    for (i = 0; i < width * height; ++i) sum += pixels[i];
    printf("%d %d %d %lu %s ", code, (int)info.width, (int)info.height, sum, info.state_hash);
    code = simgl_render_dn(client, simgl_epoch_tai_ns(client), "nva", &chaser, 1, 0.0, pixels,
                           (size_t)width * (size_t)height, &info, error, sizeof error);
    printf("%d %s", code, error);
    simgl_close(client);
    free(pixels);
    return 0;
}
"""

C_MISTAKES = """
#include <math.h>
#include <simgl.h>
#include <stdio.h>
static uint16_t pixels[64 * 48 + 1];
static char error[300];
static int ask(simgl_client *client, const simgl_body *bodies, size_t count,
               const simgl_scene *scene, double exposure, uint16_t *into, size_t room) {
    int64_t now = simgl_epoch_tai_ns(client);
    int code = simgl_render_scene_dn(client, now, "nav", bodies, count, scene, exposure, into, room,
                                     NULL, error, sizeof error);
    printf("%d %s\\n", code, code == SIMGL_OK ? "" : error);
    return code;
}
int main(int argc, char **argv) {
    simgl_client *client = simgl_connect(argv[argc - 1], 20.0, error, sizeof error);
    simgl_body body = {.name = "chaser", .position_m = {0.5, -0.25, 40.0},
                       .q_icrf_from_body_xyzw = {0.0, 0.0, 0.0, 1.0}};
    simgl_body twice[2], nameless = body, listless = body, shapeless = body;
    simgl_setting setting = {NULL, 1.0};
    simgl_scene lamps = {.lamps = &setting, .lamp_count = 1}, gain = {.gain_dn_per_e = -1.0};
    int32_t width, height;
    twice[0] = twice[1] = body;
    nameless.name = NULL;
    listless.joint_count = 1;
    shapeless.q_icrf_from_body_xyzw[3] = 0.0;
    ask(NULL, &body, 1, NULL, 0.0, pixels, 64 * 48);
    ask(client, NULL, 1, NULL, 0.0, pixels, 64 * 48);
    ask(client, &body, 1, NULL, 0.0, NULL, 64 * 48);
    ask(client, &body, 1, NULL, 0.0, pixels, 64 * 48 - 1);
    ask(client, twice, 2, NULL, 0.0, pixels, 64 * 48);
    ask(client, &nameless, 1, NULL, 0.0, pixels, 64 * 48);
    ask(client, &listless, 1, NULL, 0.0, pixels, 64 * 48);
    ask(client, &body, 1, &lamps, 0.0, pixels, 64 * 48);
    ask(client, &shapeless, 1, NULL, 0.0, pixels, 64 * 48);
    ask(client, &body, 1, NULL, -0.001, pixels, 64 * 48);
    ask(client, &body, 1, NULL, nan(""), pixels, 64 * 48);
    ask(client, &body, 1, &gain, 0.0, pixels, 64 * 48);
    ask(client, &body, 1, NULL, 0.0, pixels, 64 * 48 + 1);
    if (simgl_connect(NULL, 1.0, error, sizeof error) != NULL) return 1;
    printf("%s\\n%d %d %d\\n", error, simgl_camera_size(NULL, "nav", &width, &height),
           simgl_camera_size(client, NULL, &width, &height),
           simgl_camera_size(client, "nva", &width, &height));
    simgl_close(client);
    simgl_close(NULL);
    return 0;
}
"""

C_SCENES = """
#include <simgl.h>
#include <stdio.h>
static uint16_t pixels[64 * 48];
static void show(simgl_client *client, const simgl_body *body, const simgl_scene *scene) {
    char error[300] = "";
    simgl_image info;
    unsigned long sum = 0;
    int i, code = simgl_render_scene_dn(client, simgl_epoch_tai_ns(client), "nav", body, 1, scene,
                                        0.1, pixels, 64 * 48, &info, error, sizeof error);
    for (i = 0; i < 64 * 48; ++i) sum += pixels[i];
    if (code == SIMGL_OK) printf("%lu %s %g\\n", sum, info.state_hash, info.gain_dn_per_e);
    else printf("%d %s\\n", code, error);
}
int main(int argc, char **argv) {
    char error[300] = "";
    simgl_client *client = simgl_connect(argv[argc - 1], 20.0, error, sizeof error);
    simgl_body chaser = {.name = "chaser", .position_m = {0.5, -0.25, 40.0},
                         .velocity_m_s = {0.0, 0.0, -0.1},
                         .q_icrf_from_body_xyzw = {0.0, 0.0, 0.0, 1.0},
                         .angular_velocity_rad_s = {0.25, -0.5, 0.125}};
    simgl_setting half = {"flood", 0.5}, wrong = {"flod", 0.5}, bend = {"elbow", 0.5};
    double sun[3] = {1e11, -5e10, 9e10};
    simgl_scene moving = {.moving = 1}, dimmed = {.lamps = &half, .lamp_count = 1};
    simgl_scene other = {.sun_position_m = sun, .gain_dn_per_e = 0.125, .seek = 1};
    simgl_scene another = {.draw = 4294967295u}, typo = {.lamps = &wrong, .lamp_count = 1};
    if (client == NULL) { printf("%s", error); return 1; }
    show(client, &chaser, NULL);
    show(client, &chaser, &moving);
    show(client, &chaser, &dimmed);
    show(client, &chaser, &other);
    show(client, &chaser, &another);
    show(client, &chaser, &typo);
    chaser.joints = &bend;
    chaser.joint_count = 1;
    show(client, &chaser, NULL);
    simgl_close(client);
    return 0;
}
"""

C_CAMERAS = """
#include <simgl.h>
#include <stdio.h>
static uint16_t wide[64 * 48], small[64 * 48];
static char error[300];
int main(int argc, char **argv) {
    simgl_image info[2];
    simgl_shot shots[2] = {{"nav", 0.001, 0.0, wide, 64 * 48, &info[0]},
                           {"side", 0.0, 0.125, small, 64 * 48, &info[1]}};
    simgl_body chaser = {.name = "chaser", .position_m = {0.5, -0.25, 40.0},
                         .velocity_m_s = {0.0, 0.0, -0.1},
                         .q_icrf_from_body_xyzw = {0.0, 0.0, 0.0, 1.0}};
    simgl_scene gain = {.gain_dn_per_e = 0.5};
    simgl_keys keys = {argv[2], argv[3], argv[4]}, empty = {argv[2], "", argv[4]};
    simgl_keys cut = {argv[2], "abc", argv[4]}, none = {0};
    simgl_options options = {.timeout_s = 20.0, .keys = &keys};
    simgl_client *client;
    int64_t now;
    int i, code;
    (void)argc;
    client = simgl_connect_with(argv[1], &options, error, sizeof error);
    if (client == NULL) return puts(error), 1;
    now = simgl_epoch_tai_ns(client);
    code = simgl_render_cameras_dn(client, now, shots, 2, &chaser, 1, NULL, error, sizeof error);
    if (code != SIMGL_OK) return puts(error), 2;
    for (i = 0; i < 2; ++i) {
        char hash[33];
        simgl_plane_hash(shots[i].pixels, (size_t)info[i].width * (size_t)info[i].height, hash);
        printf("%s %d %d %g %g %s\\n", shots[i].camera, (int)info[i].width, (int)info[i].height,
               info[i].exposure_time_s, info[i].gain_dn_per_e, hash);
    }
    printf("%s %s\\n", info[0].state_hash, info[1].state_hash);
    shots[1].pixel_count = 3;
    code = simgl_render_cameras_dn(client, now, shots, 2, &chaser, 1, NULL, error, sizeof error);
    printf("%d %s\\n", code, error);
    shots[1] = shots[0];
    code = simgl_render_cameras_dn(client, now, shots, 2, &chaser, 1, NULL, error, sizeof error);
    printf("%d %s\\n", code, error);
    code = simgl_render_cameras_dn(client, now, shots, 1, &chaser, 1, &gain, error, sizeof error);
    printf("%d %s\\n", code, error);
    code = simgl_render_cameras_dn(client, now, NULL, 1, &chaser, 1, NULL, error, sizeof error);
    printf("%d %s\\n", code, error);
    simgl_close(client);
    options.keys = &empty;
    if (simgl_connect_with(argv[1], &options, error, sizeof error) == NULL) puts(error);
    options.keys = &cut;
    if (simgl_connect_with(argv[1], &options, error, sizeof error) == NULL) puts(error);
    options.keys = &none;
    if (simgl_connect_with(argv[1], &options, error, sizeof error) == NULL) puts(error);
    options.timeout_s = -1.0;
    options.keys = NULL;
    if (simgl_connect_with(argv[1], &options, error, sizeof error) == NULL) puts(error);
    if (simgl_connect(argv[1], 20.0, error, sizeof error) == NULL) puts(error);
    return 0;
}
"""


@pytest.fixture(scope="module")
def probe(build: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    source = tmp_path_factory.mktemp("probe") / "probe.cpp"
    source.write_text(PROBE)
    return build("probe", source)


def guest_list(folder: Path) -> tuple[dict[str, list[str]], Access]:
    """Public and secret keys by name, and what a server needs that admits the guest alone."""
    keys: dict[str, list[str]] = {}
    for name in ("server", "guest", "stranger"):
        _, secret = make_keys(name, folder)
        keys[name] = [key.decode() for key in load_certificate(secret) if key is not None]
    (folder / "allowed").mkdir()
    (folder / "guest.key").rename(folder / "allowed" / "guest.key")
    return keys, Access(secret=folder / "server.key_secret", allowed=folder / "allowed")


class Program:
    """A probe that runs: a line to it, a line back."""

    def __init__(self, path: Path, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [str(path), *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.first = self._read()

    def _read(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def ask(self, line: str) -> str:
        """The answer to a command."""
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        return self._read()

    def end(self) -> int:
        """Close its input and wait."""
        self._process.communicate(timeout=limit(20.0))
        return self._process.returncode


def test_the_cpp_client_gets_what_the_python_client_gets(
    probe: Path, client: Client, scenario: Scenario
) -> None:
    program = Program(probe, client.address, SOON)
    assert program.first == "64"
    words = program.ask("all").split()
    assert program.end() == 0
    pose = BodyPose(
        position_m=(0.5, -0.25, 40.0),
        velocity_m_s=(0.0, 0.0, -0.1),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )
    shots = [
        Shot(camera="nav", exposure_time_s=0.001, products=("dn", "radiance")),
        Shot(camera="side", gain_dn_per_e=0.125, products=("depth", "part_id")),
    ]
    tick = client.render_all(
        scenario.epoch_tai_ns + 7, shots, {"chaser": pose}, sun_position_m=(1e11, -5e10, 9e10)
    )
    planes = {**tick["nav"].planes, **tick["side"].planes}
    assert words[0] == tick.state_hash
    assert int(words[1]) == planes["dn"].sum(dtype=np.int64)
    # Sums of float32 in the same order, pixel by pixel, as float64
    assert float(words[2]) == pytest.approx(planes["radiance"].sum(dtype=np.float64), rel=1e-12)
    assert float(words[3]) == pytest.approx(planes["depth"].sum(dtype=np.float64), rel=1e-12)
    assert int(words[4]) == planes["part_id"].sum(dtype=np.int64)
    assert int(words[5]) == 500_007
    assert float(words[6]) == 0.125


def test_the_cpp_client_moves_bodies_while_the_shutter_is_open(
    probe: Path, client: Client, scenario: Scenario
) -> None:
    program = Program(probe, client.address, SOON)
    words = program.ask("moving").split()
    assert program.end() == 0
    pose = BodyPose(
        position_m=(0.5, -0.25, 40.0),
        velocity_m_s=(0.0, 0.0, -0.1),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
        angular_velocity_rad_s=(0.25, -0.5, 0.125),
    )
    bodies = {"chaser": pose}
    image = client.render(scenario.epoch_tai_ns + 7, "nav", bodies, 0.1, moving=True)
    assert words == [image.state_hash, str(image.dn.sum(dtype=np.int64))]


def test_the_cpp_client_says_what_is_wrong(probe: Path, client: Client) -> None:
    program = Program(probe, client.address, SOON)
    assert program.ask("nva") == "refused NO_CAMERA cameras[0].camera"
    assert program.ask("nav").endswith(" 0")
    assert program.end() == 0


def test_the_cpp_client_skips_what_it_does_not_know(probe: Path, newer_address: str) -> None:
    program = Program(probe, newer_address, SOON)
    assert program.first == "64"
    assert program.ask("nav").endswith(" 0")
    assert program.ask("nva") == "refused FROM_LATER cameras[0].camera"
    assert program.end() == 0


def test_the_cpp_client_without_a_server_gives_up_in_time(probe: Path) -> None:
    program = Program(probe, "tcp://127.0.0.1:1", "0.3")
    assert program.first == (
        "error tcp://127.0.0.1:1: no connection within 0.3 s, waiting for hello; "
        "never heard of it, no image before"
    )
    assert program.end() == 0


def test_the_cpp_client_waits_for_a_server_that_starts(probe: Path, scenario_path: Path) -> None:
    with served(scenario_path, SLOW_LOAD.format(us=3_000_000)) as (_, address):
        # Its timeout is shorter than the load, but the server says that it starts.
        program = Program(probe, address, str(limit(2.0)))
        assert program.first == "64"
        assert program.end() == 0


def test_the_cpp_client_knows_a_frozen_and_a_killed_server_and_goes_on_after_a_restart(
    probe: Path, scenario_path: Path, scenario: Scenario, start_server: Starter
) -> None:
    with launched_server(scenario_path) as (process, address):
        # Before the heartbeat breaks the connection to a frozen server, after 10 s.
        timeout = f"{min(limit(3.0), 8.0):g}"
        program = Program(probe, address, timeout)
        assert program.ask("nav") == "1 0"
        os.kill(process.pid, signal.SIGSTOP)
        frozen = program.ask("nav")
        line = f"error {address}: no answer within {timeout} s, waiting for render; last "
        assert frozen.startswith(line)
        assert frozen.endswith("last image 1")
        process.kill()
        process.wait(limit(10.0))
        start_server(scenario, address)
        # A busy machine may take longer to its first picture.
        answers = [program.ask("nav")]
        while answers[-1].startswith("error") and len(answers) < 20:
            answers.append(program.ask("nav"))
        assert answers[-1].endswith(" 1")
        assert program.end() == 0


def test_the_c_interface_gets_the_same_image(
    build: Callable[..., Path], tmp_path: Path, client: Client, scenario: Scenario
) -> None:
    program = c_program(build, tmp_path, C_PROGRAM)
    output = run_to_end([str(program), client.address]).stdout
    pose = BodyPose(
        position_m=(0.5, -0.25, 40.0),
        velocity_m_s=(0.0, 0.0, -0.1),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )
    image = client.render(scenario.epoch_tai_ns, "nav", {"chaser": pose})
    code, width, height, total, digest, second, *error = output.split()
    assert (code, width, height, second) == ("0", "64", "48", "1")
    assert int(total) == image.dn.sum(dtype=np.int64)
    assert digest == image.state_hash
    assert 'NO_CAMERA: cameras[0].camera "nva" does not exist here' in " ".join(error)


def test_the_c_interface_moves_bodies_dims_lamps_and_places_the_sun(
    build: Callable[..., Path], tmp_path: Path, start_server: Starter
) -> None:
    path = tmp_path / "lit.toml"
    path.write_text(LIT_SCENARIO)
    scenario = load_scenario(path)
    running = start_server(scenario)
    program = c_program(build, tmp_path, C_SCENES)
    output = run_to_end([str(program), running.address]).stdout
    *pictures, typo, bent = output.splitlines()
    said: list[dict[str, Any]] = [
        {},
        {"moving": True},
        {"lamps": {"flood": 0.5}},
        {"sun_position_m": (1e11, -5e10, 9e10), "gain_dn_per_e": 0.125},
        {"draw": 2**32 - 1},
    ]
    expected = []
    with Client(running.address) as client:
        for words in said:
            image = client.render(scenario.epoch_tai_ns, "nav", {"chaser": TURNING}, 0.1, **words)
            total = image.dn.sum(dtype=np.int64)
            expected.append(f"{total} {image.state_hash} {image.gain_dn_per_e:g}")
    assert pictures == expected
    assert len(set(pictures)) == 5
    assert typo.startswith("1 ")
    assert 'NO_LAMP: lamps "flod" does not exist here' in typo
    assert "NO_JOINT" in bent


def test_the_c_interface_has_keys_and_several_cameras(
    build: Callable[..., Path], tmp_path: Path, start_server: Starter, scenario: Scenario
) -> None:
    keys, access = guest_list(tmp_path)
    address = start_server(scenario, access=access).address
    program = c_program(build, tmp_path, C_CAMERAS)
    run = run_to_end([str(program), address, keys["server"][0], *keys["guest"]])
    *images, states, small, twice, gain, null, empty, cut, none, timeout, keyless = (
        run.stdout.splitlines()
    )
    pose = BodyPose(
        position_m=(0.5, -0.25, 40.0),
        velocity_m_s=(0.0, 0.0, -0.1),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )
    shots = [Shot(camera="nav", exposure_time_s=0.001), Shot(camera="side", gain_dn_per_e=0.125)]
    folder = ClientKeys(secret=tmp_path / "guest.key_secret", server=tmp_path / "server.key")
    with Client(address, timeout_s=limit(20.0), keys=folder) as client:
        tick = client.render_all(scenario.epoch_tai_ns, shots, {"chaser": pose})
    expected = []
    for name in ("nav", "side"):
        image = tick[name]
        height, width = image.dn.shape
        numbers = f"{width} {height} {image.exposure_time_s:g} {image.gain_dn_per_e:g}"
        expected.append(f"{name} {numbers} {image.plane_hash()}")
    assert images == expected
    assert images[0].split()[-1] != images[1].split()[-1]
    assert states == f"{tick.state_hash} {tick.state_hash}"
    assert small.startswith('4 pixels has room for 3, camera "side" has ')
    assert twice == f'1 {address}: BAD_VALUE: cameras[1].camera repeats "nav"'
    assert gain == "4 scene.gain_dn_per_e: each of several cameras has its own gain"
    assert null == "4 shots is NULL"
    assert empty == "keys.public_key is empty"
    assert cut == "a key is not in ZeroMQ's Z85 form"
    assert none == "keys.server is NULL"
    assert timeout == "timeout_s must lie in 0..1e6 s"
    assert keyless.startswith(f"{address}: the server refused this client: its key")


def test_the_c_interface_names_what_a_caller_got_wrong(
    build: Callable[..., Path], tmp_path: Path, running: Running
) -> None:
    before = running.simulator.captured
    program = c_program(build, tmp_path, C_MISTAKES)
    run = run_to_end([str(program), running.address])
    refused = f"1 {running.address}: BAD_VALUE: "
    lines = run.stdout.splitlines()
    assert lines[:8] == [
        "4 client is NULL",
        "4 bodies is NULL",
        "4 pixels is NULL",
        '4 pixels has room for 3071, camera "nav" has 3072',
        '4 bodies has "chaser" twice',
        "4 a name of bodies is NULL",
        "4 joints is NULL",
        "4 a name of lamps is NULL",
    ]
    assert lines[8].startswith(refused + "bodies.chaser.q_icrf_from_body_xyzw must be a unit")
    for line, given in zip(lines[9:11], ("-0.001", "nan"), strict=True):
        wanted = "cameras[0].exposure_time_s must lie above 0, up to 3600 s, got "
        assert line == f"{refused}{wanted}{given}"
    assert lines[11].startswith(refused + "cameras[0].gain_dn_per_e must lie above 0")
    assert lines[12:] == ["0 ", "address is NULL", "4 4 4"]
    assert running.simulator.captured == before + 1


def test_the_cpp_client_knows_a_server_killed_in_the_middle_of_a_frame_at_once(
    probe: Path, scenario_path: Path
) -> None:
    with launched_server(scenario_path) as (process, address):
        program = Program(probe, address, LATE)
        assert program.ask("nav") == "1 0"
        # Frozen first, so that the request is surely under way when it is killed.
        os.kill(process.pid, signal.SIGSTOP)
        killer = threading.Timer(0.5, process.kill)
        killer.start()
        start = time.monotonic()
        answer = program.ask("nav")
        # Not at the deadline of 60 s.
        assert time.monotonic() - start < limit(10.0)
        killer.join()
        assert answer.startswith(f"error {address}: the connection broke, waiting for render; last")
        assert program.end() == 0


def test_the_cpp_client_comes_in_with_keys_and_is_told_at_once_without(
    probe: Path, start_server: Starter, scenario: Scenario, tmp_path: Path
) -> None:
    keys, access = guest_list(tmp_path)
    address = start_server(scenario, access=access).address
    public = keys["server"][0]
    guest = Program(probe, address, SOON, public, *keys["guest"])
    assert guest.first == "64"
    assert guest.ask("nav") == "1 0"
    assert guest.end() == 0
    for wrong in ([public, *keys["stranger"]], [keys["stranger"][0], *keys["guest"]], []):
        start = time.monotonic()
        told = Program(probe, address, LATE, *wrong)
        assert told.first.startswith(f"error {address}: the server refused this client: its key")
        # Not at the deadline of 60 s.
        assert time.monotonic() - start < limit(10.0)
        assert told.end() == 0


def test_the_first_pictures_of_the_page_are_the_same_picture(
    build: Callable[..., Path], tmp_path: Path, start_server: Starter
) -> None:
    running = start_server(load_scenario(ROOT / "examples" / "bridge" / "box.toml"))
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    page = page.replace("tcp://127.0.0.1:5563", running.address)
    in_python = page.partition("```python\n")[2].partition("```")[0]
    in_c = page.partition("```c\n")[2].partition("```")[0]
    commands = [[sys.executable, "-c", in_python], [str(c_program(build, tmp_path, in_c))]]
    last_lines = [run_to_end(c).stdout.splitlines()[-1].split() for c in commands]
    assert last_lines[0][:2] == ["(240,", "320)"]
    assert last_lines[1][:3] == ["320", "x", "240,"]
    assert last_lines[0][-1] == last_lines[1][-1]


def test_the_examples_are_a_page_and_fly(build: Callable[..., Path], client: Client) -> None:
    examples = ROOT / "examples" / "bridge"
    for path in (examples / "gnc_stub.cpp", examples / "gnc_stub.py"):
        assert len(path.read_text().splitlines()) <= 30, path.name
    program = build("gnc_stub", examples / "gnc_stub.cpp")
    flights = []
    for command in ([str(program)], [sys.executable, str(examples / "gnc_stub.py")]):
        run = run_to_end([*command, client.address])
        flights.append([line.split() for line in run.stdout.splitlines()])
    in_cpp, in_python = flights
    # In Python an image is used when it has arrived, one step after it was taken.
    assert [row[0] for row in in_cpp] == [str(step) for step in range(20)]
    assert [row[0] for row in in_python] == [str(step) for step in range(1, 20)]
    # The first state is the same to the bit, and so is its name.
    assert in_cpp[0][1] == in_python[0][1]
