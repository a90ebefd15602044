"""Commands that render: ``simgl render``, ``sequence``, ``campaign`` and ``exposure``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simgl.cli_progress import activity, load, opened
from simgl.commands.command_line import (
    COMMAND_LINE,
    Json,
    WorkerOptions,
    resumable,
    say,
    say_json,
    with_option_groups,
)
from simgl.commands.completion import scenario_files
from simgl.errors import ConfigError, did_you_mean
from simgl.interruption import set_result_so_far
from simgl.sequence.epoch_options import EpochOptions, EventOptions

if TYPE_CHECKING:
    from simgl.campaign.frame_task import Format
    from simgl.scenario.scenario import Scenario
    from simgl.sequence.run_sequence import Output

ScenarioFile = Annotated[
    Path, typer.Argument(help="Scenario file (TOML).", autocompletion=scenario_files)
]
Cameras = Annotated[
    list[str] | None, typer.Option(help="Camera name, once for each camera; all if not given.")
]
At = Annotated[str | None, typer.Option(help="UTC epoch; the scenario's if not given.")]
ResumableFolder = Annotated[Path, typer.Option(help="Output folder; an existing run is resumed.")]


def render(
    scenario: ScenarioFile,
    out: Annotated[Path, typer.Option(help="Output folder.")],
    camera: Cameras = None,
    at: At = None,
    layers: Annotated[
        bool, typer.Option("--layers", help="Also the radiance of each light source.")
    ] = False,
    packed: Annotated[
        bool, typer.Option("--packed", help="Also the DN as Mono12p, two pixels in three bytes.")
    ] = False,
    maps: Annotated[
        bool, typer.Option("--maps", help="Also heat maps with their scales, and false colours.")
    ] = False,
    draw: Annotated[
        int,
        typer.Option(
            min=0,
            max=2**32 - 1,
            help="Noise realisation: each number gives other, independent noise.",
        ),
    ] = 0,
) -> None:
    """Render one epoch: radiance EXR, DN as 16-bit PNG, and an sRGB preview.

    With --maps also heat maps of radiance, relative flux, photons, electrons and range, the LIDAR's
    where the camera has one, and the false colours of the source study.

    Example: simgl render examples/azimuths.toml --camera azimuth_28 --out out/azimuths
    """
    from simgl.output import check_writable, write_capture
    from simgl.sequence.epochs import epoch_at
    from simgl.simulator import Product, products_of

    loaded = load(scenario)
    epoch = epoch_at(loaded, at)
    names = camera_names(loaded, camera)
    for name in names:
        bits = loaded.cameras[name].detector.bits
        if packed and bits > 12:
            problem = f'packs 12 bits or fewer, camera "{name}" has {bits}'
            raise ConfigError(COMMAND_LINE, "--packed", problem)
    products = {Product.DN, Product.RADIANCE, Product.THERMAL, Product.TRUTH}
    if layers:
        products.add(Product.LAYERS)
    if maps:
        products |= {Product.IRRADIANCE, Product.ELECTRONS, Product.LIDAR}
    check_writable(out)
    written: list[str] = []
    set_result_so_far(
        lambda: (
            f"{len(written)} of {len(names)} cameras are complete in {out}, "
            "the same command draws all of them again"
        )
    )
    with opened(loaded) as simulator:
        for name in names:
            with activity(f"drawing {name}") as progress:
                wanted = products & products_of(loaded.cameras[name])
                capture = simulator.capture_at(epoch, name, wanted, draw)
                progress.begin_stage(f"writing {name}")
                paths = write_capture(capture, out, name, packed=packed)
                if maps:
                    from simgl.figures.maps import write_maps

                    progress.begin_stage(f"maps of {name}")
                    paths += write_maps(capture, out, name, progress)
            written.append(name)
            say(*paths)


@with_option_groups
def sequence(
    scenario: ScenarioFile,
    out: ResumableFolder,
    epochs: EpochOptions,
    event: EventOptions,
    camera: Cameras = None,
    write: Annotated[
        str, typer.Option(help="Files of dn, view, exr, mp4, separated by commas.")
    ] = "dn,view",
    frame_rate: Annotated[
        int, typer.Option(min=1, max=240, help="Frame rate of the MP4 file in Hz.")
    ] = 24,
) -> None:
    """Render a trajectory: files of each frame, a table (SQLite and CSV), a video.

    An interrupted run is resumed. Example:
    simgl sequence examples/trajectories/files.toml --duration 5400 --count 90 --out out/orbit
    """
    from simgl.sequence.epochs import epochs as chosen_epochs
    from simgl.sequence.run_sequence import Plan, run

    loaded = load(scenario)
    names = camera_names(loaded, camera)
    plan = Plan(
        scenario=loaded,
        cameras=names,
        epochs=chosen_epochs(loaded, epochs, names[0], event),
        outputs=_outputs(write),
        frame_rate=frame_rate,
    )
    total = len(plan.epochs) * len(names)
    resumable(out, total, "frames")
    with opened(loaded) as simulator, activity("drawing frames") as progress:
        rendered = run(plan, simulator, out, progress)
    say(f"{total} frames in {out}, {rendered} of them now; table: {out / 'frames.csv'}")


@with_option_groups
def campaign(
    file: Annotated[
        Path, typer.Argument(help="Campaign file (TOML).", autocompletion=scenario_files)
    ],
    out: ResumableFolder,
    workers: WorkerOptions,
    format: Annotated[
        str,
        typer.Option(
            help="Further data sets: bop, colmap, nerfstudio, webdataset, yolo; commas between."
        ),
    ] = "",
) -> None:
    """Render randomised frames in parallel, with labels for training.

    An interrupted run is resumed. Example:
    simgl campaign examples/campaign/approach.toml --workers 2 --out out/campaign
    """
    from simgl.campaign.campaign_file import load_campaign
    from simgl.campaign.frame_task import CampaignJob
    from simgl.campaign.run_campaign import run
    from simgl.workers.executors import select_executor

    with activity(f"loading {file.name}"):
        loaded = load_campaign(file)
    formats = _formats(format)
    job = CampaignJob(campaign=loaded, formats=formats)
    resumable(out, loaded.frames, "frames")
    with opened(loaded.scenario) as simulator, activity("drawing frames") as progress:
        executor = select_executor(job, simulator, workers.workers, workers.scheduler)
        rendered, renderers = run(loaded, out, executor, progress, formats)
    say(f"{loaded.frames} frames in {out}, {rendered} of them now; labels: {out}/coco.json")
    if len(renderers) > 1:
        say(f"note: taken by different renderers: {'; '.join(renderers)}")


def exposure(
    scenario: ScenarioFile,
    camera: Annotated[str, typer.Option(help="Camera name.")],
    target: Annotated[str, typer.Option(help="Spacecraft to expose for.")],
    at: At = None,
    json: Json = False,
) -> None:
    """Recommend an exposure time: target not saturated, its dark side visible, sky dark.

    Example: simgl exposure examples/approach.toml --camera navcam --target target
    """
    from simgl.assess.exposure_advice import advice_document, advice_text, advise
    from simgl.assess.trajectory_assessment import assignment
    from simgl.sequence.epochs import epoch_at
    from simgl.simulator import Product

    loaded = load(scenario)
    # Names are looked up before anything is drawn.
    assignment(loaded, camera, target, [])
    state = loaded.at(epoch_at(loaded, at))
    with opened(loaded) as simulator, activity(f"drawing {camera}"):
        capture = simulator.capture(state, camera, {Product.ELECTRONS, Product.TRUTH})
    advice = advise(capture, state, target, loaded.criteria)
    if json:
        say_json(advice_document(advice))
    else:
        say(advice_text(advice))


def camera_names(scenario: Scenario, wanted: list[str] | None) -> tuple[str, ...]:
    """The cameras asked for, all if None; raises ConfigError for one that does not exist."""
    where = str(scenario.source or scenario.name)
    if not scenario.cameras:
        raise ConfigError(where, "camera", "is missing; an image needs a [camera.NAME]")
    for name in wanted or []:
        if name not in scenario.cameras:
            problem = f'"{name}" is not in {where}; {did_you_mean(name, scenario.cameras)}'
            raise ConfigError(COMMAND_LINE, "--camera", problem)
    return tuple(dict.fromkeys(wanted)) if wanted else tuple(scenario.cameras)


def _formats(text: str) -> frozenset[Format]:
    """The data sets that ``bop,yolo`` asks for; raises ConfigError for an unknown one."""
    from simgl.campaign.frame_task import Format

    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in set(Format):
            problem = f'has no "{name}"; {did_you_mean(name, [str(f) for f in Format])}'
            raise ConfigError(COMMAND_LINE, "--format", problem)
    return frozenset(Format(name) for name in names)


def _outputs(text: str) -> frozenset[Output]:
    """The files that ``dn,view`` asks for; raises ConfigError for an unknown kind."""
    from simgl.sequence.run_sequence import Output

    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in set(Output):
            problem = f'has no "{name}"; {did_you_mean(name, [str(o) for o in Output])}'
            raise ConfigError(COMMAND_LINE, "--write", problem)
    return frozenset(Output(name) for name in names)
