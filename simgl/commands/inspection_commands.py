"""Commands that look at one thing: OpenGL, cameras, models, frame times, a scenario in a window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgl.commands.command_line import FileFrameOptions, console, say, with_option_groups

ModelFile = Annotated[str, typer.Argument(help="Path of a model file, or a shipped name.")]


def doctor(
    device: Annotated[int | None, typer.Option(help="Look at this EGL device only.")] = None,
) -> None:
    """Report which OpenGL is available, and how to install what is missing.

    Example: simgl doctor --device 0
    """
    from simgl import __version__
    from simgl.doctor import examine

    findings = examine(device)
    for finding in findings:
        title = f"{finding.backend} {finding.device_index}"
        if finding.report is not None:
            kind = "CPU renderer" if finding.report.software else "GPU"
            line = f"{finding.report.renderer}, OpenGL {finding.report.version} ({kind})"
            console.print(f"[green]ok[/]      {title}: {line}", highlight=False, soft_wrap=True)
        elif finding.error is not None:
            needed = "[yellow]missing[/]" if finding.backend == "osmesa" else "[red]failed[/] "
            line = f"{finding.error.reason}\n        mend: {finding.error.remedy}"
            console.print(f"{needed} {title}: {line}", highlight=False, soft_wrap=True)
    usable = [finding for finding in findings if finding.report is not None]
    if not usable:
        console.print("No usable OpenGL.", style="red")
        raise typer.Exit(2)
    say(f"simgl {__version__} will render with {usable[0].backend}.")


def camera_test(
    preset: Annotated[str, typer.Argument(help="Preset name, or the path of a preset file.")],
    out: Annotated[Path | None, typer.Option(help="Folder for plots and the report.")] = None,
) -> None:
    """Measure a camera as a laboratory would (EMVA 1288), and compare with its preset.

    Example: simgl camera test mt9m034 --out out/camera
    """
    from rich.progress import Progress

    from simgl.assess.camera_plots import plot_report
    from simgl.assess.emva1288 import camera_under_test, examine, table
    from simgl.gpu.context import temporary_context
    from simgl.output import check_writable, complete_file

    camera, name = camera_under_test(preset), Path(preset).stem
    if out is not None:
        check_writable(out)
    with temporary_context() as ctx, Progress(console=console, transient=True) as bar:
        task = bar.add_task(f"{name}: flat fields and dark frames", total=None)
        report = examine(
            ctx, camera, progress=lambda done, of: bar.update(task, completed=done, total=of)
        )
    console.print(table(report, name))
    if out is not None:
        path = out / f"{name}.emva.png"
        with complete_file(path) as temporary:
            plot_report(report, name, temporary)
        say(path)
    if not report.passed:
        raise typer.Exit(1)


@with_option_groups
def model_check(file: ModelFile, frame: FileFrameOptions) -> None:
    """Report a model's size, parts, watertightness, materials, and what is not drawn.

    Example: simgl model check station.stl --unit mm --up-axis y
    """
    from simgl.inspection.model_check import examine, report_text

    say(report_text(examine(file, *frame.metres_and_axes())))


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
    say(write_turntable(file, out, *metres_and_axes))


def bench(
    json: Annotated[Path | None, typer.Option(help="Write the results to this file too.")] = None,
    scene: Annotated[list[str] | None, typer.Option(help="Only these scenes.")] = None,
    frames: Annotated[int, typer.Option(min=5, help="Timed frames of each scene.")] = 60,
    step: Annotated[
        float, typer.Option(min=0.0, help="Seconds from frame to frame; 0.1 as in a loop of 10 Hz.")
    ] = 1.0,
) -> None:
    """Time each pass and the whole frame, in process and through the bridge.

    Example: simgl bench --json bench.json
    """
    from simgl.bench import run, tables
    from simgl.output import complete_file

    results = run(scenes=scene, frames=frames, console=console, step_s=step)
    console.print(tables(results))
    if json is not None:
        with complete_file(json) as temporary:
            temporary.write_bytes(results.to_json())


def view(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    target: Annotated[
        str | None, typer.Option(help="Spacecraft to circle; the first if not given.")
    ] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help="Save the first frame here and close.")
    ] = None,
) -> None:
    """Show a scenario in a window: drag to orbit, scroll for range, space plays time.

    Example: simgl view examples/azimuths.toml
    """
    from simgl.viewer.window import run

    run(scenario, target, screenshot)
