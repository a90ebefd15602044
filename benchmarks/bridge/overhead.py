"""The loop without rendering: a full-size picture that is ready at once, by transport."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from simgl_bridge import Client

from benchmarks.bridge.scene import SMALL, chaser, machine, server_process

SIZES = ((64, 48), (640, 480), (1280, 960), (2048, 2048))


def overhead(frames: int, folder: Path) -> dict[str, object]:
    """Round trips as a client sees them: p50 and p99 [ms] by size and transport."""
    table = []
    for width, height in SIZES:
        text = SMALL.replace("width_px = 64", f"width_px = {width}")
        path = folder / f"{width}.toml"
        path.write_text(text.replace("height_px = 48", f"height_px = {height}"))
        for transport in ("ipc", "tcp"):
            address = f"ipc://{folder / 'o'}" if transport == "ipc" else "tcp://127.0.0.1:5597"
            with server_process("benchmarks.bridge.still", str(path), address=address):
                seconds = _round_trips(address, frames)
            p50, p99 = np.percentile(seconds * 1e3, [50.0, 99.0])
            table.append(
                {
                    "width": width,
                    "height": height,
                    "transport": transport,
                    "p50_ms": round(float(p50), 3),
                    "p99_ms": round(float(p99), 3),
                }
            )
    return {**machine(), "frames": frames, "round_trips": table}


def _round_trips(address: str, frames: int) -> np.ndarray:
    seconds = np.empty(frames)
    with Client(address, timeout_s=20.0) as client:
        epoch = client.welcome.epoch_tai_ns
        for frame in range(-frames // 10, frames):
            start = time.perf_counter()
            image = client.render(epoch + frame + frames, "nav", {"chaser": chaser(frame % 100)})
            # Read once, as any use of it would.
            assert int(image.dn.max()) < 4000
            if frame >= 0:
                seconds[frame] = time.perf_counter() - start
    return seconds
