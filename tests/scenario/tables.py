"""A small valid scenario file, and ways to damage it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simgl.scenario.library import shipped_models, shipped_presets

UTC = 'utc = "2026-03-20T12:00:00"'
EPOCH = f"[epoch]\n{UTC}\n"
SUNWARD = "direction_icrf = [1.0, 0.0, 0.0]"
SHAPE = 'shape = "none"'
PLACE = "position_icrf_m = [7.0e6, 0.0, 0.0]"
PLATE = "model.plate = { width_m = 1.0, height_m = 1.0, material = { reflectance = 0.5 } }"
MODEL = 'model = "cubesat_12u"'
ORBIT = "orbit = { altitude_km = 400.0, inclination_deg = 51.6 }"
PINHOLE = "position_icrf_m = [7.0e6, 0.0, 10.0]"
LOOK = 'look_at = "plate"'
SEED = "seed = 1"

VALID = f"""\
{EPOCH}
[sun]
{SUNWARD}

[earth]
{SHAPE}

[spacecraft.plate]
{PLACE}
{PLATE}

[spacecraft.chaser]
{MODEL}
{ORBIT}

[camera.nav]
{PINHOLE}
{LOOK}

[render]
{SEED}
"""

# A lamp on the chaser, put before [render].
RENDER = "[render]"
LAMP = """\
[lamp.spot]
on = "chaser"
keypoint = "docking_port"
look_at = "plate"
half_angle_deg = 10.0
power_w = 5.0
temperature_k = 3000.0

[render]"""


@dataclass(frozen=True)
class Damage:
    """One passage of the valid file replaced by another, and the complaint that must follow.

    message : after the file's name; FILE, FOLDER, MODELS and PRESETS stand for what they are here
    """

    name: str
    old: str
    new: str
    message: str

    def text(self) -> str:
        """The damaged file."""
        assert VALID.count(self.old) == 1, self.old
        return VALID.replace(self.old, self.new)

    def complaint(self, path: Path) -> str:
        """The whole line for a file at this path."""
        meanings = {
            "FILE": str(path),
            "FOLDER": str(path.parent),
            "MODELS": ", ".join(shipped_models()),
            "PRESETS": ", ".join(shipped_presets()),
        }
        rest = self.message
        for word, meaning in meanings.items():
            rest = rest.replace(word, meaning)
        return f"{path}{rest}"


def written(folder: Path, text: str, name: str = "scene.toml") -> Path:
    """A scenario file of the given text."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


