"""Draw the events of a fifth of a second over the image of their middle.

python -m examples.event_camera --out out/event_camera
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

import simgl
from simgl.arrays import Image8, IndexArray
from simgl.sequence.event_stream import EventSpan, event_stream

MS = 1_000_000
SCENE = Path(__file__).parent / "docking.toml"


def over_image(image: Image8, balance: IndexArray) -> Image8:
    """The image in a dim grey, with pixels that became brighter in red and darker in blue.

    balance : (height, width) number of ON events less that of OFF events; three saturate
    """
    strength = np.clip(np.abs(balance) / 3.0, 0.0, 1.0)[..., None] ** 0.5
    colour = np.where(balance[..., None] > 0, (255.0, 48.0, 32.0), (48.0, 112.0, 255.0))
    return np.rint(0.55 * image * (1.0 - strength) + colour * strength).astype(np.uint8)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/event_camera"))
    parser.add_argument("--duration-ms", type=int, default=200)
    options = parser.parse_args()
    scenario = simgl.load_scenario(SCENE)
    start, duration = scenario.epoch_tai_ns, options.duration_ms * MS
    span = EventSpan(camera="dvs", start=start, stop=start + duration, step=10 * MS)
    detector = scenario.cameras["dvs"].detector
    balance = np.zeros((detector.height, detector.width), dtype=np.int64)
    count = 0
    with simgl.Simulator(scenario) as simulator:
        for events in event_stream(simulator, span):
            balance += events.balance(*balance.shape)
            count += len(events)
        middle = simulator.capture(scenario.at(start + duration // 2), "dvs")
    assert middle.digital is not None
    image = simgl.display_from_dn(middle.digital.dn, middle.info.camera)
    options.out.mkdir(parents=True, exist_ok=True)
    panels = {
        "DN, 10 us": image,
        f"{count} events in {options.duration_ms} ms: ON red, OFF blue": over_image(image, balance),
    }
    doubled = {name: one.repeat(2, axis=0).repeat(2, axis=1) for name, one in panels.items()}
    path = options.out / "event_camera.png"
    Image.fromarray(simgl.contact_sheet(doubled, columns=2)).save(path)
    print(f"{count} events in {options.duration_ms} ms, {path}")


if __name__ == "__main__":
    main()
