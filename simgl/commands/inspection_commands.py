"""Commands that look at one thing: OpenGL, cameras, models, a scenario in a window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgl.cli_progress import activity, load, opened
from simgl.commands.command_line import (
    COMMAND_LINE,
    FileFrameOptions,
    Json,
    say,
    say_json,
    say_rich,
    with_option_groups,
)
from simgl.commands.completion import camera_presets, model_names, scenario_files
from simgl.commands.web_options import WEB_PANEL, WebAddress, WebToken, refuse_without_web
from simgl.errors import ConfigError

ModelFile = Annotated[
    str,
    typer.Argument(help="Path of a model file, or a shipped name.", autocompletion=model_names),
]


def doctor(
    device: Annotated[int | None, typer.Option(help="Look at this EGL device only.")] = None,
    json: Json = False,
) -> None:
    """Report which OpenGL is available, and how to install what is missing.

    Example: simgl doctor --device 0
    """
    from simgl import __version__
    from simgl.doctor import advice, check_opengl, findings_document

    with activity("opening OpenGL"):
        findings = check_opengl(device)
    usable = [finding.report for finding in findings if finding.report is not None]
    if json:
        say_json(findings_document(findings))
        raise typer.Exit(0 if usable else 2)
    for finding in findings:
        title = f"{finding.backend} {finding.device_index}"
        if finding.report is not None:
            kind = "CPU renderer" if finding.report.software else "GPU"
            line = f"{finding.report.renderer}, OpenGL {finding.report.version} ({kind})"
            say_rich(f"[green]ok[/]      {title}: {line}")
        elif finding.error is not None:
            line = f"{finding.error.reason}\n        mend: {finding.error.remedy}"
            if finding.backend != "osmesa":
                say_rich(f"[red]failed[/]  {title}: {line}")
            elif usable:
                say_rich(
                    f"[green]ok[/]      {title}: not there; a substitute that EGL makes needless"
                )
            else:
                say_rich(f"[yellow]missing[/] {title}: {line}")
    if not usable:
        say_rich("[red]No usable OpenGL.[/]")
        raise typer.Exit(2)
    say(f"simgl {__version__} will render with {usable[0].backend}.")
    if before_long_runs := advice(usable[0]):
        say(before_long_runs)


def camera_test(
    preset: Annotated[
        str,
        typer.Argument(
            help="Preset name, or the path of a preset file.", autocompletion=camera_presets
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for plots and the report.")] = None,
    json: Json = False,
) -> None:
    """Measure a camera as a laboratory would (EMVA 1288), and compare with its preset.

    Thermal detectors have NETD, response, MTF and time constant measured, without plots.
    Example: simgl camera test mt9m034 --out out/camera
    """
    from simgl.camera.infrared_detector import infrared_detectors

    if preset in infrared_detectors():
        _infrared_test(preset, out, json)
        return
    from simgl.assess.camera_plots import plot_report
    from simgl.assess.emva1288 import camera_under_test, measure_camera, report_document, table
    from simgl.gpu.context import temporary_context
    from simgl.output import check_writable, complete_file

    camera, name = camera_under_test(preset), Path(preset).stem
    if out is not None:
        check_writable(out)
    with temporary_context() as ctx, activity(f"{name}: flat fields and dark frames") as progress:
        report = measure_camera(ctx, camera, progress=progress)
    if json:
        say_json(report_document(report, name))
    else:
        say_rich(table(report, name))
    if out is not None:
        path = out / f"{name}.emva.png"
        with complete_file(path) as temporary:
            plot_report(report, name, temporary)
        if not json:
            say(path)
    if not report.passed:
        raise typer.Exit(1)


def _infrared_test(preset: str, out: Path | None, json: bool) -> None:
    from simgl.assess.infrared_measurement import (
        examine_infrared,
        infrared_document,
        infrared_table,
    )
    from simgl.camera.infrared_detector import load_infrared_detector

    if out is not None:
        raise ConfigError(
            COMMAND_LINE, "--out", f"requires a visible camera; {preset} has no plots"
        )
    detector = load_infrared_detector(preset)
    results = examine_infrared(detector)
    if json:
        say_json(infrared_document(detector, results))
    else:
        say_rich(infrared_table(detector, results))
    if not all(result.passed for result in results):
        raise typer.Exit(1)


def camera_export(
    scenario: Annotated[Path, typer.Argument(help="Scenario file.", autocompletion=scenario_files)],
    camera: Annotated[str, typer.Option(help="Camera name.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
    format: Annotated[str, typer.Option(help="opencv, kalibr or ros.")] = "opencv",
) -> None:
    """Write a camera's calibration for OpenCV, Kalibr or ROS.

    Example: simgl camera export examples/approach.toml --camera navcam --out navcam.yaml
    """
    from simgl.camera.calibration_text import FORMATS, calibration_text
    from simgl.errors import ConfigError, did_you_mean
    from simgl.output import complete_file

    if format not in FORMATS:
        problem = f'must be one of {", ".join(FORMATS)}, got "{format}"'
        raise ConfigError(COMMAND_LINE, "--format", problem)
    loaded = load(scenario)
    if camera not in loaded.cameras:
        problem = f'"{camera}" is not in {scenario}; {did_you_mean(camera, loaded.cameras)}'
        raise ConfigError(COMMAND_LINE, "--camera", problem)
    text = calibration_text(loaded.cameras[camera], format)
    with complete_file(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    say(out)


@with_option_groups
def model_check(file: ModelFile, frame: FileFrameOptions, json: Json = False) -> None:
    """Report a model's size, parts, watertightness, materials, and what is not drawn.

    Example: simgl model check station.stl --unit mm --up-axis y
    """
    from simgl.inspection.model_check import check_model, model_document, report_text

    with activity(f"reading {file}"):
        report = check_model(file, *frame.metres_and_axes())
    if json:
        say_json(model_document(report))
    else:
        say(report_text(report))


@with_option_groups
def model_turntable(
    file: ModelFile,
    out: Annotated[Path, typer.Option(help="Output folder.")],
    frame: FileFrameOptions,
) -> None:
    """Render a model from eight sides on one sheet, the Sun over the camera's shoulder.

    Example: simgl model turntable iss_like --out out/models
    """
    from simgl.inspection.turntable import write_turntable
    from simgl.output import check_writable

    metres_and_axes = frame.metres_and_axes()
    check_writable(out)
    with activity("drawing eight views"):
        sheet = write_turntable(file, out, *metres_and_axes)
    say(sheet)


def view(
    scenario: Annotated[
        Path | None, typer.Argument(help="Scenario file (TOML).", autocompletion=scenario_files)
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Spacecraft to circle; the first if not given.")
    ] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help="Save the first image here, without text, and close.")
    ] = None,
    camera: Annotated[
        str | None, typer.Option(help="Camera to look through; circles the target if not given.")
    ] = None,
    follow: Annotated[
        str | None,
        typer.Option(help="Show a running server's previews: its --monitor, tcp://HOST:PORT."),
    ] = None,
    web: Annotated[
        bool,
        typer.Option("--web", help="In a browser instead of a window.", rich_help_panel=WEB_PANEL),
    ] = False,
    web_address: WebAddress = None,
    web_token: WebToken = None,
) -> None:
    """Show a scenario in a window: drag to orbit, scroll for range, h for help.

    Example: simgl view examples/azimuths.toml

    Example: simgl view examples/approach.toml --web

    Example: simgl view --follow tcp://127.0.0.1:5564
    """
    from simgl.errors import ConfigError

    of_the_window = {"--target": target, "--screenshot": screenshot, "--camera": camera}
    if follow is not None:
        with_scenario = {"SCENARIO": scenario, **of_the_window, "--web": web or None}
        for option, given in with_scenario.items():
            if given is not None:
                raise ConfigError(COMMAND_LINE, option, "is not allowed with --follow")
        refuse_without_web(web_address, web_token)
        from simgl.viewer.window import follow as follow_server

        follow_server(follow)
        return
    if scenario is None:
        raise ConfigError(COMMAND_LINE, "SCENARIO", "is missing; or name a server by --follow")
    if web:
        for option, given in of_the_window.items():
            if given is not None:
                raise ConfigError(COMMAND_LINE, option, "is for the window, not for --web")
        _view_in_browsers(scenario, web_address, web_token)
        return
    refuse_without_web(web_address, web_token)
    from simgl.viewer.window import run

    run(scenario, target, screenshot, camera)


def _view_in_browsers(path: Path, address: str | None, token_file: Path | None) -> None:
    from simgl.web.page_server import PageServer
    from simgl.web.snapshots import NewestSnapshot
    from simgl.web.view_session import ViewSession
    from simgl.web.web_access import DEFAULT_WEB_ADDRESS, web_access

    access = web_access(address or DEFAULT_WEB_ADDRESS, token_file)
    loaded = load(path)
    newest = NewestSnapshot(loaded)
    # First of all: an address that is taken is told at once.
    with PageServer(newest, access) as server, opened(loaded) as simulator:
        say(f"Open {server.url} in a browser; Ctrl-C ends it.")
        ViewSession(simulator, newest).run()
