"""Render the lighting study's cases and write their page: ``python -m examples.lighting_study``."""

from __future__ import annotations

import platform
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image

from examples.lighting_study.cases import CASES
from examples.lighting_study.page import page, readings, sheet
from examples.lighting_study.shot import smaller, take
from simgl import SimglError, load_scenario
from simgl.cli_progress import opened
from simgl.output import check_writable, complete_file

HERE = Path(__file__).parent
QUALITY = 85


def main(
    out: Annotated[Path, typer.Option(help="Folder for page and images.")] = Path("out/study"),
    shrink: Annotated[int, typer.Option(min=1, max=8, help="Images smaller by this.")] = 1,
    machine: Annotated[str, typer.Option(help="What the page says it ran on.")] = "",
) -> None:
    """Write lighting_study.md, and an image with its maps for each case."""
    check_writable(out / "pictures")
    shots, readings_of = {}, {}
    renderer = ""
    for file in dict.fromkeys(case.file for case in CASES):
        scenario = smaller(load_scenario(HERE / f"{file}.toml"), shrink)
        with opened(scenario) as simulator:
            renderer = simulator.renderer_name.rsplit(", ", 1)[0]
            for case in (case for case in CASES if case.file == file):
                shot = take(simulator, case.camera)
                shots[case.name], readings_of[case.name] = shot, readings(case, shot)
                path = out / "pictures" / f"study_{case.name}.jpg"
                with complete_file(path) as temporary:
                    Image.fromarray(sheet(shot)).save(temporary, quality=QUALITY)
                print(path)
    on = machine or f"{platform.machine()} {platform.system()}"
    made = f"{datetime.now(UTC):%Y-%m-%d}, {renderer}, {on}"
    path = out / "lighting_study.md"
    with complete_file(path) as temporary:
        temporary.write_text(page(shots, readings_of, made), encoding="utf-8")
    print(path)


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"lighting_study: {error}", file=sys.stderr)
        sys.exit(2)
