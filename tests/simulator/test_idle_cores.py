"""Frames, and what is made before the first, do not wake the threads of numpy's BLAS: the other
cores are left to what draws and what traces.

Once woken for one large product, those keep their cores busy for tens of milliseconds while they
wait for the next.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# Prints the processor time of BLAS's threads in each step [ms].
_SCRIPT = """
import os, time
import numpy as np
import scipy.linalg

threads = set(os.listdir("/proc/self/task")) - {str(os.getpid())}

import simgl
from simgl.physics.skylight import HEIGHTS, SUNS, Rings, skylight
from simgl.radiosity.bake import patch_directions
from simgl.radiosity.patches import SAMPLES
from simgl.scene.facing_triangles import facing_triangles
from simgl.scene.mesh import sphere
from simgl.scene.posed_mesh import PosedMesh

def spent(step):
    def times():
        # Those woken before fall asleep.
        time.sleep(0.2)
        stats = (open(f"/proc/self/task/{t}/schedstat").read().split() for t in threads)
        return sum(int(ran) for ran, *_ in stats)
    before = times()
    step()
    return (times() - before) / 1e6

ball = {"sphere": {"radius_m": 1.0, "material": {"reflectance": 0.5}}}
camera = {"position_icrf_m": [0.0, 0.0, 60.0], "look_at": "ball", "width_px": 64, "height_px": 48}
scenario = simgl.scenario_from_dict({
    "epoch": {"utc": "2026-03-20T12:00:00"},
    "earth": {"shape": "none"},
    "spacecraft": {"ball": {"model": ball, "position_icrf_m": [0.0, 0.0, 0.0]}},
    "camera": {"navcam": camera},
})
with simgl.Simulator(scenario) as simulator:
    def frame():
        simulator.capture_at(scenario.epoch_tai_ns, "navcam", {simgl.Product.DN})
    frame()
    print("frame", spent(frame))
large = PosedMesh(mesh=sphere(1.0, 512), joints=(), motion=None)
facing = lambda: facing_triangles(large, np.array([[0.0, 0.0, 3.0]]))
facing()
print("facing", spent(facing))
rings, aureole = Rings(8, 6, 6, 8), np.ones((HEIGHTS, SUNS, 4))
field = (np.ones((14, HEIGHTS, SUNS, 4)),) * 3
print("skylight", spent(lambda: skylight(rings, 6.4e6, np.full(4, 0.7), field, aureole)))
up = np.broadcast_to([0.0, 0.0, 1.0], (8000, SAMPLES, 3))
print("patches", spent(lambda: patch_directions(up, 96)))
square = np.ones((512, 512))
print("product", spent(lambda: square @ square))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="times of single threads are Linux's")
def test_neither_frames_nor_what_they_need_wake_the_threads_of_blas(tmp_path: Path) -> None:
    script = tmp_path / "frames.py"
    script.write_text(_SCRIPT)
    several = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, env=several, check=False
    )
    assert done.returncode == 0, done.stderr
    spent = {name: float(ms) for name, ms in map(str.split, done.stdout.splitlines())}
    product = spent.pop("product")
    # One product takes its own time and then the waiting of a thread: 2^26 cycles, 10 ms at least.
    if product < 5.0:
        pytest.skip("this BLAS has no threads that wait")
    assert max(spent.values()) < 1.0, spent
