"""``python -m benchmarks.flight --truth DIR --out DIR``: flight.json and docs/flight_truth.md.

Two to six minutes on two cores. The folder of the truth holds CERES's mean albedos of 2018,
``ceres_2018_all_sky_1deg.csv`` and ``ceres_2018_clear_sky_1deg.csv``: (180, 360) from the south
pole and 180 deg west on; and images of the Moon, ``moon_msg3_seviri_2013-01-01T145644.nc`` and
``moon_mtsat2_2013-07-25T035138.nc``.
"""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import moderngl
import msgspec
import numpy as np
import typer

from benchmarks.flight.distant_earth import BELTS, DATES, Reflected, apparent_albedo, reflected
from benchmarks.flight.moon_images import correlation, disc_reflectance, measured, rendered
from benchmarks.record import write_record
from benchmarks.truth.page import Record, page
from benchmarks.truth.rows import Row, Table, difference, relative
from simgl.arrays import Array
from simgl.gpu.context import temporary_context
from simgl.output import check_writable, complete_file

HEAD = """# Earth and Moon against flight data

What satellites and earthshine measured, and what simgl shows. What misses its goal stays listed.
Made by `python -m benchmarks.flight --truth DIR --out DIR`.

**Albedo.** CERES measures all wavelengths, simgl's bands end at 400 and 1000 nm. Of the sunlight
8.5 % lies below, 29.5 % above. A broadband albedo A becomes that of the bands by taking off what is
reflected outside.

- Below 400 nm, molecules of an optical depth of 0.556 (at 360 nm, Hansen and Travis 1974) lie over
  ground that reflects a, as much as in the bands, where the air's own share is 0.06, and at least
  0.05: 0.294 + 0.498 a / (1 - 0.294 a), by Eddington's two-stream method. Ozone takes 24 % of it:
  all below 300 nm, two thirds to 330 nm.
- Above 1000 nm, where water, ice and clouds absorb, it is 0.64 A (all-sky: with it 29 of the
  99 W m-2 that the Earth reflects lie outside the bands) or 0.5 A (clear, an estimate; too little
  for deserts).

Belts are means weighted by the sunlight of a year.

**Earthshine.** p* is the light of the Earth over that of a white Lambertian globe at the same
phase, from 400 to 700 nm, measured on the dark side of the Moon (Goode et al. 2001; Palle et al.
2004).

The Earth is seen from the distance of the Moon by cameras all around, on four dates. Its weather
is that of one seed.

**The Moon.** Two images that imagers in geostationary orbit took of it (lunar observations of the
Global Space-based Inter-Calibration System; EUMETSAT and JMA are acknowledged). The reflectance of
the disc is its light over that of a white Lambertian disc. SEVIRI's calibration lies 5 to 8 % under
models of the Moon's light, so simgl should lie 3 to 8 % above it. simgl's band is moved to the
channel's wavelength by the model of Kieffer & Stone (2005). The correlation is between the
image and simgl's, laid over it by the affine map that fits best: of the frame with its black sky,
and of the lit disc alone. MTSAT-2 scanned with visible jumps from line to line.
"""

# Shares of the sunlight below 400 nm and above 1000 nm.
_BELOW, _ABOVE = 0.085, 0.295
_PHASES = (30.0, 45.0, 60.0, 75.0, 90.0)
_EARTHSHINE = 0.297


def in_bands(broadband: Array, *, clear: bool) -> Array:
    """Albedo from 400 to 1000 nm of a broadband one, as the page's head argues."""
    above = 0.5 if clear else 0.64
    result = broadband
    # Each round changes it by less than a tenth of the last change.
    for _ in range(12):
        ground = np.clip((result - 0.06) / 0.94, 0.05, 1.0)
        below = 0.76 * (0.294 + 0.498 * ground / (1.0 - 0.294 * ground))
        outside = _BELOW * below + _ABOVE * above * broadband
        result = (broadband - outside) / (1.0 - _BELOW - _ABOVE)
    return np.asarray(result)


def _belts(file: Path) -> Array:
    """(6,) means over the sunlight of a year, from the south."""
    albedo = np.loadtxt(file, delimiter=",").mean(axis=1)
    latitudes = np.radians(np.arange(-89.5, 90.0))
    declination = np.radians(23.44) * np.sin(np.radians(np.arange(360.0)))
    noon_to_set = np.arccos(np.clip(-np.outer(np.tan(latitudes), np.tan(declination)), -1.0, 1.0))
    sunlight = (
        noon_to_set * np.outer(np.sin(latitudes), np.sin(declination))
        + np.outer(np.cos(latitudes), np.cos(declination)) * np.sin(noon_to_set)
    ).mean(axis=1)
    belt = np.digitize(np.degrees(latitudes), BELTS[1:-1])
    weight = np.cos(latitudes) * sunlight
    return np.bincount(belt, weight * albedo) / np.bincount(belt, weight)


def _belt_rows(measured: Array, shown: Reflected, kind: str) -> list[Row]:
    names = [f"{low:.0f} to {high:.0f} deg" for low, high in pairwise(BELTS)]
    rows = zip(names, measured, shown.of_belts, strict=True)
    return [difference(f"{kind}, {name}", float(t), float(s), 0.04) for name, t, s in rows]