BAD_VALUES = (
    Damage(
        "unknown table",
        "[render]",
        "[rendering]",
        ': rendering is not a table here; did you mean "render"? (allowed: assess, camera, '
        "earth, epoch, lamp, render, sky, spacecraft, sun)",
    ),
    Damage(
        "unknown table on two lines",
        "[render]",
        '["a\\nb"]',
        ': "a\\nb" is not a table here; (allowed: assess, camera, earth, epoch, lamp, render, sky, '
        "spacecraft, sun)",
    ),
    Damage(
        "unknown key",
        SEED,
        "sead = 1",
        ' [render]: sead is not a key here; did you mean "seed"? (allowed: '
        "gather, inter_reflection, samples_per_pixel, seed)",
    ),
    Damage(
        "unknown key on two lines",
        SEED,
        '"a\\nb" = 1',
        ' [render]: "a\\nb" is not a key here; (allowed: gather, '
        "inter_reflection, samples_per_pixel, seed)",
    ),
    Damage(
        "unknown gather",
        SEED,
        'gather = "voxel"',
        ' [render]: gather must be one of "pixel", "vertex", got "voxel"',
    ),
    Damage(
        "unknown key of a primitive",
        "width_m = 1.0",
        "widht_m = 1.0",
        ' [spacecraft.plate]: model.plate.widht_m is not a key here; did you mean "width_m"? '
        "(allowed: height_m, material, width_m)",
    ),
    Damage(
        "unknown key of a material",
        "{ reflectance = 0.5 }",
        "{ reflectance = 0.5, rough = 0.2 }",
        " [spacecraft.plate]: model.plate.material.rough is not a key here; did you mean "
        '"roughness"? (allowed: cells, coat, conserving, crinkle, emission_w_m2_sr, metallic, '
        "reflectance, roughness)",
    ),
    Damage(
        "unknown primitive",
        "model.plate",
        "model.cone",
        " [spacecraft.plate]: model.cone is not a key here; (allowed: box, cylinder, plate, "
        "sphere)",
    ),
    Damage(
        "epoch is no table",
        EPOCH,
        'epoch = "2026-03-20T12:00:00"\n',
        ' [epoch]: must be a table, got "2026-03-20T12:00:00"',
    ),
    Damage(
        "sun is a list of tables",
        "[sun]",
        "[[sun]]",
        " [sun]: must be a table, got a list of tables",
    ),
    Damage(
        "camera without a name", "[camera.nav]", "[camera]", ": camera must be tables [camera.NAME]"
    ),
    Damage(
        "cameras as a list", "[camera.nav]", "[[camera]]", ": camera must be tables [camera.NAME]"
    ),
    Damage(
        "camera name that is a path",
        "[camera.nav]",
        '[camera."../nav"]',
        ': camera."../nav" must be a name of letters, digits, _ and -',
    ),
    Damage(
        "spacecraft name on two lines",
        "[spacecraft.chaser]",
        '[spacecraft."a\\nb"]',
        ': spacecraft."a\\nb" must be a name of letters, digits, _ and -',
    ),
    Damage("no epoch", EPOCH, "", ': epoch is missing; write [epoch] utc = "2026-03-20T12:00:00"'),
    Damage("no utc", f"{UTC}\n", "", " [epoch]: utc is missing"),
    Damage(
        "TOML date",
        UTC,
        "utc = 2026-03-20T12:00:00",
        " [epoch]: utc must be a text, got 2026-03-20 12:00:00",
    ),
    Damage(
        "no date",
        UTC,
        'utc = "today"',
        ' [epoch]: utc must be a UTC time such as "2026-03-20T12:00:00", got "today"',
    ),
    Damage(
        "impossible day",
        UTC,
        'utc = "2026-02-30T12:00:00"',
        ' [epoch]: utc must be a real date and time, got "2026-02-30T12:00:00" (bad day)',
    ),
    Damage(
        "impossible hour",
        UTC,
        'utc = "2026-03-20T25:00:00"',
        ' [epoch]: utc must be a real date and time, got "2026-03-20T25:00:00" (bad hour)',
    ),
    Damage(
        "no leap second",
        UTC,
        'utc = "2026-03-20T23:59:60"',
        ' [epoch]: utc must be a real date and time, got "2026-03-20T23:59:60" (that minute '
        "has no such second)",
    ),
    Damage(
        "year too early",
        UTC,
        'utc = "1969-07-20T20:17:40"',
        ' [epoch]: utc must lie in the years 1972 to 2099, got "1969-07-20T20:17:40"',
    ),
    Damage(
        "year too late",
        UTC,
        'utc = "2100-01-01T00:00:00"',
        ' [epoch]: utc must lie in the years 1972 to 2099, got "2100-01-01T00:00:00"',
    ),
    Damage(
        "text for a number",
        "width_m = 1.0",
        'width_m = "1 m"',
        ' [spacecraft.plate]: model.plate.width_m must be a number, got "1 m"',
    ),
    Damage(
        "true for a number",
        "width_m = 1.0",
        "width_m = true",
        " [spacecraft.plate]: model.plate.width_m must be a number, got true",
    ),
    Damage(
        "number for a text",
        LOOK,
        "look_at = 3",
        " [camera.nav]: look_at must be a text or a table, got 3",
    ),
    Damage(
        "fraction for a whole number",
        SEED,
        "seed = 1.5",
        " [render]: seed must be a whole number, got 1.5",
    ),
    Damage(
        "number for true or false",
        SUNWARD,
        "visible = 1",
        " [sun]: visible must be true or false, got 1",
    ),
    Damage(
        "number for a list",
        PINHOLE,
        "position_icrf_m = 7.0e6",
        " [camera.nav]: position_icrf_m must be a list, got 7000000.0",
    ),
    Damage(
        "table for a list",
        PINHOLE,
        "position_icrf_m = { x = 7.0e6 }",
        " [camera.nav]: position_icrf_m must be a list, got a table",
    ),
    Damage(
        "text in a list",
        PINHOLE,
        'position_icrf_m = [7.0e6, "0", 10.0]',
        ' [camera.nav]: position_icrf_m[1] must be a number, got "0"',
    ),
    Damage(
        "list too short",
        PINHOLE,
        "position_icrf_m = [7.0e6, 0.0]",
        " [camera.nav]: position_icrf_m must be a list of length 3, got [7000000.0, 0.0]",
    ),
    Damage(
        "list too long",
        PINHOLE,
        "position_icrf_m = [7.0e6, 0.0, 1.0, 2.0]",
        " [camera.nav]: position_icrf_m must be a list of length 3, got [7000000.0, 0.0, 1.0, 2.0]",
    ),
    Damage(
        "orbit as a list",
        ORBIT,
        "orbit = [400.0]",
        " [spacecraft.chaser]: orbit must be a table, got [400.0]",
    ),
    Damage(
        "three bands",
        "reflectance = 0.5",
        "reflectance = [0.5, 0.5, 0.5]",
        " [spacecraft.plate]: model.plate.material.reflectance must be a list of length 4, got "
        "[0.5, 0.5, 0.5]",
    ),
    Damage(
        "colour name for bands",
        "reflectance = 0.5",
        'reflectance = "white"',
        " [spacecraft.plate]: model.plate.material.reflectance must be a number or a list, got "
        '"white"',
    ),
    Damage(
        "number for a model",
        MODEL,
        "model = 12",
        " [spacecraft.chaser]: model must be a text or a table, got 12",
    ),
    Damage(
        "nan",
        "width_m = 1.0",
        "width_m = nan",
        " [spacecraft.plate]: model.plate.width_m must be finite, got nan",
    ),
    Damage(
        "infinity in a list",
        PINHOLE,
        "position_icrf_m = [7.0e6, -inf, 10.0]",
        " [camera.nav]: position_icrf_m[1] must be finite, got -inf",
    ),
    Damage(
        "beyond all sizes",
        PINHOLE,
        "position_icrf_m = [1.0e300, 0.0, 10.0]",
        " [camera.nav]: position_icrf_m[0] must lie within +-1e+18, got 1.00000e+300",
    ),
    Damage(
        "whole number beyond all sizes",
        SEED,
        "seed = 1" + "0" * 30,
        " [render]: seed must lie within +-1e+18, got 1.00000e+30",
    ),
    Damage(
        "negative length",
        "width_m = 1.0",
        "width_m = -1.0",
        " [spacecraft.plate]: model.plate.width_m must be a number > 0.0, got -1.0",
    ),
    Damage(
        "zero length",
        "height_m = 1.0",
        "height_m = 0",
        " [spacecraft.plate]: model.plate.height_m must be a number > 0.0, got 0",
    ),
    Damage(
        "lens faster than light allows",
        LOOK,
        f"{LOOK}\nf_number = 0.4",
        " [camera.nav]: f_number must be a number >= 0.5, got 0.4",
    ),
    Damage(
        "exposure of a day",
        LOOK,
        f"{LOOK}\nexposure_time_s = 86400",
        " [camera.nav]: exposure_time_s must be a number <= 3600.0, got 86400",
    ),
    Damage(
        "negative exposure",
        LOOK,
        f"{LOOK}\nexposure_time_s = -0.001",
        " [camera.nav]: exposure_time_s must be a number > 0.0, got -0.001",
    ),
    Damage(
        "negative seed", SEED, "seed = -1", " [render]: seed must be a whole number >= 0, got -1"
    ),
    Damage(
        "seed of 33 bits",
        SEED,
        "seed = 4294967296",
        " [render]: seed must be a whole number <= 4294967295, got 4294967296",
    ),
    Damage(
        "too few samples",
        SEED,
        "samples_per_pixel = 4",
        " [render]: samples_per_pixel must be a whole number >= 5, got 4",
    ),
    Damage(
        "no pixels",
        LOOK,
        f"{LOOK}\nwidth_px = 0",
        " [camera.nav]: width_px must be a whole number >= 1, got 0",
    ),
    Damage(
        "too many pixels",
        LOOK,
        f"{LOOK}\nheight_px = 16385",
        " [camera.nav]: height_px must be a whole number <= 16384, got 16385",
    ),
    Damage(
        "too many bits",
        LOOK,
        f"{LOOK}\nbits = 20",
        " [camera.nav]: bits must be a whole number <= 16, got 20",
    ),
    Damage(
        "pedestal above full scale",
        LOOK,
        f"{LOOK}\npedestal_dn = 4095",
        " [camera.nav]: pedestal_dn must lie below the largest DN, 4095, got 4095",
    ),
    Damage(
        "efficiency above one",
        LOOK,
        f"{LOOK}\nquantum_efficiency = [0.5, 1.1, 0.5, 0.5]",
        " [camera.nav]: quantum_efficiency must lie in 0..1, got 1.1",
    ),
    Damage(
        "misspelt optics",
        LOOK,
        f"{LOOK}\noptics = {{ difraction = true }}",
        " [camera.nav]: optics.difraction is not a key here; did you mean "
        '"diffraction"? (allowed: aberration_um, camera_equation, coating_reflectance, '
        "defocus_um, diffraction, distortion, field_zones, psf_image, psf_samples_per_px, "
        "surfaces, veiling_glare, vignetting, vignetting_angle_deg, vignetting_relative)",
    ),
    Damage(
        "unknown camera equation",
        LOOK,
        f'{LOOK}\noptics.camera_equation = "4N"',
        ' [camera.nav]: optics.camera_equation must be one of "1+4N2", "4N2", got "4N"',
    ),
    Damage(
        "profile that is not used",
        LOOK,
        f"{LOOK}\noptics.vignetting_angle_deg = [0.0, 10.0]",
        ' [camera.nav]: optics.vignetting_angle_deg goes with vignetting = "measured", and that '
        "with it",
    ),
    Damage(
        "profile of unequal lengths",
        LOOK,
        f'{LOOK}\noptics = {{ vignetting = "measured", vignetting_angle_deg = [0.0, 10.0], '
        "vignetting_relative = [1.0] }",
        " [camera.nav]: optics.vignetting_relative has 1 values for 2 angles; at least two of both",
    ),
    Damage(
        "profile in the wrong order",
        LOOK,
        f'{LOOK}\noptics = {{ vignetting = "measured", vignetting_angle_deg = [10.0, 0.0], '
        "vignetting_relative = [1.0, 0.5] }",
        " [camera.nav]: optics.vignetting_angle_deg must start at 0 and increase",
    ),
    Damage(
        "distortion that folds the picture",
        LOOK,
        f"{LOOK}\nfocal_length_mm = 2.0\noptics.distortion = {{ k1 = -2.0 }}",
        " [camera.nav]: optics.distortion folds the picture: two rays meet in one place",
    ),
    Damage(
        "blur over the whole picture",
        LOOK,
        f"{LOOK}\noptics.aberration_um = 400.0",
        " [camera.nav]: optics spreads a point over 853 pixels, at most 512 are possible",
    ),
    Damage(
        "defocus without diffraction",
        LOOK,
        f"{LOOK}\noptics.defocus_um = 40.0",
        " [camera.nav]: optics.defocus_um goes with diffraction = true",
    ),
    Damage(
        "two spreads",
        LOOK,
        f'{LOOK}\noptics = {{ psf_image = "psf.png", diffraction = true }}',
        " [camera.nav]: optics.diffraction contradicts psf_image, which holds all of the spread",
    ),
    Damage(
        "no picture of the spread",
        LOOK,
        f'{LOOK}\noptics.psf_image = "psf.png"',
        " [camera.nav]: optics.psf_image FOLDER/psf.png is no image and no .npy array",
    ),
    Damage(
        "samples of no picture",
        LOOK,
        f"{LOOK}\noptics.psf_samples_per_px = 2",
        " [camera.nav]: optics.psf_samples_per_px goes with psf_image",
    ),
    Damage(
        "zones in the wrong order",
        LOOK,
        f"{LOOK}\noptics.field_zones = [{{ at = 0.8 }}, {{ at = 0.4 }}]",
        " [camera.nav]: optics.field_zones must have increasing values of at, from above 0",
    ),
    Damage(
        "coating of no surface",
        LOOK,
        f"{LOOK}\noptics.coating_reflectance = 0.01",
        " [camera.nav]: optics.coating_reflectance goes with surfaces",
    ),
    Damage(
        "lens that spreads light",
        LOOK,
        f"{LOOK}\noptics.surfaces = [{{ radius_mm = -20.0, gap_mm = 2.0, index = 1.5 }}, "
        "{ radius_mm = 20.0, gap_mm = 0.0, index = 1.0 }]",
        " [camera.nav]: optics.surfaces must form a real image behind the last one",
    ),
    Damage(
        "laser that no band holds",
        LOOK,
        f"{LOOK}\nlidar.wavelength_nm = 1550.0",
        " [camera.nav]: lidar.wavelength_nm must be a number <= 1000.0, got 1550.0",
    ),
    Damage(
        "rolling shutter without its row time",
        LOOK,
        f'{LOOK}\npreset = "ideal"\nshutter = "rolling"',
        ' [camera.nav]: row_time_us is missing; shutter = "rolling" needs it',
    ),
    Damage(
        "shutter of another kind",
        LOOK,
        f'{LOOK}\nshutter = "leaf"',
        ' [camera.nav]: shutter must be one of "global", "rolling", got "leaf"',
    ),
    Damage(
        "colours without filters",
        LOOK,
        f'{LOOK}\nmosaic = "RGGB"',
        ' [camera.nav]: mosaic needs filters, which preset "mt9m034" has not',
    ),
    Damage(
        "unknown order of colours",
        LOOK,
        f'{LOOK}\nmosaic = "RGBG"',
        ' [camera.nav]: mosaic must be one of "BGGR", "GBRG", "GRBG", "RGGB", "mono", got "RGBG"',
    ),
    Damage(
        "share above one",
        LOOK,
        f"{LOOK}\nhot_pixels = 2.0",
        " [camera.nav]: hot_pixels must be a number <= 1.0, got 2.0",
    ),
    Damage(
        "detector at room temperature in Celsius",
        LOOK,
        f"{LOOK}\ntemperature_k = 20.0",
        " [camera.nav]: temperature_k must be a number >= 100.0, got 20.0",
    ),
    Damage(
        "particles without a flux",
        LOOK,
        f"{LOOK}\nparticles = {{ depth_um = 5.0 }}",
        " [camera.nav]: particles.flux_cm2_s is missing",
    ),
    Damage(
        "serial number that is negative",
        LOOK,
        f"{LOOK}\nserial = -1",
        " [camera.nav]: serial must be a whole number >= 0, got -1",
    ),
    Damage(
        "negative transmission",
        LOOK,
        f"{LOOK}\ntransmission = -0.5",
        " [camera.nav]: transmission must lie in 0..1, got -0.5",
    ),
    Damage(
        "reflectance above one",
        "reflectance = 0.5",
        "reflectance = 1.5",
        " [spacecraft.plate]: model.plate.material.reflectance must lie in 0..1, got 1.5",
    ),
    Damage(
        "unknown finish",
        "{ reflectance = 0.5 }",
        '"white_pant"',
        ' [spacecraft.plate]: model.plate.material names no finish "white_pant"; did you mean '
        '"white_paint"? (allowed: bare_aluminium, black_paint, cell_under_glass, lambert_02, '
        "lambert_05, lambert_09, lambert_12, lambert_18, lambert_25, lambert_36, lambert_45, "
        "lambert_60, lambert_75, lambert_90, lambert_99, lambert_white, "
        "mirror, mli_gold, mli_silver, solar_cell, white_paint)",
    ),
    Damage(
        "number for a material",
        "{ reflectance = 0.5 }",
        "0.5",
        " [spacecraft.plate]: model.plate.material must be a text or a table, got 0.5",
    ),
    Damage(
        "more than a whole coat",
        "reflectance = 0.5",
        "reflectance = 0.5, coat = { strength = 1.1 }",
        " [spacecraft.plate]: model.plate.material.coat.strength must be a number <= 1.0, got 1.1",
    ),
    Damage(
        "coat too smooth",
        "reflectance = 0.5",
        "reflectance = 0.5, coat = { roughness = 0.0 }",
        " [spacecraft.plate]: model.plate.material.coat.roughness must be a number >= 0.01, "
        "got 0.0",
    ),
    Damage(
        "crinkle without facets",
        "reflectance = 0.5",
        "reflectance = 0.5, crinkle = { slope = 0.1 }",
        " [spacecraft.plate]: model.plate.material.crinkle.facet_size_m is missing",
    ),
    Damage(
        "unknown key of a crinkle",
        "reflectance = 0.5",
        "reflectance = 0.5, crinkle = { facet_size = 0.02, slope = 0.1 }",
        " [spacecraft.plate]: model.plate.material.crinkle.facet_size is not a key here; did you "
        'mean "facet_size_m"? (allowed: facet_size_m, slope)',
    ),
    Damage(
        "facets too steep",
        "reflectance = 0.5",
        "reflectance = 0.5, crinkle = { facet_size_m = 0.02, slope = 2.0 }",
        " [spacecraft.plate]: model.plate.material.crinkle.slope must be a number <= 1.0, got 2.0",
    ),
    Damage(
        "cells without height",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04 }",
        " [spacecraft.plate]: model.plate.material.cells.height_m is missing",
    ),
    Damage(
        "fingers wider than their pitch",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04, height_m = 0.08, finger_pitch_m = 0.001, "
        "finger_width_m = 0.002 }",
        " [spacecraft.plate]: model.plate.material.cells.finger_width_m must be less than "
        "finger_pitch_m = 0.001, got 0.002",
    ),
    Damage(
        "gap brighter than white",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04, height_m = 0.08, gap_reflectance = 1.5 }",
        " [spacecraft.plate]: model.plate.material.cells.gap_reflectance must lie in 0..1, got 1.5",
    ),
    Damage(
        "mirror too smooth",
        "reflectance = 0.5",
        "reflectance = 0.5, roughness = 0.001",
        " [spacecraft.plate]: model.plate.material.roughness must be a number >= 0.01, got 0.001",
    ),
    Damage(
        "more than metal",
        "reflectance = 0.5",
        "reflectance = 0.5, metallic = 1.5",
        " [spacecraft.plate]: model.plate.material.metallic must be a number <= 1.0, got 1.5",
    ),
    Damage("albedo above one", SHAPE, "albedo = 1.3", " [earth]: albedo must lie in 0..1, got 1.3"),
    Damage(
        "negative albedo of a band",
        SHAPE,
        "albedo = [0.1, 0.2, -0.3, 0.2]",
        " [earth]: albedo must lie in 0..1, got -0.3",
    ),
    Damage(
        "cold Sun",
        SUNWARD,
        "temperature_k = 300.0",
        " [sun]: temperature_k must be a number >= 1000.0, got 300.0",
    ),
    Damage(
        "negative sunlight",
        SUNWARD,
        "irradiance_w_m2 = -1361.0",
        " [sun]: irradiance_w_m2 must be a number >= 0.0, got -1361.0",
    ),
    Damage(
        "huge Sun",
        SUNWARD,
        "angular_diameter_deg = 11.0",
        " [sun]: angular_diameter_deg must be a number <= 10.0, got 11.0",
    ),
    Damage(
        "open orbit",
        ORBIT,
        "orbit = { semi_major_axis_km = 7000.0, eccentricity = 1.0 }",
        " [spacecraft.chaser]: orbit.eccentricity must be a number < 1.0, got 1.0",
    ),
    Damage(
        "inclination above 180",
        ORBIT,
        "orbit = { altitude_km = 400.0, inclination_deg = 200.0 }",
        " [spacecraft.chaser]: orbit.inclination_deg must be a number <= 180.0, got 200.0",
    ),
    Damage(
        "elevation at the pole",
        f"{PINHOLE}\n{LOOK}",
        'about = { target = "plate", azimuth_deg = 0.0, elevation_deg = 90.0, range_m = 5.0 }',
        " [camera.nav]: about.elevation_deg must be a number <= 89.9, got 90.0",
    ),
    Damage(
        "whole number beyond a float",
        SEED,
        "seed = 1" + "0" * 400,
        " [render]: seed must lie within +-1e+18, got 1.00000e+400",
    ),
    Damage(
        "unknown shape",
        SHAPE,
        'shape = "flat"',
        ' [earth]: shape must be one of "none", "sphere", "wgs84", got "flat"',
    ),
    Damage(
        "radius without a sphere",
        SHAPE,
        "radius_km = 6371.0",
        ' [earth]: radius_km goes with shape = "sphere", got "wgs84"',
    ),
    Damage(
        "sphere without a radius",
        SHAPE,
        'shape = "sphere"',
        ' [earth]: radius_km is missing; shape = "sphere" needs it',
    ),
    Damage(
        "Sun in no direction",
        SUNWARD,
        "direction_icrf = [0.0, 0.0, 0.0]",
        " [sun]: direction_icrf needs a direction, got [0.0, 0.0, 0.0]",
    ),
    Damage(
        "albedo of no Earth",
        SHAPE,
        f"{SHAPE}\nalbedo = 0.3",
        ' [earth]: albedo goes with an Earth, got shape = "none"',
    ),
    Damage(
        "atmosphere of no Earth",
        SHAPE,
        f'{SHAPE}\natmosphere = "source"',
        ' [earth]: atmosphere goes with an Earth, got shape = "none"',
    ),
    Damage(
        "airglow without air",
        SHAPE,
        'shape = "wgs84"\natmosphere = "none"\nairglow = true',
        " [earth]: airglow goes with an atmosphere, got none",
    ),
    Damage(
        "moonlight without a Moon",
        SHAPE,
        'shape = "wgs84"\nmoonlight = true',
        " [earth]: moonlight goes with a Moon, which a Sun fixed by hand has not",
    ),
    Damage(
        "moonlight on a grey Earth",
        SHAPE,
        'shape = "wgs84"\nalbedo = 0.3\nmoonlight = true',
        " [earth]: moonlight goes with an Earth that has maps, got albedo",
    ),
    Damage(
        "two places",
        PLACE,
        PLACE + "\norbit = { altitude_km = 400.0, inclination_deg = 51.6 }",
        " [spacecraft.plate]: place needs exactly one of orbit, relative_to, position_icrf_m; "
        "got orbit and position_icrf_m",
    ),
    Damage(
        "no place",
        f"{PLACE}\n",
        "",
        " [spacecraft.plate]: place needs exactly one of orbit, relative_to, position_icrf_m; "
        "got none of them",
    ),
    Damage(
        "velocity of another place",
        ORBIT,
        f"{ORBIT}\nvelocity_icrf_m_s = [0.0, 0.0, 0.0]",
        " [spacecraft.chaser]: velocity_icrf_m_s goes with position_icrf_m, not with orbit",
    ),
    Damage(
        "relative place without a reference",
        ORBIT,
        f"{ORBIT}\nposition_lvlh_m = [0.0, 0.0, 0.0]",
        " [spacecraft.chaser]: position_lvlh_m goes with relative_to, not with orbit",
    ),
    Damage(
        "reference unknown",
        PLACE,
        'relative_to = "chasr"\nposition_lvlh_m = [0.0, 0.0, 0.0]',
        ' [spacecraft.plate]: relative_to names no other spacecraft: "chasr"; did you mean '
        '"chaser"? (allowed: chaser)',
    ),
    Damage(
        "reference is itself",
        PLACE,
        'relative_to = "plate"\nposition_lvlh_m = [0.0, 0.0, 0.0]',
        " [spacecraft.plate]: relative_to names the spacecraft itself; name another one",
    ),
    Damage(
        "reference without a place",
        PLACE,
        'relative_to = "chaser"',
        " [spacecraft.plate]: position_lvlh_m is missing beside relative_to",
    ),
    Damage(
        "reference that does not move",
        ORBIT,
        'relative_to = "plate"\nposition_lvlh_m = [1.0, 0.0, 0.0]',
        ' [spacecraft.chaser]: relative_to needs LVLH axes, which "plate" lacks: it does not '
        "move about the Earth",
    ),
    Damage(
        "orbit of no size",
        ORBIT,
        "orbit = { inclination_deg = 51.6 }",
        " [spacecraft.chaser]: orbit needs exactly one of altitude_km (circular) and "
        "semi_major_axis_km",
    ),
    Damage(
        "orbit of two sizes",
        ORBIT,
        "orbit = { altitude_km = 400.0, semi_major_axis_km = 6778.0 }",
        " [spacecraft.chaser]: orbit needs exactly one of altitude_km (circular) and "
        "semi_major_axis_km",
    ),
    Damage(
        "eccentric altitude",
        ORBIT,
        "orbit = { altitude_km = 400.0, eccentricity = 0.1 }",
        " [spacecraft.chaser]: orbit.eccentricity goes with semi_major_axis_km",
    ),
    Damage(
        "perigee underground",
        ORBIT,
        "orbit = { semi_major_axis_km = 7000.0, eccentricity = 0.2 }",
        " [spacecraft.chaser]: orbit has its perigee 778.1 km underground",
    ),
    Damage(
        "misspelt attitude",
        ORBIT,
        f'{ORBIT}\nattitude = "lvhl"',
        ' [spacecraft.chaser]: attitude must be one of "icrf", "lvlh", got "lvhl"',
    ),
    Damage(
        "two attitudes",
        ORBIT,
        ORBIT + '\nattitude = "icrf"\npoint_at = { target = "plate", axis_body = [1.0, 0.0, 0.0] }',
        " [spacecraft.chaser]: point_at contradicts attitude; give one of them",
    ),
    Damage(
        "quaternion off by a tenth",
        ORBIT,
        f"{ORBIT}\nquaternion_icrf_from_body_xyzw = [0.0, 0.0, 0.0, 0.9]",
        " [spacecraft.chaser]: quaternion_icrf_from_body_xyzw must be a unit quaternion, got "
        "norm 0.9 (off by -0.1, allowed 0.0001)",
    ),
    Damage(
        "quaternion of zeros",
        ORBIT,
        f"{ORBIT}\nquaternion_lvlh_from_body_xyzw = [0.0, 0.0, 0.0, 0.0]",
        " [spacecraft.chaser]: quaternion_lvlh_from_body_xyzw must be a unit quaternion, got "
        "norm 0 (off by -1, allowed 0.0001)",
    ),
    Damage(
        "quaternion of three",
        ORBIT,
        f"{ORBIT}\nquaternion_icrf_from_body_xyzw = [0.0, 0.0, 1.0]",
        " [spacecraft.chaser]: quaternion_icrf_from_body_xyzw must be a list of length 4, got "
        "[0.0, 0.0, 1.0]",
    ),
    Damage(
        "pointing at itself",
        ORBIT,
        ORBIT + '\npoint_at = { target = "chaser", axis_body = [1.0, 0.0, 0.0] }',
        " [spacecraft.chaser]: point_at.target names the spacecraft itself; name another one",
    ),
    Damage(
        "pointing at nobody",
        ORBIT,
        ORBIT + '\npoint_at = { target = "plait", axis_body = [1.0, 0.0, 0.0] }',
        ' [spacecraft.chaser]: point_at.target names no other spacecraft: "plait"; did you '
        'mean "plate"? (allowed: plate)',
    ),
    Damage(
        "pointing with no axis",
        ORBIT,
        ORBIT + '\npoint_at = { target = "plate", axis_body = [0.0, 0.0, 0.0] }',
        " [spacecraft.chaser]: point_at.axis_body needs a direction, got [0.0, 0.0, 0.0]",
    ),
    Damage(
        "LVLH without an orbit",
        PLACE,
        f'{PLACE}\nattitude = "lvlh"',
        ' [spacecraft.plate]: attitude needs LVLH axes, which "plate" lacks: it does not move '
        "about the Earth",
    ),
    Damage("no model", f"{PLATE}\n", "", " [spacecraft.plate]: model is missing"),
    Damage(
        "empty model",
        PLATE,
        "model = {}",
        " [spacecraft.plate]: model needs exactly one of plate, sphere, box, cylinder",
    ),
    Damage(
        "two primitives",
        PLATE,
        PLATE + "\nmodel.sphere = { radius_m = 1.0, material = { reflectance = 0.5 } }",
        " [spacecraft.plate]: model needs exactly one of plate, sphere, box, cylinder",
    ),
    Damage(
        "material without reflectance",
        "reflectance = 0.5",
        "metallic = 1.0",
        " [spacecraft.plate]: model.plate.material.reflectance is missing",
    ),
    Damage(
        "unit of a primitive",
        PLACE,
        f"{PLACE}\nunit_m = 0.001",
        " [spacecraft.plate]: unit_m goes with a mesh file; a primitive is in metres and body axes",
    ),
    Damage(
        "unit that is none",
        MODEL,
        f'{MODEL}\nunit = "yd"',
        ' [spacecraft.chaser]: unit must be one of "cm", "ft", "in", "km", "m", "mm", got "yd"',
    ),
    Damage(
        "two units",
        MODEL,
        f'{MODEL}\nunit = "mm"\nunit_m = 0.001',
        " [spacecraft.chaser]: unit_m contradicts unit; give one of them",
    ),
    Damage(
        "axis that is none",
        MODEL,
        f'{MODEL}\nup_axis = "w"',
        ' [spacecraft.chaser]: up_axis must be one of "-x", "-y", "-z", "x", "y", "z", got "w"',
    ),
    Damage(
        "up and ahead along one axis",
        MODEL,
        f'{MODEL}\nup_axis = "y"\nforward_axis = "-y"',
        " [spacecraft.chaser]: forward_axis must not lie along up_axis, got -y and y",
    ),
    Damage(
        "ahead without a way up",
        MODEL,
        f'{MODEL}\nforward_axis = "y"',
        " [spacecraft.chaser]: forward_axis goes with up_axis",
    ),
    Damage(
        "axes of a primitive",
        PLACE,
        f'{PLACE}\nup_axis = "y"',
        " [spacecraft.plate]: up_axis goes with a mesh file; a primitive is in metres and body "
        "axes",
    ),
    Damage(
        "unit of zero",
        MODEL,
        f"{MODEL}\nunit_m = 0.0",
        " [spacecraft.chaser]: unit_m must be a number > 0.0, got 0.0",
    ),
    Damage(
        "two mounts",
        PINHOLE,
        f'{PINHOLE}\non = "chaser"',
        " [camera.nav]: mount needs exactly one of on, about, position_icrf_m; got on and "
        "position_icrf_m",
    ),
    Damage(
        "no mount",
        f"{PINHOLE}\n",
        "",
        " [camera.nav]: mount needs exactly one of on, about, position_icrf_m; got none of them",
    ),
    Damage(
        "looking at nobody",
        LOOK,
        'look_at = "plait"',
        ' [camera.nav]: look_at names no spacecraft: "plait"; did you mean "plate"? (allowed: '
        "chaser, plate)",
    ),
    Damage(
        "looking nowhere",
        f"{LOOK}\n",
        "",
        " [camera.nav]: look_at or limb or boresight is needed, and only one of them",
    ),
    Damage(
        "looking two ways",
        LOOK,
        f"{LOOK}\nboresight = [0.0, 0.0, -1.0]",
        " [camera.nav]: look_at or limb or boresight is needed, and only one of them",
    ),
    Damage(
        "looking at a place that is not there",
        LOOK,
        'look_at = { target = "chaser", keypoint = "docking_prt" }',
        ' [camera.nav]: look_at.keypoint is not on "cubesat_12u": "docking_prt"; did you mean '
        '"docking_port"? (allowed: camera_aperture, corner_front_bottom_left, '
        "corner_front_bottom_right, corner_front_top_left, corner_front_top_right, "
        "corner_rear_bottom_left, corner_rear_bottom_right, corner_rear_top_left, "
        "corner_rear_top_right, docking_port, panel_tip_left, panel_tip_right)",
    ),
    Damage(
        "looking at a part that is not there",
        LOOK,
        'look_at = { target = "chaser", part = "panel_lef" }',
        ' [camera.nav]: look_at.part is not of "cubesat_12u": "panel_lef"; did you mean '
        '"panel_left"? (allowed: body, camera, docking_port, panel_left, panel_right)',
    ),
    Damage(
        "looking at two places",
        LOOK,
        'look_at = { target = "chaser", part = "panel_left", keypoint = "docking_port" }',
        " [camera.nav]: look_at.part contradicts keypoint; give one of them",
    ),
    Damage(
        "looking at a place on nobody",
        LOOK,
        'look_at = { target = "chase", part = "body" }',
        ' [camera.nav]: look_at.target names no spacecraft: "chase"; did you mean "chaser"? '
        "(allowed: chaser, plate)",
    ),
    Damage(
        "the limb from a fixed place",
        LOOK,
        "limb = { azimuth_deg = 90.0 }",
        " [camera.nav]: limb goes with on, not with position_icrf_m",
    ),
    Damage(
        "the limb of no Earth",
        f"{PINHOLE}\n{LOOK}",
        'on = "chaser"\nkeypoint = "docking_port"\nlimb = {}',
        ' [camera.nav]: limb needs an Earth; shape = "none" leaves it out',
    ),
    Damage(
        "a limb under the ground",
        LOOK,
        "limb = { tangent_height_km = -1.0 }",
        " [camera.nav]: limb.tangent_height_km must be a number >= 0.0, got -1.0",
    ),
    Damage(
        "axes that a fixed place has not",
        LOOK,
        'boresight = [0.0, 0.0, 1.0]\naxes = "lvlh"',
        ' [camera.nav]: axes must be "icrf" with position_icrf_m, got "lvlh"',
    ),
    Damage(
        "axes that are none",
        LOOK,
        f'{LOOK}\naxes = "rtn"',
        ' [camera.nav]: axes must be one of "body", "icrf", "lvlh", got "rtn"',
    ),
    Damage(
        "keeping all around from the Sun",
        LOOK,
        f"{LOOK}\nkeep_from_sun_deg = 180.0",
        " [camera.nav]: keep_from_sun_deg must be a number < 180.0, got 180.0",
    ),
    Damage(
        "about and keeping from the Sun",
        f"{PINHOLE}\n{LOOK}",
        'about = { target = "chaser", azimuth_deg = 0.0, range_m = 5.0 }\nkeep_from_sun_deg = 9.0',
        " [camera.nav]: keep_from_sun_deg contradicts about, which looks at its target",
    ),
    Damage(
        "boresight of zeros",
        LOOK,
        "boresight = [0.0, 0.0, 0.0]",
        " [camera.nav]: boresight needs a direction, got [0.0, 0.0, 0.0]",
    ),
    Damage(
        "up of zeros",
        LOOK,
        f"{LOOK}\nup = [0.0, 0.0, 0.0]",
        " [camera.nav]: up needs a direction, got [0.0, 0.0, 0.0]",
    ),
    Damage(
        "on nobody",
        PINHOLE,
        'on = "chase"\nposition_body_m = [0.0, 0.0, 1.0]',
        ' [camera.nav]: on names no spacecraft: "chase"; did you mean "chaser"? (allowed: '
        "chaser, plate)",
    ),
    Damage(
        "on a body but nowhere",
        PINHOLE,
        'on = "chaser"',
        " [camera.nav]: position_body_m or keypoint is needed, and not both",
    ),
    Damage(
        "on a body at two places",
        PINHOLE,
        'on = "chaser"\nkeypoint = "docking_port"\nposition_body_m = [0.0, 0.0, 1.0]',
        " [camera.nav]: position_body_m or keypoint is needed, and not both",
    ),
    Damage(
        "keypoint of a primitive",
        PINHOLE,
        'on = "plate"\nkeypoint = "tip"',
        ' [camera.nav]: keypoint is not on "plate": "tip"; (none is allowed here)',
    ),
    Damage(
        "keypoint without a body",
        PINHOLE,
        f'{PINHOLE}\nkeypoint = "docking_port"',
        " [camera.nav]: keypoint goes with on, not with position_icrf_m",
    ),
    Damage(
        "about nobody",
        f"{PINHOLE}\n{LOOK}",
        'about = { target = "x", azimuth_deg = 0.0, range_m = 5.0 }',
        ' [camera.nav]: about.target names no spacecraft: "x"; (allowed: chaser, plate)',
    ),
    Damage(
        "about at no range",
        f"{PINHOLE}\n{LOOK}",
        'about = { target = "chaser", azimuth_deg = 0.0 }',
        " [camera.nav]: about.range_m is missing",
    ),
    Damage(
        "about and looking elsewhere",
        PINHOLE,
        'about = { target = "chaser", azimuth_deg = 0.0, range_m = 5.0 }',
        " [camera.nav]: look_at contradicts about, which looks at its target",
    ),
    Damage(
        "temperature of a measured Sun",
        SUNWARD,
        f'{SUNWARD}\nspectrum = "astm_g173"\ntemperature_k = 5777.0',
        ' [sun]: temperature_k contradicts spectrum = "astm_g173"',
    ),
    Damage(
        "spectrum that is not known",
        SUNWARD,
        f'{SUNWARD}\nspectrum = "am0"',
        ' [sun]: spectrum must be one of "astm_g173", "planck", got "am0"',
    ),
    Damage(
        "limb darkening by a number",
        SUNWARD,
        f"{SUNWARD}\nlimb_darkening = 0.6",
        " [sun]: limb_darkening must be true or false, got 0.6",
    ),
    Damage(
        "stars fainter than the catalogue",
        RENDER,
        f"[sky]\nfaintest_star_mag = 9.0\n{RENDER}",
        " [sky]: faintest_star_mag must be a number <= 7.5, got 9.0",
    ),
    Damage(
        "stars by a number",
        RENDER,
        f"[sky]\nstars = 3\n{RENDER}",
        " [sky]: stars must be true or false, got 3",
    ),
    Damage(
        "stars of a misspelt key",
        RENDER,
        f"[sky]\nstar = true\n{RENDER}",
        ' [sky]: star is not a key here; did you mean "stars"? (allowed: faintest_star_mag, stars)',
    ),
    Damage(
        "lamp on nothing",
        RENDER,
        LAMP.replace('on = "chaser"', 'on = "chasr"'),
        ' [lamp.spot]: on names no spacecraft: "chasr"; did you mean "chaser"? (allowed: chaser, '
        "plate)",
    ),
    Damage(
        "lamp in two places",
        RENDER,
        LAMP.replace("look_at", "position_body_m = [0.0, 0.0, 0.0]\nlook_at"),
        " [lamp.spot]: position_body_m or keypoint is needed, and not both",
    ),
    Damage(
        "lamp at a keypoint of none",
        RENDER,
        LAMP.replace('on = "chaser"', 'on = "plate"').replace(
            'look_at = "plate"', 'look_at = "chaser"'
        ),
        ' [lamp.spot]: keypoint is not on "plate": "docking_port"; (none is allowed here)',
    ),
    Damage(
        "lamp in two directions",
        RENDER,
        LAMP.replace("half", "boresight = [1.0, 0.0, 0.0]\nhalf"),
        " [lamp.spot]: look_at or boresight is needed, and not both",
    ),
    Damage(
        "lamp that looks at its carrier",
        RENDER,
        LAMP.replace('look_at = "plate"', 'look_at = "chaser"'),
        " [lamp.spot]: look_at names the spacecraft that carries it",
    ),
    Damage(
        "lamp that looks at nothing",
        RENDER,
        LAMP.replace('look_at = "plate"', 'look_at = "plat"'),
        ' [lamp.spot]: look_at names no spacecraft: "plat"; did you mean "plate"? (allowed: '
        "chaser, plate)",
    ),
    Damage(
        "lamp in no direction",
        RENDER,
        LAMP.replace('look_at = "plate"', "boresight = [0.0, 0.0, 0.0]"),
        " [lamp.spot]: boresight needs a direction, got [0.0, 0.0, 0.0]",
    ),
    Damage(
        "lamp wider than its map",
        RENDER,
        LAMP.replace("10.0", "74.0"),
        " [lamp.spot]: half_angle_deg and edge_deg must together stay within 75, got 76",
    ),
    Damage(
        "lamp without spectrum",
        RENDER,
        LAMP.replace("temperature_k = 3000.0", ""),
        " [lamp.spot]: power_w as one number needs temperature_k or band_shares; got neither of "
        "them",
    ),
    Damage(
        "lamp of two spectra",
        RENDER,
        LAMP.replace("temperature", "band_shares = [0.2, 0.3, 0.2, 0.0]\ntemperature"),
        " [lamp.spot]: power_w as one number needs temperature_k or band_shares; got temperature_k "
        "and band_shares",
    ),
    Damage(
        "lamp with power per band and a spectrum",
        RENDER,
        LAMP.replace("5.0", "[1.0, 1.0, 1.0, 1.0]"),
        " [lamp.spot]: temperature_k contradicts power_w for each band; give power_w as one number",
    ),
    Damage(
        "lamp that takes light",
        RENDER,
        LAMP.replace("5.0", "-5.0"),
        " [lamp.spot]: power_w must not be negative, got -5",
    ),
    Damage(
        "lamp that takes light in one band",
        RENDER,
        LAMP.replace("5.0", "[1.0, 1.0, -2.0, 1.0]").replace("temperature_k = 3000.0", ""),
        " [lamp.spot]: power_w must not be negative, got -2",
    ),
    Damage(
        "lamp that radiates more than it is given",
        RENDER,
        LAMP.replace("temperature_k = 3000.0", "band_shares = [0.5, 0.3, 0.3, 0.2]"),
        " [lamp.spot]: band_shares must add up to at most 1, got 1.3",
    ),
    Damage(
        "lamp without power",
        RENDER,
        LAMP.replace("power_w = 5.0", ""),
        " [lamp.spot]: power_w is missing",
    ),
    Damage(
        "too many lamps",
        RENDER,
        "".join(LAMP.replace(RENDER, "").replace("spot", f"l{i}") for i in range(5)) + RENDER,
        ": lamp holds 5 lamps, at most 4 are possible",
    ),
)

