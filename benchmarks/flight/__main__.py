"""``python -m benchmarks.flight --truth DIR --out DIR``: flight.json, flight_truth.md and moon.png.

A quarter of an hour on two idle cores. The folder of the truth holds CERES's mean
albedos of 2018, ``ceres_2018_all_sky_1deg.csv`` and ``ceres_2018_clear_sky_1deg.csv``: (180, 360)
from the south pole and 180 deg west on; and images of the Moon,
``moon_msg3_seviri_2013-01-01T145644.nc`` and ``moon_mtsat2_2013-07-25T035138.nc``.
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

from benchmarks.flight.air import air_tables
from benchmarks.flight.distant_earth import (
    BELTS,
    DATES,
    Box,
    Reflected,
    apparent_albedo,
    noon_discs,
    reflected,
)
from benchmarks.flight.low_orbit import FACES, FaceLight, cube_light
from benchmarks.flight.moon_images import (
    Overlay,
    disc_reflectance,
    measured,
    overlay,
    rendered,
)
from benchmarks.record import write_record
from benchmarks.truth.page import Record, page
from benchmarks.truth.rows import Row, Table, difference, relative
from simgl.arrays import Array, Image8
from simgl.display_images import contact_sheet, png_bytes
from simgl.gpu.context import temporary_context
from simgl.output import check_writable, complete_file

HEAD = """# Earth and Moon against flight data

This page compares simgl with measurements of satellites and of earthshine. Rows that miss their
goal stay in the table. Made by `python -m benchmarks.flight --truth DIR --out DIR`.

**Albedo.** CERES measures all wavelengths; simgl's bands end at 400 and 1000 nm. 8.5 % of the
sunlight lies below, 29.5 % above. A broadband albedo A is converted to that of the bands by
subtracting the light that is reflected outside.

- Below 400 nm it is 0.294 + 0.498 a / (1 - 0.294 a), by Eddington's two-stream method: molecules of
  optical depth 0.556 (at 360 nm, Hansen and Travis 1974) over ground of reflectance a. a is that of
  the bands, of which the air contributes 0.06, and at least 0.05. Ozone absorbs 24 % of this light:
  all below 300 nm, two thirds up to 330 nm.
- Above 1000 nm, where water, ice and clouds absorb, it is 0.64 A for all-sky albedos: 29 of the
  99 W m-2 that the Earth reflects then lie outside the bands. For clear skies it is 0.5 A, an
  estimate that is too low for deserts.

Belts and parts of the Earth are means weighted by the sunlight of a year.

**Full discs** are the whole Earth at noon over a longitude, each divided by the mean of the four.
The truth assumes that every place is Lambertian with its mean albedo.

**Cube in low orbit.** Earthshine on the faces of a cube at 400 km in an orbit of 51.6 deg, mean
over an orbit, divided by that of a Lambertian Earth with CERES's mean albedo of each place; fifteen
orbits on each date. The truth has no weather of the day. It has no albedo that grows as the Sun
sinks; simgl has, which cancels over an orbit to some per cent. It has no preferred directions of
clouds and sea. The median should be near 1; the spread is half the range from 16 to 84 % of the
orbits.

**Earthshine.** p* is the light of the Earth over that of a white Lambertian globe at the same
phase, from 400 to 700 nm. It was measured on the dark side of the Moon (Goode et al. 2001; Palle et
al. 2004), as a mean over the nights of those phases. The Earth is not a Lambertian globe: from all
measured phases Robinson (2025, arXiv:2507.22258) finds a spherical albedo of 0.294 in these bands
and a geometric albedo of 0.242, a p* of 0.363 at full phase.

In simgl cameras all around, at the distance of the Moon, see the Earth on four dates, each with the
weather of another seed. This run has `--views 24`; belts under a clear sky are within 0.004 of
those of 48 cameras.

**The Moon.** Two images of the Moon by imagers in geostationary orbit (lunar observations of the
Global Space-based Inter-Calibration System; EUMETSAT and JMA are acknowledged). The reflectance of
the disc is its light over that of a white Lambertian disc.