def _albedo_table(truth: Path, all_sky: Reflected, clear: Reflected) -> Table:
    rows = []
    for kind, shown in ("all-sky", all_sky), ("clear-sky", clear):
        broad = _belts(truth / f"ceres_2018_{kind.removesuffix('-sky')}_sky_1deg.csv")
        rows += _belt_rows(in_bands(broad, clear=kind == "clear-sky"), shown, kind)
    rows += [
        difference("all-sky, the Earth", 0.333, all_sky.over_bands(), 0.02),
        difference("effect of clouds", 0.155, all_sky.over_bands() - clear.over_bands(), 0.03),
    ]
    return Table(
        title="Albedo",
        reference="CERES, mean of 2018, made in-band",
        quantity="share of the sunlight from 400 to 1000 nm that is reflected",
        error="difference",
        rows=rows,
    )


def _earthshine_table(shown: Array) -> Table:
    """shown : (phases, epochs) p* from 400 to 700 nm; epochs of ``DATES`` one after another."""
    rows = [
        difference(f"phase angle {phase:.0f} deg", _EARTHSHINE, float(values.mean()), 0.02)
        for phase, values in zip(_PHASES, shown, strict=True)
    ]
    of_dates = shown.mean(axis=0).reshape(len(DATES), -1).mean(axis=1)
    rows += [
        difference(f"{date}, mean of phase angles", _EARTHSHINE, float(value), 0.02)
        for date, value in zip(DATES, of_dates, strict=True)
    ]
    return Table(
        title="Earthshine",
        reference="measured mean 0.297 at phase angles 30 to 90 deg",
        quantity="p*, mean over longitudes",
        error="difference",
        rows=rows,
    )


# Of SEVIRI's channels: name, simgl's band, the Moon's reflectance at the wavelength over that of
# the band, solar irradiance at 1 au [W m-2 um-1].
_SEVIRI = (("635 nm, R", 0, 0.986, 1617.0), ("810 nm, N", 3, 1.020, 1112.8))
# Lunar models over SEVIRI's calibration, and half the range.
_MODELS_OVER_SEVIRI, _RANGE = 1.055, 0.025


def moon_tables(gl: moderngl.Context, truth: Path) -> list[Table]:
    """The Moon's light and its picture."""
    seviri = measured(truth / "moon_msg3_seviri_2013-01-01T145644.nc")
    mtsat = measured(truth / "moon_mtsat2_2013-07-25T035138.nc")
    by_seviri, by_mtsat = rendered(gl, seviri), rendered(gl, mtsat)
    light = []
    for channel, (name, band, to_channel, sunlight) in enumerate(_SEVIRI):
        level = _MODELS_OVER_SEVIRI * disc_reflectance(seviri, channel, sunlight, by_seviri)
        shown = to_channel * float(by_seviri.reflectance[band])
        light.append(relative(name, level, shown, _RANGE))
    alike = []
    for name, image, seen, band, goals in (
        ("SEVIRI, phase angle 47 deg", seviri, by_seviri, 0, (0.03, 0.1)),
        ("MTSAT-2, phase angle 33 deg", mtsat, by_mtsat, 3, (0.03, 0.1)),
    ):
        likeness = correlation(image, 0, seen.bands[..., band])
        for part, value, goal in zip(("frame", "lit disc"), likeness, goals, strict=True):
            alike.append(difference(f"{name}, {part}", 1.0, value, goal))
    return [
        Table(
            title="Light of the Moon",
            reference="SEVIRI on Meteosat-10, 2013-01-01, raised by 5.5 % to lunar models",
            quantity="reflectance of the disc",
            error="relative",
            rows=light,
        ),
        Table(
            title="Picture of the Moon",
            reference="the image itself",
            quantity="correlation",
            error="difference",
            rows=alike,
        ),
    ]


def _over_visible(bands: Array, irradiance: Array) -> Array:
    """Of values (..., 4), the mean over R, G and B weighted by sunlight."""
    return np.asarray(np.average(bands[..., :3], axis=-1, weights=irradiance[:3]))


class _Run(msgspec.Struct, frozen=True, kw_only=True):
    minutes: float
    tables: list[Table]


def main(
    truth: Annotated[Path, typer.Option(help="Folder of the flight data.")],
    out: Annotated[Path, typer.Option(help="Folder for flight.json and flight_truth.md.")],
    views: Annotated[int, typer.Option(help="Cameras about the Earth.")] = 48,
    hours: Annotated[int, typer.Option(help="Times of each date.")] = 4,
) -> None:
    """Compare simgl's Earth and Moon with flight data."""
    check_writable(out)
    clear_day: dict[str, Any] = {"cover": 0.0}
    start = time.monotonic()
    with temporary_context() as gl:
        all_sky = reflected(gl, clouds={}, views=views, hours=hours)
        clear = reflected(gl, clouds=clear_day, views=views, hours=hours)
        shine = apparent_albedo(gl, phases=_PHASES, clouds={}, hours=2 * hours)
        of_moon = moon_tables(gl, truth)
    tables = [
        _albedo_table(truth, all_sky, clear),
        _earthshine_table(_over_visible(shine, all_sky.received.sum(axis=0))),
        *of_moon,
    ]
    minutes = (time.monotonic() - start) / 60.0
    write_record(out / "flight.json", _Run(minutes=minutes, tables=tables))
    record = msgspec.json.decode((out / "flight.json").read_bytes(), type=Record)
    with complete_file(out / "flight_truth.md") as part:
        part.write_text(page(record, HEAD))


if __name__ == "__main__":
    typer.run(main)
