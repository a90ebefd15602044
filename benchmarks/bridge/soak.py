"""Many frames in lock-step, each one checked; memory of both ends watched."""

from __future__ import annotations

import hashlib
import os
import sys
import time
from pathlib import Path

import numpy as np
from simgl_bridge import Client

from benchmarks.bridge.scene import (
    chaser,
    machine,
    resident_kib,
    scenario_file,
    server_process,
)

# Distinct states; each is repeated after so many frames and must give the same bits.
STATES = 250
# A long run reports its progress.
REPORT_EVERY = 10_000


def soak(frames: int, folder: Path) -> dict[str, object]:
    """The full loop with rendering; see ``checked_frames``."""
    return checked_frames("simgl_bridge.commands", frames, scenario_file(folder))


def loop(frames: int, folder: Path) -> dict[str, object]:
    """The loop without rendering: images are noise; see ``checked_frames``.

    They are large enough to pass from renderer to server in shared memory.
    """
    return checked_frames("benchmarks.bridge.still", frames, scenario_file(folder, 256, 192))


def checked_frames(server: str, frames: int, path: Path) -> dict[str, object]:
    """Request ``frames`` images of a server module; raises AssertionError at the first wrong one.

    path : of the scenario

    The client checks id, time and state hash of every reply. Here the pixels are compared with
    those of the same state before, and of all other states: a stale image would differ.
    """
    address = f"ipc://{path.parent / 'soak'}"
    known: dict[int, bytes] = {}
    # Written over once, so that its pages count from the start.
    seconds = np.full(frames, np.nan)
    # Allocators have seen every size after some rounds of all states.
    warm = min(frames // 5, 20 * STATES)
    before = (0, 0)
    with (
        server_process(server, str(path), address=address) as pid,
        Client(address, timeout_s=60.0) as client,
    ):
        epoch = client.welcome.epoch_tai_ns
        began = time.perf_counter()
        for frame in range(frames):
            step = frame % STATES
            start = time.perf_counter()
            image = client.render(epoch + step, "nav", {"chaser": chaser(step)}, seek=step == 0)
            seconds[frame] = time.perf_counter() - start
            assert image.sequence == frame + 1, f"frame {frame} has sequence {image.sequence}"
            digest = hashlib.blake2b(image.dn.tobytes(), digest_size=16).digest()
            assert known.setdefault(step, digest) == digest, f"frame {frame} has other bits"
            if frame == warm:
                before = (resident_kib(pid), resident_kib(os.getpid()))
            if (frame + 1) % REPORT_EVERY == 0:
                rate = (frame + 1) / (time.perf_counter() - began)
                print(f"{frame + 1} frames, {rate:.0f} a second", file=sys.stderr, flush=True)
        total = time.perf_counter() - began
        after = (resident_kib(pid), resident_kib(os.getpid()))
        renderer = client.welcome.renderer
    assert len(set(known.values())) == len(known), "two states have the same picture"
    p50, p99 = np.percentile(seconds[warm:] * 1e3, [50.0, 99.0])
    return {
        **machine(),
        "renderer": renderer,
        "frames": frames,
        "distinct_states": len(known),
        "stale_or_mismatched": 0,
        "frames_per_s": round(frames / total, 1),
        "p50_ms": round(float(p50), 3),
        "p99_ms": round(float(p99), 3),
        "server_kib": [before[0], after[0]],
        "client_kib": [before[1], after[1]],
        "server_growth_percent": round(100.0 * (after[0] / before[0] - 1.0), 3),
        "client_growth_percent": round(100.0 * (after[1] / before[1] - 1.0), 3),
    }
