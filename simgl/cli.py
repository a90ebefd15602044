"""The command line. Bad input gives one clear line and exit code 2."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simgl import __version__
from simgl.assess.assess_cli import assess
from simgl.campaign.campaign_cli import campaign
from simgl.errors import ConfigError, SimglError
from simgl.sequence.events import Event
from simgl.sequence.spans import Count, Duration, Random, Seed, Start, Step, Stop

app = typer.Typer(
    help="Camera images of spacecraft in low Earth orbit, in physical units.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
console = Console()


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    if version:
        console.print(__version__)
        raise typer.Exit


@app.command()
def doctor(
    device: Annotated[int | None, typer.Option(help="Look at this EGL device only.")] = None,
) -> None:
    """Say what OpenGL is found, and the line that mends what is missing.

    Example: simgl doctor --device 0
    """
    from simgl.doctor import examine

    findings = examine(device)
    for finding in findings:
        title = f"{finding.backend} {finding.device_index}"
        if finding.report is not None:
            kind = "CPU renderer" if finding.report.software else "GPU"
            console.print(
                f"[green]ok[/]      {title}: {finding.report.renderer}, "
                f"OpenGL {finding.report.version} ({kind})",
                highlight=False,
                soft_wrap=True,
            )
        elif finding.error is not None:
            needed = "[yellow]missing[/]" if finding.backend == "osmesa" else "[red]failed[/] "
            console.print(
                f"{needed} {title}: {finding.error.reason}\n        mend: {finding.error.remedy}",
                highlight=False,
                soft_wrap=True,
            )
    usable = [f for f in findings if f.report is not None]
    if not usable:
        console.print("No usable OpenGL.", style="red")
        raise typer.Exit(2)
    console.print(f"simgl {__version__} will render with {usable[0].backend}.", highlight=False)


@app.command()
def render(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")],
    camera: Annotated[
        list[str] | None, typer.Option(help="Camera name; all cameras if not given.")
    ] = None,
    at: Annotated[str | None, typer.Option(help="UTC epoch; the scenario's if not given.")] = None,
    layers: Annotated[
        bool, typer.Option("--layers", help="Also the radiance in parts, one for each light.")
    ] = False,
    packed: Annotated[
        bool, typer.Option("--packed", help="Also the DN as Mono12p, two pixels in three bytes.")
    ] = False,
    maps: Annotated[
        bool, typer.Option("--maps", help="Also heat maps with their scales, and false colours.")
    ] = False,
) -> None:
    """Render one epoch: radiance EXR, DN as 16-bit PNG, and a picture to look at.

    With --maps also heat maps of radiance, relative flux, photons, electrons and range, the LIDAR's
    where the camera has one, and the false colours of the source study.

    Example: simgl render examples/azimuths.toml --camera azimuth_28 --out out/azimuths
    """
    from simgl.cli_progress import opened
    from simgl.output import check_writable, write_capture
    from simgl.scenario.loader import load_scenario
    from simgl.sequence.epoch_options import camera_names, epoch_at
    from simgl.simulator import Product

    loaded = load_scenario(scenario)
    epoch = epoch_at(loaded, at)
    names = camera_names(loaded, camera)
    for name in names:
        bits = loaded.cameras[name].detector.bits
        if packed and bits > 12:
            problem = f'packs 12 bits or fewer, camera "{name}" has {bits}'
            raise ConfigError("command line", "--packed", problem)
    for craft, model in loaded.models.items():
        for note in model.notes:
            console.print(f"note: {craft}: {note}", highlight=False, markup=False, soft_wrap=True)
    state = loaded.at(epoch)
    products = {Product.DN, Product.RADIANCE, Product.TRUTH}
    if layers:
        products.add(Product.LAYERS)
    if maps:
        products |= {Product.IRRADIANCE, Product.ELECTRONS, Product.LIDAR}
    check_writable(out)
    with opened(loaded) as simulator:
        for name in names:
            exposure = simulator.capture(state, name, products, during=loaded.around(epoch))
            paths = write_capture(exposure, out, name, packed=packed)
            if maps:
                from simgl.maps import write_maps

                paths += write_maps(exposure, out, name)
            for path in paths:
                console.print(str(path), highlight=False, markup=False, soft_wrap=True)


@app.command()
def sequence(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    out: Annotated[Path, typer.Option(help="Folder for the results; a started one goes on.")],
    camera: Annotated[
        list[str] | None, typer.Option(help="Camera name; all cameras if not given.")
    ] = None,
    start: Start = None,
    stop: Stop = None,
    duration: Duration = None,
    step: Step = None,
    count: Count = None,
    random: Random = None,
    seed: Seed = 0,
    event: Annotated[Event | None, typer.Option(help="Frames where this begins.")] = None,
    target: Annotated[
        str | None, typer.Option(help="Spacecraft that --event is about; the first if not given.")
    ] = None,
    search_step: Annotated[float, typer.Option(help="Seconds between looks for --event.")] = 10.0,
    write: Annotated[str, typer.Option(help="Of dn, view, exr, mp4, with commas.")] = "dn,view",
    frame_rate: Annotated[int, typer.Option(min=1, max=240, help="Of the mp4, in Hz.")] = 24,
) -> None:
    """Render a trajectory: files of each frame, a table (SQLite and CSV), a video.

    A run that was broken off goes on where it was. Example:
    simgl sequence examples/trajectories/files.toml --duration 5400 --count 90 --out out/orbit
    """
    from simgl.cli_progress import frame_bar, opened
    from simgl.scenario.loader import load_scenario
    from simgl.sequence.epoch_options import EpochOptions, camera_names, outputs_named
    from simgl.sequence.run_sequence import Plan, run

    loaded = load_scenario(scenario)
    options = EpochOptions(
        start=start,
        stop=stop,
        duration_s=duration,
        step_s=step,
        count=count,
        random=random,
        seed=seed,
        event=event,
        search_step_s=search_step,
    )
    names = camera_names(loaded, camera)
    plan = Plan(
        scenario=loaded,
        cameras=names,
        epochs=options.epochs(loaded, names[0], target),
        outputs=outputs_named(write),
        frame_rate=frame_rate,
    )
    with opened(loaded) as simulator, frame_bar() as report:
        taken = run(plan, simulator, out, report)
    total = len(plan.epochs) * len(names)
    console.print(
        f"{total} frames in {out}, {taken} of them now; table: {out / 'frames.csv'}",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )


@app.command()
def exposure(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    camera: Annotated[str, typer.Option(help="Camera name.")],
    target: Annotated[str, typer.Option(help="Spacecraft to expose for.")],
    at: Annotated[str | None, typer.Option(help="UTC epoch; the scenario's if not given.")] = None,
) -> None:
    """Advise an exposure time: nothing saturated on the target, its back visible, a dark sky.

    Example: simgl exposure examples/approach.toml --camera navcam --target target
    """
    from simgl.assess.exposure_advice import advice_text, advise
    from simgl.cli_progress import opened
    from simgl.scenario.loader import load_scenario
    from simgl.sequence.epoch_options import epoch_at
    from simgl.simulator import Product

    loaded = load_scenario(scenario)
    state = loaded.at(epoch_at(loaded, at))
    with opened(loaded) as simulator:
        taken = simulator.capture(state, camera, {Product.ELECTRONS, Product.TRUTH})
    console.print(advice_text(advise(taken, state, target, loaded.criteria)), highlight=False)


app.command()(assess)


camera_app = typer.Typer(help="Cameras by themselves.", no_args_is_help=True)
app.add_typer(camera_app, name="camera")


@camera_app.command("test")
def camera_test(
    preset: Annotated[str, typer.Argument(help="Preset name, or the path of a preset file.")],
    out: Annotated[Path | None, typer.Option(help="Folder for plots and the report.")] = None,
) -> None:
    """Measure a camera as a laboratory would (EMVA 1288), beside what its preset says.

    Example: simgl camera test mt9m034 --out out/camera
    """

    from simgl.assess.camera_plots import plot_report
    from simgl.assess.emva1288 import camera_under_test, examine, table
    from simgl.gpu.context import temporary_context
    from simgl.output import check_writable, complete_file

    camera = camera_under_test(preset)
    if out is not None:
        check_writable(out)
    from rich.progress import Progress

    with temporary_context() as ctx, Progress(console=console, transient=True) as bar:
        task = bar.add_task(f"{Path(preset).stem}: flat fields and dark frames", total=None)
        report = examine(
            ctx, camera, progress=lambda done, of: bar.update(task, completed=done, total=of)
        )
    console.print(table(report, Path(preset).stem))
    if out is not None:
        path = out / f"{Path(preset).stem}.emva.png"
        with complete_file(path) as temporary:
            plot_report(report, Path(preset).stem, temporary)
        console.print(str(path), highlight=False, markup=False, soft_wrap=True)
    if not report.passed:
        raise typer.Exit(1)


model_app = typer.Typer(help="Models by themselves.", no_args_is_help=True)
app.add_typer(model_app, name="model")


# How a model file is to be read.
UnitName = Annotated[
    str | None, typer.Option("--unit", help="Of the file: m, mm, cm, in, ft or km.")
]
UnitMetres = Annotated[float | None, typer.Option(help="Or metres per unit of the file.")]
Up = Annotated[
    str | None, typer.Option("--up-axis", help="Of the file, becomes body -z: x, y, z, -x, ...")
]
Forward = Annotated[
    str | None, typer.Option("--forward-axis", help="Of the file, becomes body x; with --up-axis.")
]


@model_app.command("check")
def model_check(
    file: Annotated[str, typer.Argument(help="Path of a model file, or a shipped name.")],
    unit: UnitName = None,
    unit_m: UnitMetres = None,
    up_axis: Up = None,
    forward_axis: Forward = None,
) -> None:
    """Say what a model holds: size, parts, watertight or not, materials, what is not drawn.

    Example: simgl model check station.stl --unit mm --up-axis y
    """
    from simgl.inspection.model_check import examine, report_text

    report = examine(file, *_file_frame(unit, unit_m, up_axis, forward_axis))
    console.print(report_text(report), highlight=False, markup=False, soft_wrap=True)


@model_app.command("turntable")
def model_turntable(
    file: Annotated[str, typer.Argument(help="Path of a model file, or a shipped name.")],
    out: Annotated[Path, typer.Option(help="Folder for the picture.")],
    unit: UnitName = None,
    unit_m: UnitMetres = None,
    up_axis: Up = None,
    forward_axis: Forward = None,
) -> None:
    """Draw a model from eight sides on one sheet, the Sun over the camera's shoulder.

    Example: simgl model turntable iss_like --out out/models
    """
    from simgl.inspection.turntable import write_turntable
    from simgl.output import check_writable

    frame = _file_frame(unit, unit_m, up_axis, forward_axis)
    check_writable(out)
    path = write_turntable(file, out, *frame)
    console.print(str(path), highlight=False, markup=False, soft_wrap=True)


def _file_frame(
    unit: str | None, unit_m: float | None, up_axis: str | None, forward_axis: str | None
) -> tuple[float | None, str | None, str | None]:
    """The options on a model file's unit and axes: metres per unit, way up, way ahead."""
    from simgl.model_files.model_library import AXES, UNITS, body_from_file

    where = "command line"
    if unit is not None and unit not in UNITS:
        raise ConfigError(where, "--unit", f'must be one of {", ".join(UNITS)}, got "{unit}"')
    if unit is not None and unit_m is not None:
        raise ConfigError(where, "--unit-m", "contradicts --unit; give one of them")
    if unit_m is not None and not 0.0 < unit_m < float("inf"):
        raise ConfigError(where, "--unit-m", f"must be positive, got {unit_m:g}")
    for option, axis in (("--up-axis", up_axis), ("--forward-axis", forward_axis)):
        if axis is not None and axis not in AXES:
            raise ConfigError(where, option, f'must be one of {", ".join(AXES)}, got "{axis}"')
    try:
        body_from_file(1.0, up_axis, forward_axis)
    except ValueError as error:
        raise ConfigError(where, "--forward-axis", str(error)) from None
    return (unit_m if unit is None else UNITS[unit]), up_axis, forward_axis


@app.command()
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

    results = run(scenes=scene, frames=frames, console=console, step_s=step)
    console.print(tables(results))
    if json is not None:
        from simgl.output import complete_file

        with complete_file(json) as temporary:
            temporary.write_bytes(results.to_json())


@app.command()
def view(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    target: Annotated[
        str | None, typer.Option(help="Spacecraft to circle; the first if not given.")
    ] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help="Save the first frame here and close.")
    ] = None,
) -> None:
    """Look at a scenario in a window: drag to orbit, scroll for range, space plays time.

    Example: simgl view examples/azimuths.toml
    """
    from simgl.viewer.window import run

    run(scenario, target, screenshot)


app.command()(campaign)


def _load_further_commands() -> None:
    """Commands of other packages join through the entry-point group ``simgl.commands``."""
    for entry in entry_points(group="simgl.commands"):
        app.command(name=entry.name)(entry.load())


def main() -> None:
    """Entry point: run a command, turn a SimglError into one line and exit code 2."""
    try:
        _load_further_commands()
        app()
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