- SEVIRI's calibration is good to some per cent. The Lunar Irradiance Model of ESA (LIME, release of
  2025-10-10; Toledano et al. 2024; good to 2 %) has 1.023 and 0.992 times SEVIRI's light in its
  channels, at that phase and libration, waning included: this is the truth.
- simgl uses the part of LIME that depends on the phase alone, and a map of the seas for the rest.
- By Aqua-MODIS SEVIRI is 8 and 6 % too low (Meirink et al. 2013), a level 6 % above LIME's. Both
  agree in colour; SEVIRI's colour on the scale of MODIS is the truth of the third row.
- simgl's bands are converted to the channels by LIME's spectrum.
- The correlation is between the image and simgl's, after the affine map that fits best: of the
  frame with its black sky, and of the lit disc alone. MTSAT-2 scanned with visible jumps from line
  to line.
- The command writes the images, simgl's images, and their ratio to `moon.png` of its folder. The
  images may not be published here.

**The air** is that of the U.S. Standard Atmosphere, 1976. Its density determines the height of the
limb, and the refraction of limb, stars and Sun.
"""

# Shares of the sunlight below 400 nm and above 1000 nm.
_BELOW, _ABOVE = 0.085, 0.295
_PHASES = (30.0, 45.0, 60.0, 75.0, 90.0)
_EARTHSHINE = 0.297
# Longitudes of full discs [deg].
DISCS = (-150.0, -60.0, 20.0, 110.0)
# South, north, west and east edges [deg].
PARTS: dict[str, Box] = {
    "Congo": (-5.0, 5.0, 10.0, 30.0),
    "Amazon": (-10.0, 0.0, -70.0, -50.0),
    "Europe": (45.0, 55.0, 0.0, 30.0),
    "Sahara": (15.0, 30.0, -5.0, 30.0),
    "North Pacific": (40.0, 50.0, 160.0, 180.0),
    "stratocumulus off Peru": (-25.0, -10.0, -90.0, -75.0),
    "stratocumulus off Namibia": (-25.0, -10.0, -5.0, 10.0),
    "South China": (20.0, 35.0, 105.0, 120.0),
    "India": (10.0, 25.0, 75.0, 85.0),
    "Indonesia": (-10.0, 5.0, 95.0, 140.0),
    "trades of the Pacific": (-20.0, -10.0, -160.0, -110.0),
    "trades of the Atlantic": (10.0, 20.0, -55.0, -30.0),
    "Australia": (-30.0, -20.0, 120.0, 145.0),
    "Southern Ocean": (-60.0, -50.0, -180.0, 180.0),
    "Siberia": (50.0, 65.0, 60.0, 120.0),
}


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


def _sunlight() -> Array:
    """(180, 1) that a year brings to a degree of latitude, from the south, in any unit."""
    latitudes = np.radians(np.arange(-89.5, 90.0))
    declination = np.radians(23.44) * np.sin(np.radians(np.arange(360.0)))
    noon_to_set = np.arccos(np.clip(-np.outer(np.tan(latitudes), np.tan(declination)), -1.0, 1.0))
    sunlight = (
        noon_to_set * np.outer(np.sin(latitudes), np.sin(declination))
        + np.outer(np.cos(latitudes), np.cos(declination)) * np.sin(noon_to_set)
    ).mean(axis=1)
    return np.asarray(np.cos(latitudes) * sunlight)[:, None]


def _mean_of(albedo: Array, box: Box) -> float:
    """Of a map (180, 360), over the sunlight of a year in a part of the Earth."""
    south, north, west, east = box
    part = slice(round(south + 90.0), round(north + 90.0))
    values = albedo[part, round(west + 180.0) : round(east + 180.0)].mean(axis=1)
    return float(np.average(values, weights=_sunlight()[part, 0]))


def _disc_truth(albedo: Array) -> Array:
    """As ``noon_discs``, of a Lambertian Earth, mean over the year of the Sun's declinations."""
    latitude = np.radians(np.arange(-89.5, 90.0))[:, None]
    declination = np.radians(23.44) * np.sin(np.radians(np.arange(0.0, 360.0, 15.0)))
    light = []
    for east in DISCS:
        turn = np.radians(np.arange(-179.5, 180.0) - east)
        seen = np.maximum(np.cos(latitude) * np.cos(turn), 0.0)
        lit = [
            np.maximum(np.sin(latitude) * np.sin(d) + seen * np.cos(d), 0.0) for d in declination
        ]
        light.append((albedo * seen * np.mean(lit, axis=0) * np.cos(latitude)).sum())
    return np.array(light) / np.mean(light)


