"""Show a scenario in real time on a full screen, for a camera that looks at it.

    python -m examples.hardware_in_the_loop examples/docking.toml --camera navcam --seconds 60

Exit status 1 where a frame was late or missed: a test before that screen is then not valid.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack

from simgl_bridge import Client, Shot, launched_server

from examples.hardware_in_the_loop.frame_clock import FrameClock
from examples.hardware_in_the_loop.full_screen import FullScreen
from examples.hardware_in_the_loop.pixel_map import PixelMap
from simgl.errors import SimglError


def run(options: argparse.Namespace) -> int:
    """The loop; returns the exit status."""
    with ExitStack() as stack:
        screen = stack.enter_context(FullScreen(options.monitor))
        address = options.address
        if address is None:
            _, address = stack.enter_context(launched_server(options.scenario))
        client = stack.enter_context(Client(address))
        clock = FrameClock(options.rate, idle=screen.idle)
        show(client, screen, clock, options)
    print(clock.report())
    return 1 if clock.late or clock.missed else 0


def show(
    client: Client, screen: FullScreen, clock: FrameClock, options: argparse.Namespace
) -> None:
    """Each frame at its time. The next one is drawn while one waits for its time."""
    camera = next(c for c in client.welcome.cameras if c.name == options.camera)
    size = camera.width, camera.height
    pixel_map = PixelMap(
        screen_size=screen.size, image_size=size, white_radiance=options.white, gamma=options.gamma
    )
    print(pixel_map, flush=True)
    # Radiance, for lens, noise and converter are those of the camera under test.
    shots = [Shot(camera=camera.name, products=("radiance",))]
    frames = round(options.seconds * options.rate)

    def time_of(frame: int) -> int:
        return client.welcome.epoch_tai_ns + round(frame * 1e9 / options.rate)

    # The first image compiles shaders; a simulation would send the poses of its craft here.
    client.render_all(time_of(0), shots)
    clock.start()
    frame, clipped = 0, 0
    coming = client.submit(time_of(0), shots)
    while frame < frames and not screen.closed:
        radiance = coming.result()[camera.name].planes["radiance"]
        clipped = max(clipped, int(pixel_map.clipped(radiance).sum()))
        following = clock.following(frame, frames)
        if following < frames:
            coming = client.submit(time_of(following), shots)
        screen.prepare(pixel_map.screen(radiance))
        clock.wait(frame)
        screen.show()
        clock.shown(frame)
        frame = following
    print(f"{clipped} pixels of a frame at most are brighter than the screen")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario")
    parser.add_argument("--camera", required=True)
    parser.add_argument("--address", help="of a running server of the scenario")
    parser.add_argument("--rate", type=float, default=5.0, help="[Hz]")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--monitor", type=int, default=0)
    parser.add_argument("--white", type=float, default=60.0, help="radiance of white [W m-2 sr-1]")
    parser.add_argument("--gamma", type=float, default=2.2, help="of the screen")
    try:
        sys.exit(run(parser.parse_args()))
    except SimglError as error:
        sys.exit(f"hardware_in_the_loop: {error}")


if __name__ == "__main__":
    main()
