"""``simgl serve``, ``run``, ``replay`` and ``keys``: images over ZeroMQ, and access to them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simgl.commands.command_line import say
from simgl.commands.completion import scenario_files
from simgl.commands.web_options import WEB_PANEL, WebAddress, WebToken, refuse_without_web
from simgl.errors import ConfigError
from simgl.interruption import end_by_signals, exit_if_signalled
from simgl_bridge.bind_address import (
    DEFAULT_ADDRESS,
    DEFAULT_BASILISK_ADDRESS,
    check_bindable,
)

if TYPE_CHECKING:
    from simgl_bridge.serving import ServiceOptions
    from simgl_bridge.web_feed import WebOptions

_BASILISK, _FREE_RUN, _ACCESS = "Basilisk", "Free-run and previews", "Access"
_RECORDING = "Recording"

CameraFiles = Annotated[
    list[str] | None,
    typer.Option(
        help="ID=FILE: exposure, lens and detector of a camera of Basilisk.",
        rich_help_panel=_BASILISK,
    ),
]
BaseScenario = Annotated[
    Path | None,
    typer.Argument(
        help="Scenario file (TOML) with models, Earth and light.", autocompletion=scenario_files
    ),
]


def serve(
    scenario: Annotated[
        Path | None,
        typer.Argument(
            help="Scenario file (TOML); with --basilisk it may be left out.",
            autocompletion=scenario_files,
        ),
    ] = None,
    address: Annotated[
        str | None,
        typer.Option(
            help="tcp://127.0.0.1:PORT (* finds a free one) or ipc://PATH; "
            f"{DEFAULT_ADDRESS} unless --basilisk is given alone."
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, max=2**32 - 1, help="Noise seed, instead of the scenario's."),
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
    restart: Annotated[
        bool, typer.Option("--restart", help="Restart the server if it crashes.")
    ] = False,
    basilisk: Annotated[
        str | None,
        typer.Option(
            help="Address at which Basilisk finds its image source, such as tcp://127.0.0.1:5556.",
            rich_help_panel=_BASILISK,
        ),
    ] = None,
    camera: CameraFiles = None,
    monitor: Annotated[
        str | None,
        typer.Option(
            help="Address for preview images; they may be dropped.", rich_help_panel=_FREE_RUN
        ),
    ] = None,
    rate_hz: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=10000.0,
            help="Highest rate of images in free-run.",
            rich_help_panel=_FREE_RUN,
        ),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(
            help="Record requests and replies to a file in this folder; see simgl replay.",
            rich_help_panel=_RECORDING,
        ),
    ] = None,
    record_images: Annotated[
        bool,
        typer.Option(
            "--record-images",
            help="Record the images too, and not only their hashes.",
            rich_help_panel=_RECORDING,
        ),
    ] = False,
    keys: Annotated[
        Path | None,
        typer.Option(
            help="The server's .key_secret file; see simgl keys.", rich_help_panel=_ACCESS
        ),
    ] = None,
    allow: Annotated[
        Path | None,
        typer.Option(help="Folder with the .key files of the clients.", rich_help_panel=_ACCESS),
    ] = None,
    insecure: Annotated[
        bool,
        typer.Option(
            "--insecure",
            help="Accept any client, from other machines too.",
            rich_help_panel=_ACCESS,
        ),
    ] = False,
    web: Annotated[
        bool,
        typer.Option(
            "--web", help="Show what clients are sent in a browser.", rich_help_panel=WEB_PANEL
        ),
    ] = False,
    web_address: WebAddress = None,
    web_token: WebToken = None,
) -> None:
    """Serve a scenario's cameras to a closed-loop simulation over ZeroMQ.

    A client sends time, poses and exposure, and gets back the images of exactly that state.
    Ctrl-C or SIGTERM finishes the image being rendered and ends with exit code 0.

    Example: simgl serve approach.toml --address tcp://127.0.0.1:5563

    Example: simgl serve --basilisk tcp://127.0.0.1:5556 --camera 1=navcam.toml

    Example: simgl serve approach.toml --web
    """
    from simgl_bridge.access import Access
    from simgl_bridge.processes import RendererOptions
    from simgl_bridge.serving import ServiceOptions

    if basilisk is None:
        address = address or DEFAULT_ADDRESS
    of_simgl1 = {
        "--monitor": monitor,
        "--rate-hz": rate_hz,
        "--keys": keys,
        "--insecure": insecure,
        "--record": record,
        "--web": web,
    }
    _require("--address", address, of_simgl1, "; Basilisk's own protocol has nothing of the kind")
    if scenario is None and address is not None:
        raise ConfigError("simgl serve", "SCENARIO", "is required unless --basilisk is given")
    _require("--record", record, {"--record-images": record_images})
    _require("--basilisk", basilisk, {"--camera": camera})
    options = ServiceOptions(
        renderer=RendererOptions(
            scenario=None if scenario is None else str(scenario),
            seed=seed,
            root=None if root is None else str(root),
            basilisk=basilisk is not None,
            camera_files=tuple(camera or ()),
            record=None if record is None else str(record),
            record_images=record_images,
        ),
        address=address,
        basilisk=basilisk,
        monitor=monitor,
        rate_hz=rate_hz,
        root=root,
        access=Access(secret=keys, allowed=allow, insecure=insecure),
        web=_web_options(scenario, root, web, web_address, web_token, restart),
    )
    _check_addresses(options, restart)
    _serve(options, restart)


def _require(option: str, given: object, dependent: Mapping[str, object], reason: str = "") -> None:
    """Raise ConfigError for options that mean nothing without another one."""
    for name, value in dependent.items():
        if value and not given:
            raise ConfigError("simgl serve", name, f"requires {option}{reason}")


def _check_addresses(options: ServiceOptions, restart: bool) -> None:
    remote = options.access.allows_remote
    # Basilisk's protocol has no keys.
    addresses = {
        "--address": (options.address, remote),
        "--monitor": (options.monitor, remote),
        "--basilisk": (options.basilisk, False),
    }
    for option, (address, remote_allowed) in addresses.items():
        if address is None:
            continue
        check_bindable(address, remote_allowed=remote_allowed, option=option)
        if restart and address.endswith(":*"):
            problem = "needs ports that stay the same, not :*"
            raise ConfigError("simgl serve", "--restart", problem)


def _serve(options: ServiceOptions, restart: bool) -> None:
    """Serve until a signal; in a process of its own that is started again if it crashes."""
    from simgl_bridge.processes import PARENT_VARIABLE, StopWithParent, run_restarting
    from simgl_bridge.serving import serve_restarted, serve_until_stopped, stop_on_signals

    with stop_on_signals() as stop:
        parent = os.environ.pop(PARENT_VARIABLE, None)
        end = stop if parent is None else StopWithParent(stop, int(parent))
        if not restart:
            serve_until_stopped(options, end)
        elif code := run_restarting(serve_restarted, (options, os.getpid()), end):
            raise typer.Exit(code)


def _web_options(
    scenario: Path | None,
    root: Path | None,
    web: bool,
    address: str | None,
    token_file: Path | None,
    restart: bool,
) -> WebOptions | None:
    """What the browser view opens; None without ``--web``."""
    if not web:
        refuse_without_web(address, token_file)
        return None
    if root is not None:
        problem = "is not allowed with --root, by which clients change the scenario"
        raise ConfigError("simgl serve", "--web", problem)
    from simgl.web.web_access import DEFAULT_WEB_ADDRESS, web_access
    from simgl_bridge.web_feed import WebOptions

    address = address or DEFAULT_WEB_ADDRESS
    # A missing package or a wrong address is named before anything is loaded.
    web_access(address, token_file)
    if restart and address.endswith((":*", ":0")):
        raise ConfigError("simgl serve", "--restart", "needs a --web-address that stays the same")
    assert scenario is not None
    token = None if token_file is None else str(token_file)
    return WebOptions(scenario=str(scenario), address=address, token_file=token)


def run(
    program: Annotated[
        list[str],
        typer.Argument(help="The program and its arguments, after --.", metavar="COMMAND"),
    ],
    basilisk: Annotated[
        str, typer.Option(help="Address at which the program looks for its image source.")
    ] = DEFAULT_BASILISK_ADDRESS,
    scenario: Annotated[
        Path | None, typer.Option(help="Scenario file (TOML) with models, Earth and light.")
    ] = None,
    camera: CameraFiles = None,
    patience_s: Annotated[
        float,
        typer.Option(min=1.0, help="Longest time in seconds that the server may take to answer."),
    ] = 300.0,
) -> None:
    """Run a Basilisk program together with its image server; end it if the server dies.

    Basilisk itself would wait for ever. The exit code is the program's.

    Example: simgl run --camera 1=navcam.toml -- python scenario.py
    """
    from simgl_bridge.run_with_server import run_with_server
    from simgl_bridge.serving import stop_on_signals

    check_bindable(basilisk, option="--basilisk")
    if basilisk.endswith(":*"):
        raise ConfigError("simgl run", "--basilisk", "needs a port that the program knows, not :*")
    arguments = [] if scenario is None else [str(scenario)]
    arguments += ["--basilisk", basilisk]
    for entry in camera or []:
        arguments += ["--camera", entry]
    with stop_on_signals() as stop:
        code = run_with_server(arguments, basilisk, program, patience=patience_s, stop=stop)
    if code:
        raise typer.Exit(code)


def replay_recording(
    recording: Annotated[
        Path,
        typer.Argument(
            help="What simgl serve --record wrote, a folder or a file; or what Basilisk recorded: "
            "NAME_UnityViz.bin."
        ),
    ],
    scenario: BaseScenario = None,
    out: Annotated[
        Path, typer.Option(help="Folder for the images.", rich_help_panel=_BASILISK)
    ] = Path("replay"),
    camera: CameraFiles = None,
    every: Annotated[int, typer.Option(min=1, help="Render every n-th state.")] = 1,
    root: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            file_okay=False,
            help="The --root of the server, where it has moved.",
            rich_help_panel=_RECORDING,
        ),
    ] = None,
    changed: Annotated[
        bool,
        typer.Option(
            "--changed",
            help="Replay even if the scenario, or a file that it names, has changed.",
            rich_help_panel=_RECORDING,
        ),
    ] = False,
) -> None:
    """Render a recorded session again and compare, or render what Basilisk recorded.

    Each image of a session is compared with the recorded one; a difference is printed with its
    frame and state hash, and the exit code is then 1. The scenario is the recorded one unless
    SCENARIO says where it lies now. Of a recording of Basilisk, every camera and state becomes a
    PNG.

    Example: simgl replay records

    Example: simgl replay leo_UnityViz.bin --camera 1=navcam.toml --out pictures
    """
    from simgl.cli_progress import opened
    from simgl.scenario.loader import load_scenario
    from simgl_bridge.basilisk.camera_overrides import load_camera_files
    from simgl_bridge.basilisk.recording_replay import replay
    from simgl_bridge.basilisk.viz_scene import bare_scenario, check_base
    from simgl_bridge.render_session import RenderSession
    from simgl_bridge.session_recording import is_session
    from simgl_bridge.session_replay import replay_session, session_files

    if recording.is_dir() or is_session(recording):
        if camera:
            raise ConfigError("simgl replay", "--camera", "requires a recording of Basilisk")
        replayed = [
            replay_session(
                path,
                scenario=scenario,
                root=root,
                changed=changed,
                every=every,
                open_simulator=opened,
            )
            for path in session_files(recording)
        ]
        frames, different = sum(r.frames for r in replayed), sum(r.different for r in replayed)
        say(f"{frames} frames replayed, {different} differ")
        if different:
            raise typer.Exit(1)
        return
    for option, given in (("--root", root), ("--changed", changed)):
        if given:
            raise ConfigError("simgl replay", option, "requires a recorded session")
    overrides = load_camera_files(camera or [], command="simgl replay")
    loaded = bare_scenario() if scenario is None else load_scenario(scenario)
    check_base(loaded)
    with RenderSession(loaded, open_simulator=opened) as session:
        count = replay(recording, session, out, overrides=overrides, every=every)
    say(f"{count} images in {out}")


def keys(
    name: Annotated[str, typer.Argument(help="Name of the pair, such as server or loop.")],
    out: Annotated[Path, typer.Option(help="Folder for the two files.")] = Path("."),
) -> None:
    """Make a pair of keys for the image service: NAME.key and NAME.key_secret.

    The server has one pair and a folder with the public keys of its clients; each client has its
    own pair and the server's public key.

    Example: simgl keys server --out keys
    """
    from simgl_bridge.access import make_keys

    public, secret = make_keys(name, out)
    say(f"{public} (public) and {secret} (secret: do not hand it out)")


def main() -> None:
    """``serve`` alone, as ``python -m simgl_bridge.commands SCENARIO``."""
    end_by_signals()
    try:
        from simgl_bridge.serving import one_line_errors

        with one_line_errors():
            typer.run(serve)
    finally:
        exit_if_signalled()


if __name__ == "__main__":
    main()