def _belt_rows(measured: Array, shown: Reflected, kind: str) -> list[Row]:
    names = [f"{low:.0f} to {high:.0f} deg" for low, high in pairwise(BELTS)]
    rows = zip(names, measured, shown.of_belts, strict=True)
    return [difference(f"{kind}, {name}", float(t), float(s), 0.04) for name, t, s in rows]


def _albedo_table(truth: Path, all_sky: Reflected, clear: Reflected) -> Table:
    rows = []
    for kind, shown in ("all-sky", all_sky), ("clear-sky", clear):
        broad = _ceres(truth, kind)
        belts = [_mean_of(broad, (south, north, -180.0, 180.0)) for south, north in pairwise(BELTS)]
        rows += _belt_rows(in_bands(np.array(belts), clear=kind == "clear-sky"), shown, kind)
    rows += [
        difference("all-sky, the Earth", 0.333, all_sky.of_all, 0.02),
        difference("effect of clouds", 0.155, all_sky.of_all - clear.of_all, 0.03),
    ]
    return Table(
        title="Albedo",
        reference="CERES, mean of 2018, made in-band",
        quantity="share of the sunlight from 400 to 1000 nm that is reflected",
        error="difference",
        rows=rows,
    )


def _ceres(truth: Path, kind: str) -> Array:
    """(180, 360) broadband albedo from the south pole and 180 deg west on."""
    name = f"ceres_2018_{kind.removesuffix('-sky')}_sky_1deg.csv"
    return np.loadtxt(truth / name, delimiter=",")


def _parts_table(albedo: Array, all_sky: Reflected) -> Table:
    """albedo : as ``_ceres``, in-band"""
    return Table(
        title="Albedo of parts of the Earth, all-sky",
        reference="CERES, mean of 2018, made in-band",
        quantity="share of the sunlight from 400 to 1000 nm that is reflected",
        error="difference",
        rows=[
            difference(name, _mean_of(albedo, box), all_sky.of(box), 0.04)
            for name, box in PARTS.items()
        ],
    )


def _discs_table(albedo: Array, shown: Array) -> Table:
    """albedo : as ``_ceres``, in-band; shown : as ``noon_discs``"""
    rows = zip(DISCS, _disc_truth(albedo), shown, strict=True)
    return Table(
        title="Full discs at noon",
        reference="CERES, mean of 2018, made in-band, Lambertian",
        quantity="light of the disc, 400 to 1000 nm, over the mean of the four",
        error="difference",
        rows=[
            difference(
                f"over {abs(east):.0f} deg {'W' if east < 0 else 'E'}", float(t), float(s), 0.03
            )
            for east, t, s in rows
        ],
    )