BAD_FILES = (
    Damage(
        "axes of a shipped model",
        MODEL,
        f'{MODEL}\nup_axis = "y"',
        ' [spacecraft.chaser]: model: model "cubesat_12u" knows its axes; up_axis goes with a '
        "mesh file",
    ),
    Damage(
        "misspelt model",
        MODEL,
        'model = "cubesat_21u"',
        ' [spacecraft.chaser]: model: no model "cubesat_21u"; did you mean "cubesat_12u"? '
        "(allowed: MODELS)",
    ),
    Damage(
        "model file missing",
        MODEL,
        'model = "no/craft.glb"',
        " [spacecraft.chaser]: model: FOLDER/no/craft.glb: no such model file",
    ),
    Damage(
        "model file of another kind",
        MODEL,
        'model = "./scene.toml"',
        " [spacecraft.chaser]: model: FILE: not a mesh that simgl reads (.glb, .gltf, .obj, .stl)",
    ),
    Damage(
        "unit of a shipped model",
        MODEL,
        f"{MODEL}\nunit_m = 0.001",
        ' [spacecraft.chaser]: model: model "cubesat_12u" knows its unit; unit_m goes with a '
        "mesh file",
    ),
    Damage(
        "misspelt preset",
        LOOK,
        f'{LOOK}\npreset = "mt9m043"',
        ' [camera.nav]: preset: no camera preset "mt9m043"; did you mean "mt9m034"? (allowed: '
        "PRESETS)",
    ),
    Damage(
        "preset file missing",
        LOOK,
        f'{LOOK}\npreset = "mine.toml"',
        " [camera.nav]: preset: FOLDER/mine.toml: cannot be read (No such file or directory)",
    ),
)
