"""Frame time and memory while a joint of ``examples/servicer.toml`` turns 0.2 deg a frame.

python -m benchmarks.joints [--frames 200]
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from simgl import Product, Simulator, load_scenario
from simgl.scenario.scenario import Scenario

STEP = np.radians(0.2)
JOINT = "arm_shoulder"
# Programs and transports are made in the first frames.
WARM_UP = 3


def resident_mb() -> float:
    """Memory of this process that is in use [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def measure(scenario: Scenario, frames: int) -> dict[str, float]:
    """Medians over the frames [ms], and memory after the first and the last ones."""
    epoch = scenario.epoch_tai_ns
    poses, clock, work = scenario.poses(epoch), [], []
    first_mb = 0.0
    with Simulator(scenario) as simulator:
        for frame in range(WARM_UP + frames):
            if frame == WARM_UP:
                first_mb = resident_mb()
            start, before = time.perf_counter(), time.process_time()
            angle = np.radians(50.0) + frame * STEP
            joints = {"servicer": {JOINT: float(angle)}}
            state = scenario.with_poses(epoch, poses, joint_angles=joints)
            simulator.capture(state, "beside", {Product.RADIANCE})
            clock.append(1e3 * (time.perf_counter() - start))
            work.append(1e3 * (time.process_time() - before))
    return {
        "frame_ms_p50": round(float(np.median(clock[WARM_UP:])), 1),
        "frame_ms_p95": round(float(np.percentile(clock[WARM_UP:], 95)), 1),
        "cpu_ms_p50": round(float(np.median(work[WARM_UP:])), 1),
        "first_mb": round(first_mb),
        "last_mb": round(resident_mb()),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.joints")
    parser.add_argument("--frames", type=int, default=200)
    frames = parser.parse_args().frames
    scenario = load_scenario(Path(__file__).parents[1] / "examples" / "servicer.toml")
    for on in (False, True):
        result = measure(replace(scenario, inter_reflection=on), frames)
        print(json.dumps({"inter_reflection": on, "frames": frames} | result))


if __name__ == "__main__":
    main()