def _cube_table(light: FaceLight) -> Table:
    rows = []
    for name, ratios in zip(FACES, light.ratios.T, strict=True):
        low, middle, high = np.percentile(ratios, (16.0, 50.0, 84.0))
        rows.append(difference(f"{name}, median", 1.0, float(middle), 0.1))
        rows.append(difference(f"{name}, spread", 0.0, float(0.5 * (high - low)), 0.1))
    return Table(
        title="Cube in low orbit",
        reference="Lambertian Earth of CERES's mean albedos of 2018, made in-band",
        quantity="mean irradiance of an orbit, 400 to 1000 nm, over that of the truth",
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


# Of SEVIRI's channels: name, simgl's band, the Moon's reflectance in the channel over that in the
# band, solar irradiance at 1 au [W m-2 um-1], the light by LIME and by MODIS over SEVIRI's.
_SEVIRI = (
    ("635 nm, R", 0, 0.9835, 1617.0, 1.0227, 1.0 / 0.92),
    ("810 nm, N", 3, 0.9976, 1112.8, 0.9921, 1.0 / 0.94),
)
# What is left between LIME, which is good to 2 %, and another model's waning and libration.
_RANGE = 0.025


def moon_tables(gl: moderngl.Context, truth: Path) -> tuple[list[Table], dict[str, Overlay]]:
    """The Moon's light and its picture, and by imager what the latter's rows are about."""
    seviri = measured(truth / "moon_msg3_seviri_2013-01-01T145644.nc")
    mtsat = measured(truth / "moon_mtsat2_2013-07-25T035138.nc")
    by_seviri, by_mtsat = rendered(gl, seviri), rendered(gl, mtsat)
    light, shown, by_modis = [], [], []
    for channel, (name, band, to_channel, sunlight, lime, modis) in enumerate(_SEVIRI):
        level = disc_reflectance(seviri, channel, sunlight, by_seviri)
        shown.append(to_channel * float(by_seviri.reflectance[band]))
        by_modis.append(modis * level)
        light.append(relative(name, lime * level, shown[-1], _RANGE))
    colours = by_modis[1] / by_modis[0], shown[1] / shown[0]
    light.append(relative("810 nm over 635 nm, by MODIS", *colours, _RANGE))
    overlays = {
        "SEVIRI, phase angle 47 deg": overlay(seviri, 0, by_seviri.bands[..., 0]),
        "MTSAT-2, phase angle 33 deg": overlay(mtsat, 0, by_mtsat.bands[..., 3]),
    }
    alike = []
    for name, one in overlays.items():
        alike.append(difference(f"{name}, frame", 1.0, one.correlation, 0.03))
        alike.append(difference(f"{name}, lit disc", 1.0, one.correlation_of_lit, 0.1))
    tables = [
        Table(
            title="Light of the Moon",
            reference="SEVIRI on Meteosat-10, 2013-01-01, on the scale of LIME",
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
    return tables, overlays


def _moon_sheet(overlays: dict[str, Overlay]) -> Image8:
    """Each imager's picture, simgl's, and their ratio, on a row."""
    panels = {
        f"{name.split(',')[0]}, {panel}": image
        for name, one in overlays.items()
        for panel, image in one.panels.items()
    }
    return contact_sheet(panels, columns=3)


def _over_visible(bands: Array, irradiance: Array) -> Array:
    """Of values (..., 4), the mean over R, G and B weighted by sunlight."""
    return np.asarray(np.average(bands[..., :3], axis=-1, weights=irradiance[:3]))


class _Run(msgspec.Struct, frozen=True, kw_only=True):
    minutes: float
    tables: list[Table]


def main(
    truth: Annotated[Path, typer.Option(help="Folder of the flight data.")],
    out: Annotated[
        Path, typer.Option(help="Folder for flight.json, flight_truth.md and moon.png.")
    ],
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
        shine = apparent_albedo(gl, phases=_PHASES, hours=2 * hours)
        albedo = in_bands(_ceres(truth, "all-sky"), clear=False)
        discs = noon_discs(gl, DISCS)
        on_cube = cube_light(gl, albedo)
        of_moon, overlays = moon_tables(gl, truth)
    tables = [
        _albedo_table(truth, all_sky, clear),
        _parts_table(albedo, all_sky),
        _discs_table(albedo, discs),
        _cube_table(on_cube),
        _earthshine_table(_over_visible(shine, all_sky.received.sum(axis=(0, 1)))),
        *of_moon,
        *air_tables(),
    ]
    minutes = (time.monotonic() - start) / 60.0
    write_record(out / "flight.json", _Run(minutes=minutes, tables=tables))
    record = msgspec.json.decode((out / "flight.json").read_bytes(), type=Record)
    with complete_file(out / "flight_truth.md") as part:
        part.write_text(page(record, HEAD))
    with complete_file(out / "moon.png") as part:
        part.write_bytes(png_bytes(_moon_sheet(overlays)))


if __name__ == "__main__":
    typer.run(main)
