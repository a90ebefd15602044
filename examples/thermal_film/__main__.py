"""Film a pass through the Earth's shadow in both bands: ``python -m examples.thermal_film``.

Temperatures follow from the scenario's epoch on: panels lag behind the Sun, thin edges cool first.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from matplotlib import colormaps
from PIL import Image, ImageDraw, ImageFont

from simgl import (
    Capture,
    Product,
    SimglError,
    Simulator,
    display_from_radiance,
    display_gain,
    load_scenario,
)
from simgl.arrays import Array, Image8
from simgl.cli_progress import activity
from simgl.figures.style import LIGHT_MAP
from simgl.output import check_writable, complete_file

SCENE = Path(__file__).with_name("scene.toml")
# From the epoch: five minutes of sunlight, the shadow of 35, and five more [min].
MINUTES = range(30, 78, 3)
FRAME_MS = 350
# Of the colours [K].
COLD, WARM = 200.0, 350.0
SIZE = 480, 384
_BAR, _LINE, QUALITY = 14, 22, 60


def main(
    out: Annotated[Path, typer.Option(help="Folder for the film.")] = Path("out/thermal_film"),
) -> None:
    """Writes thermal_film.webp, and a CSV of the mean temperatures that the camera sees."""
    check_writable(out)
    scenario = load_scenario(SCENE)
    frames, rows = [], ["minute,sunlit_share,warmest_k,mean_k,coldest_k"]
    with activity("filming") as progress, Simulator(scenario) as simulator:
        for number, minute in enumerate(MINUTES):
            tai_ns = scenario.epoch_tai_ns + minute * 60 * 10**9
            state = scenario.at(tai_ns)
            wanted = {
                "visible": {Product.RADIANCE},
                "infrared": {Product.THERMAL},
            }
            visible, infrared = simulator.captures(
                state, wanted, temperatures=simulator.temperatures.at(tai_ns)
            )
            sunlit = float(state.sunlit_share(state.bodies["client"].pose.position))
            frames.append(_panel(visible, infrared, minute, sunlit))
            rows.append(f"{minute},{sunlit:.3f}," + _temperatures(infrared))
            progress(number + 1, len(MINUTES))
    with complete_file(out / "thermal_film.webp") as temporary:
        first, *others = (Image.fromarray(frame) for frame in frames)
        first.save(
            temporary,
            format="WEBP",
            save_all=True,
            append_images=others,
            duration=FRAME_MS,
            loop=0,
            quality=QUALITY,
            method=4,
        )
    with complete_file(out / "thermal_film.csv") as temporary:
        temporary.write_text("\n".join(rows) + "\n")
    print(out / "thermal_film.webp")


def _temperatures(seen: Capture) -> str:
    assert seen.thermal is not None
    kelvin = seen.thermal.temperature
    of_spacecraft = kelvin[kelvin > 0.0]
    return f"{of_spacecraft.max():.1f},{of_spacecraft.mean():.1f},{of_spacecraft.min():.1f}"


def _panel(visible: Capture, infrared: Capture, minute: int, sunlit: float) -> Image8:
    """Both images side by side, with a scale in K."""
    assert visible.radiance is not None
    assert infrared.thermal is not None
    kelvin = infrared.thermal.brightness_temperature
    # By moonlight a camera exposes for longer.
    seen = visible.radiance.radiance
    gain = display_gain(seen)
    images = [display_from_radiance(seen, gain), _coloured(kelvin)]
    sheet = Image.new("RGB", (2 * SIZE[0] + 5 * _BAR, SIZE[1] + _LINE), "black")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=0.65 * _LINE)
    light = "sunlight" if sunlit > 0.99 else "Earth's shadow" if sunlit < 0.01 else "penumbra"
    left = f"{minute} min, {light}: visible, gain {gain:,.0f}"
    names = left, "7.5 to 13.5 um, brightness temperature"
    for column, (picture, name) in enumerate(zip(images, names, strict=True)):
        small = Image.fromarray(picture).resize(SIZE, Image.Resampling.LANCZOS)
        sheet.paste(small, (column * SIZE[0], _LINE))
        pen.text((column * SIZE[0] + 6, 3), name, fill="white", font=font)
    ramp = _coloured(np.linspace(WARM, COLD, SIZE[1])[:, None].repeat(_BAR, axis=1))
    sheet.paste(Image.fromarray(ramp), (2 * SIZE[0] + 4, _LINE))
    for value in (350, 300, 250, 200):
        y = _LINE + (WARM - value) / (WARM - COLD) * (SIZE[1] - 14)
        pen.text((2 * SIZE[0] + 8 + _BAR, y), f"{value} K", fill="white", font=font)
    return np.asarray(sheet)


def _coloured(kelvin: Array) -> Image8:
    share = np.clip((kelvin - COLD) / (WARM - COLD), 0.0, 1.0)
    return np.round(255.0 * colormaps[LIGHT_MAP](share)[..., :3]).astype(np.uint8)


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"thermal_film: {error}", file=sys.stderr)
        sys.exit(2)
