"""The scene of the long runs, its server processes, and their memory."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simgl_bridge import BodyPose, Client

from simgl.errors import BridgeError

# By default an image this small takes 256 samples per pixel and 31 ms (llvmpipe); with 5 it takes
# 5 ms.
SMALL = """
[epoch]
utc = "2026-03-20T12:00:00"
[sun]
irradiance_w_m2 = 1367.0
angular_diameter_deg = 0.5
direction_icrf = [0.6, 0.0, 0.8]
[earth]
shape = "none"
[spacecraft.target]
model = { box = { size_m = [2.0, 1.0, 1.0], material = { reflectance = 0.5 } } }
position_icrf_m = [0.0, 0.0, 0.0]
[spacecraft.chaser]
model = { box = { size_m = [0.2, 0.2, 0.2], material = { reflectance = 0.2 } } }
position_icrf_m = [0.0, 0.0, 60.0]
[camera.nav]
on = "chaser"
position_body_m = [0.0, 0.0, -0.2]
boresight = [0.0, 0.0, -1.0]
up = [0.0, 1.0, 0.0]
width_px = 64
height_px = 48
focal_length_mm = 2.0
exposure_time_s = 0.0002
[render]
seed = 7
samples_per_pixel = 5
"""


def chaser(step: int) -> BodyPose:
    """A pose of the chaser that differs with every step."""
    return BodyPose(
        position_m=(0.01 * step, -0.005 * step, 40.0 + 0.02 * step),
        velocity_m_s=(0.0, 0.0, -0.1),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )


@contextmanager
def server_process(module: str, *arguments: str, address: str) -> Iterator[int]:
    """A server process; yields its process id and ends it with the block."""
    command = [sys.executable, "-m", module, *arguments, "--address", address]
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=log)
        try:
            if not _answers(process, address):
                log.seek(0)
                said = log.read().decode(errors="replace").strip()
                raise BridgeError(f"{address}: the server did not start: {said}")
            yield process.pid
        finally:
            process.terminate()
            process.wait(20)


def _answers(process: subprocess.Popen[bytes], address: str) -> bool:
    for _ in range(240):
        if process.poll() is not None:
            break
        try:
            Client(address, timeout_s=0.25).close()
        except BridgeError:
            continue
        return True
    return False


def scenario_file(folder: Path, width: int = 64, height: int = 48) -> Path:
    """The scene as a file, with images of a size [px]."""
    text = SMALL.replace("width_px = 64", f"width_px = {width}")
    path = folder / "small.toml"
    path.write_text(text.replace("height_px = 48", f"height_px = {height}"))
    return path


def resident_kib(pid: int) -> int:
    """Memory of a process in RAM, its own and shared with other processes [KiB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    fields = dict(line.split(":", 1) for line in status.splitlines())
    return sum(int(fields[name].split()[0]) for name in ("RssAnon", "RssShmem"))


def children(pid: int) -> list[int]:
    """The processes that a process started and that still run."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    return sorted(int(child) for thread in threads for child in thread.read_text().split())


def machine() -> dict[str, object]:
    """Machine and date of a measurement."""
    return {
        "date": time.strftime("%Y-%m-%d", time.gmtime()),
        "python": platform.python_version(),
        "cores": os.cpu_count(),
        "load_1_min": round(os.getloadavg()[0], 1),
    }
