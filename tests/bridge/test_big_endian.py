"""The C++ client on a machine whose numbers lie the other way round, under emulation."""

from __future__ import annotations

import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from msgspec import msgpack

from simgl import Scenario
from tests.bridge.harness import RawLink
from tests.patience import run_to_end

CPP = Path(__file__).parents[2] / "bridge" / "cpp"
COMPILER, EMULATOR = shutil.which("s390x-linux-gnu-g++"), shutil.which("qemu-s390x")

# Stands where libzmq would: hands out the frames of a file, and shows what is sent.
PLAYER = """
#include <zmq.h>
#include <cstdio>
#include <cstring>
#include <string>
static FILE *tape;
static bool more_to_come = false;
struct Held { unsigned char *data; std::size_t size; int more; };
static Held &held(const zmq_msg_t *m) {
    return *reinterpret_cast<Held *>(const_cast<zmq_msg_t *>(m));
}
static int none, monitor;
extern "C" {
void *zmq_ctx_new() { tape = std::fopen("tape", "rb"); return &none; }
int zmq_ctx_term(void *) { return 0; }
void *zmq_socket(void *, int type) { return type == ZMQ_PAIR ? &monitor : &none; }
int zmq_close(void *) { return 0; }
int zmq_setsockopt(void *, int, const void *, size_t) { return 0; }
int zmq_socket_monitor(void *, const char *, int) { return 0; }
int zmq_connect(void *, const char *) { return 0; }
int zmq_errno() { return 0; }
const char *zmq_strerror(int) { return ""; }
int zmq_msg_init(zmq_msg_t *m) { held(m) = {nullptr, 0, 0}; return 0; }
int zmq_msg_close(zmq_msg_t *m) { delete[] held(m).data; return 0; }
void *zmq_msg_data(zmq_msg_t *m) { return held(m).data; }
size_t zmq_msg_size(const zmq_msg_t *m) { return held(m).size; }
int zmq_msg_more(const zmq_msg_t *m) { return held(m).more; }
int zmq_send(void *, const void *data, size_t size, int) {
    const auto *bytes = static_cast<const unsigned char *>(data);
    for (size_t i = 0; i < size; ++i) std::printf("%02x", bytes[i]);
    std::printf("\\n");
    more_to_come = true;
    return static_cast<int>(size);
}
int zmq_poll(zmq_pollitem_t *items, int, long) { items[0].revents = ZMQ_POLLIN; return 1; }
// One message for each request: whether it has more frames, their sizes byte by byte, their bytes.
int zmq_msg_recv(zmq_msg_t *m, void *socket, int) {
    unsigned char head[5];
    if (socket == &monitor || !more_to_come || std::fread(head, 1, 5, tape) != 5) return -1;
    Held &h = held(m);
    h.more = head[0];
    h.size = static_cast<size_t>(head[1]) | head[2] << 8 | head[3] << 16;
    h.data = new unsigned char[h.size + 1];
    more_to_come = h.more;
    return static_cast<int>(std::fread(h.data, 1, h.size, tape));
}
}
"""
PROGRAM = """
#include <simgl.hpp>
#include <iostream>
int main() {
    const std::uint16_t one = 1;
    unsigned char first;
    std::memcpy(&first, &one, 1);
    std::cerr << (first ? "little" : "big");
    try {
        simgl::Client client("tcp://127.0.0.1:1");
        simgl::Pose pose{{0.5, -0.25, 40.0}, {0.0, 0.0, -0.1}, {0.0, 0.0, 0.0, 1.0}};
        const simgl::Shot shot{"nav", 0.001, {}, {"dn", "radiance"}};
        const simgl::Vector sun{1e11, -5e10, 9e10};
        const auto now = client.welcome().epoch_tai_ns;
        const auto tick = client.render(now, {shot}, {{"chaser", pose}}, sun);
        unsigned long dn = 0;
        double radiance = 0.0;
        for (auto v : tick.image("nav").plane("dn").u16()) dn += v;
        for (auto v : tick.image("nav").plane("radiance").f32()) radiance += v;
        std::cout.precision(17);
        std::cout << tick.state_hash << ' ' << dn << ' ' << radiance << std::endl;
    } catch (const std::exception &e) {
        std::cout << "error " << e.what() << std::endl;
    }
}
"""


def output(compiler: str, folder: Path, *emulator: str) -> tuple[str, list[str]]:
    """Which end comes first, and what the program sent and made of the replies."""
    program = str(folder / "program")
    command = [compiler, "-std=c++17", "-static", f"-I{CPP}", f"-I{folder}"]
    command += [str(folder / "program.cpp"), str(folder / "player.cpp"), "-o", program]
    subprocess.run(command, check=True)
    run = run_to_end([*emulator, program], cwd=folder)
    return run.stderr, run.stdout.splitlines()


@pytest.mark.skipif(
    None in (COMPILER, EMULATOR), reason="needs Debian's g++-s390x-linux-gnu and qemu-user"
)
def test_a_big_endian_machine_sends_the_same_bytes_and_reads_the_same_numbers(
    raw: RawLink, scenario: Scenario, tmp_path: Path
) -> None:
    assert COMPILER is not None
    assert EMULATOR is not None
    pose = {
        "position_m": [0.5, -0.25, 40.0],
        "velocity_m_s": [0.0, 0.0, -0.1],
        "q_icrf_from_body_xyzw": [0.0, 0.0, 0.0, 1.0],
    }
    shot = {"camera": "nav", "exposure_time_s": 0.001, "products": ["dn", "radiance"]}
    hello = {"type": "hello", "client": "raw", "versions": ["simgl/1"]}
    now, sun = scenario.epoch_tai_ns, {"position_m": [1e11, -5e10, 9e10]}
    render = {"type": "render", "id": 1, "tai_ns": now, "cameras": [shot], "sun": sun}
    render["bodies"] = {"chaser": pose}
    messages = []
    for request in (hello, render):
        raw.send([b"simgl/1", msgpack.encode(request)])
        messages.append(raw.receive())
    tape = b"".join(
        bytes([index + 1 < len(frames)]) + struct.pack("<I", len(frame)) + frame
        for frames in messages
        for index, frame in enumerate(frames)
    )
    (tmp_path / "tape").write_bytes(tape)
    (tmp_path / "player.cpp").write_text(PLAYER)
    (tmp_path / "program.cpp").write_text(PROGRAM)
    shutil.copy("/usr/include/zmq.h", tmp_path / "zmq.h")
    end, theirs = output(COMPILER, tmp_path, EMULATOR)
    assert end == "big"
    here, ours = output("g++", tmp_path)
    assert here == "little"
    assert theirs == ours
    digest, dn, radiance = next(line for line in theirs if " " in line).split()
    header = msgpack.decode(messages[1][1])
    assert digest == header["state_hash"]
    assert int(dn) == np.frombuffer(messages[1][2], dtype="<u2").sum(dtype=np.int64)
    total = np.frombuffer(messages[1][3], dtype="<f4").sum(dtype=np.float64)
    assert float(radiance) == pytest.approx(total, rel=1e-12)
