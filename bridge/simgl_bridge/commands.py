"""``simgl serve`` and ``simgl keys``: cameras at a ZeroMQ address, and who may ask for them."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from types import FrameType
from typing import Annotated

import typer

from simgl.cli_progress import bake_bar
from simgl.errors import ConfigError, SimglError
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from simgl_bridge.access import Access, make_keys
from simgl_bridge.basilisk.camera_overrides import CameraOverrides, load_sheets
from simgl_bridge.basilisk.endpoint import DEFAULT_ADDRESS as DEFAULT_BASILISK_ADDRESS
from simgl_bridge.basilisk.endpoint import BasiliskEndpoint
from simgl_bridge.basilisk.recording_replay import replay
from simgl_bridge.basilisk.viz_scene import bare_scenario, check_base
from simgl_bridge.bind_address import DEFAULT_ADDRESS, check_bindable
from simgl_bridge.fair_queue import FairQueue
from simgl_bridge.render_session import RenderSession
from simgl_bridge.run_with_server import escort, server_command
from simgl_bridge.server import Stop
from simgl_bridge.server import serve as serve_until
from simgl_bridge.simgl1_endpoint import LARGEST_SEED, WINDOW, Simgl1Endpoint
from simgl_bridge.supervisor import WithParent, keep


@contextmanager
def _stop_on_signals() -> Iterator[Event]:
    """An event that SIGINT and SIGTERM set; a second signal has its usual effect."""
    stop = Event()
    numbers = (signal.SIGINT, signal.SIGTERM)

    def on_signal(number: int, frame: FrameType | None) -> None:
        del frame
        stop.set()
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.signal(number, on_signal) for number in numbers}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def serve(
    scenario: Annotated[
        Path | None,
        typer.Argument(help="Scenario file (TOML); with --basilisk it may be left out."),
    ] = None,
    address: Annotated[
        str | None,
        typer.Option(
            help="tcp://127.0.0.1:PORT (* finds a free one) or ipc://PATH; "
            f"{DEFAULT_ADDRESS} unless --basilisk is given alone."
        ),
    ] = None,
    basilisk: Annotated[
        str | None,
        typer.Option(help="Be the image source of Basilisk here, such as tcp://127.0.0.1:5556."),
    ] = None,
    camera: Annotated[
        list[str] | None,
        typer.Option(help="ID=FILE: exposure, lens and detector of a camera of Basilisk."),
    ] = None,
    monitor: Annotated[
        str | None, typer.Option(help="Publish previews here; they may be dropped.")
    ] = None,
    rate_hz: Annotated[
        float | None, typer.Option(min=0.001, max=10000.0, help="Most pictures a second, free-run.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=LARGEST_SEED, help="Instead of the scenario's seed.")
    ] = None,
    root: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            file_okay=False,
            help="Folder of scenarios that clients may choose from; no file of theirs, nor of "
            "SCENARIO, may lie outside.",
        ),
    ] = None,
    keys: Annotated[
        Path | None, typer.Option(help="The server's .key_secret file; see simgl keys.")
    ] = None,
    allow: Annotated[
        Path | None, typer.Option(help="Folder with the .key files of the clients.")
    ] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Let anybody in, from other machines too.")
    ] = False,
    restart: Annotated[
        bool, typer.Option("--restart", help="Start the server again if a fault kills it.")
    ] = False,
) -> None:
    """Serve a scenario's cameras to a closed-loop simulation over ZeroMQ.

    A client sends time, poses and exposure, and gets back the images of exactly that state.
    Ctrl-C or SIGTERM finishes the frame in hand and ends with exit code 0.

    Example: simgl serve approach.toml --address tcp://127.0.0.1:5563

    Example: simgl serve --basilisk tcp://127.0.0.1:5556 --camera 1=navcam.toml
    """
    if basilisk is None:
        address = address or DEFAULT_ADDRESS
    if scenario is None and address is not None:
        raise ConfigError("simgl serve", "SCENARIO", "is missing; only --basilisk does without")
    if camera and basilisk is None:
        raise ConfigError("simgl serve", "--camera", "goes with --basilisk")
    natively = {"--monitor": monitor, "--rate-hz": rate_hz, "--keys": keys, "--insecure": insecure}
    for option, given in natively.items():
        if given and address is None:
            problem = "goes with --address: Basilisk's own protocol has nothing of the kind"
            raise ConfigError("simgl serve", option, problem)
    access = Access(secret=keys, allowed=allow, insecure=insecure)
    if address is not None:
        check_bindable(address, guarded=access.guarded)
    if monitor is not None:
        check_bindable(monitor, guarded=access.guarded, option="--monitor")
    if basilisk is not None:
        # Its protocol knows no keys.
        check_bindable(basilisk, option="--basilisk")
    if restart and any(a and a.endswith(":*") for a in (address, basilisk, monitor)):
        problem = "needs ports that stay the same, not :*"
        raise ConfigError("simgl serve", "--restart", problem)
    wanted = _Wanted(
        scenario=scenario,
        address=address,
        basilisk=basilisk,
        sheets=load_sheets(camera or [], root),
        monitor=monitor,
        rate_hz=rate_hz,
        seed=seed,
        root=root,
        access=access,
    )
    with _stop_on_signals() as stop:
        if not restart:
            _serve(wanted, stop)
        elif code := keep(_serve_kept, {"wanted": wanted}, stop):
            raise typer.Exit(code)


@dataclass(frozen=True, kw_only=True)
class _Wanted:
    """What the command was asked for, checked."""

    scenario: Path | None
    address: str | None
    basilisk: str | None
    sheets: Mapping[int, CameraOverrides]
    monitor: str | None
    rate_hz: float | None
    seed: int | None
    root: Path | None
    access: Access


def _serve_kept(wanted: _Wanted) -> None:
    """Serve in a process that another one looks after, and that ends with it."""
    with _stop_on_signals() as stop:
        try:
            _serve(wanted, WithParent(stop))
        except SimglError as error:
            print(f"simgl: {error}", file=sys.stderr)
            sys.exit(2)


def _serve(wanted: _Wanted, stop: Stop) -> None:
    """Serve until a stop is wished for."""
    with ExitStack() as stack:
        path = wanted.scenario
        loaded = bare_scenario() if path is None else load_scenario(path, root=wanted.root)
        if wanted.seed is not None:
            loaded = replace(loaded, seed=wanted.seed)
        if wanted.basilisk is not None:
            check_base(loaded)
        queue = FairQueue(WINDOW)
        render_session = stack.enter_context(
            RenderSession(loaded, root=wanted.root, open_simulator=_open)
        )
        fronts: list[Simgl1Endpoint | BasiliskEndpoint] = []
        if wanted.address is not None:
            native = Simgl1Endpoint(
                render_session,
                queue,
                wanted.address,
                access=wanted.access,
                monitor=wanted.monitor,
                rate_hz=wanted.rate_hz,
            )
            fronts.append(stack.enter_context(native))
        if wanted.basilisk is not None:
            front = BasiliskEndpoint(render_session, queue, wanted.basilisk, sheets=wanted.sheets)
            fronts.append(stack.enter_context(front))
        for one in fronts:
            _say(one.summary)
        serve_until(fronts, queue, stop)


def run(
    program: Annotated[
        list[str],
        typer.Argument(help="The program and its arguments, after --.", metavar="COMMAND"),
    ],
    basilisk: Annotated[
        str, typer.Option(help="Where the program looks for its image source.")
    ] = DEFAULT_BASILISK_ADDRESS,
    scenario: Annotated[
        Path | None, typer.Option(help="Scenario file (TOML) with models, Earth and light.")
    ] = None,
    camera: Annotated[
        list[str] | None,
        typer.Option(help="ID=FILE: exposure, lens and detector of a camera of Basilisk."),
    ] = None,
    patience_s: Annotated[
        float, typer.Option(min=1.0, help="A server silent for so long is given up.")
    ] = 300.0,
) -> None:
    """Run a program that uses Basilisk beside its image source, and end it if that dies.

    Basilisk itself would wait for ever. The exit code is the program's.

    Example: simgl run --camera 1=navcam.toml -- python scenario.py
    """
    check_bindable(basilisk, option="--basilisk")
    if basilisk.endswith(":*"):
        raise ConfigError("simgl run", "--basilisk", "needs a port that the program knows, not :*")
    arguments = [] if scenario is None else [str(scenario)]
    arguments += ["--basilisk", basilisk]
    for entry in camera or []:
        arguments += ["--camera", entry]
    with _stop_on_signals() as stop:
        code = escort(server_command(arguments), basilisk, program, patience=patience_s, stop=stop)
    if code:
        raise typer.Exit(code)


def replay_recording(
    recording: Annotated[Path, typer.Argument(help="What Basilisk recorded: NAME_UnityViz.bin.")],
    scenario: Annotated[
        Path | None, typer.Argument(help="Scenario file (TOML) with models, Earth and light.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the images.")] = Path("replay"),
    camera: Annotated[
        list[str] | None,
        typer.Option(help="ID=FILE: exposure, lens and detector of a camera of Basilisk."),
    ] = None,
    every: Annotated[int, typer.Option(min=1, help="One state in so many.")] = 1,
) -> None:
    """Take the pictures of a run that Basilisk recorded, one PNG for each camera and state.

    Example: simgl replay leo_UnityViz.bin --camera 1=navcam.toml --out pictures
    """
    sheets = load_sheets(camera or [], command="simgl replay")
    loaded = bare_scenario() if scenario is None else load_scenario(scenario)
    check_base(loaded)
    with RenderSession(loaded, open_simulator=_open) as render_session:
        count = replay(recording, render_session, out, sheets=sheets, every=every)
    print(f"{count} images in {out}")


def _open(scenario: Scenario) -> Simulator:
    with bake_bar() as progress:
        return Simulator(scenario, progress=progress)


def _say(line: str) -> None:
    """Print a line; where its disk is full the server serves all the same."""
    try:
        print(line, flush=True)
    except OSError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - for the rest of the process


def keys(
    name: Annotated[str, typer.Argument(help="Name of the pair, such as server or loop.")],
    out: Annotated[Path, typer.Option(help="Folder for the two files.")] = Path("."),
) -> None:
    """Make a pair of keys for the image service: NAME.key and NAME.key_secret.

    The server has one pair and a folder with the public keys of the clients that may come; each
    client has its own pair and the server's public key.

    Example: simgl keys server --out keys
    """
    public, secret = make_keys(name, out)
    print(f"{public} (public) and {secret} (secret, for its owner alone)")


def main() -> None:
    """``serve`` alone, as ``python -m simgl_bridge.commands SCENARIO``."""
    try:
        typer.run(serve)
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
