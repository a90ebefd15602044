"""Lens, detector and recording of a camera: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import LOOK, PINHOLE, Damage

DAMAGES = (
    Damage(
        "number for a text",
        LOOK,
        "look_at = 3",
        " [camera.nav]: look_at must be a text or a table of target, keypoint, part, got 3",
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
        "lens faster than light allows",
        LOOK,
        f"{LOOK}\nf_number = 0.4",
        " [camera.nav]: f_number must be a number >= 0.5, got 0.4",
    ),
    Damage(
        "exposure of a day",
        LOOK,
        f"{LOOK}\nexposure_time_s = 86400",
        " [camera.nav]: exposure_time_s must be a number > 0.0, <= 3600.0, got 86400",
    ),
    Damage(
        "negative exposure",
        LOOK,
        f"{LOOK}\nexposure_time_s = -0.001",
        " [camera.nav]: exposure_time_s must be a number > 0.0, <= 3600.0, got -0.001",
    ),
    Damage(
        "no pixels",
        LOOK,
        f"{LOOK}\nwidth_px = 0",
        " [camera.nav]: width_px must be a whole number >= 1, <= 16384, got 0",
    ),
    Damage(
        "too many pixels",
        LOOK,
        f"{LOOK}\nheight_px = 16385",
        " [camera.nav]: height_px must be a whole number >= 1, <= 16384, got 16385",
    ),
    Damage(
        "too many bits",
        LOOK,
        f"{LOOK}\nbits = 20",
        " [camera.nav]: bits must be a whole number >= 8, <= 16, got 20",
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
        " [camera.nav]: optics.vignetting_angle_deg is required with vignetting = "
        '"measured" and allowed only with it',
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
        "distortion that folds the image",
        LOOK,
        f"{LOOK}\nfocal_length_mm = 2.0\noptics.distortion = {{ k1 = -2.0 }}",
        " [camera.nav]: optics.distortion folds the image: two rays meet in one place",
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
        " [camera.nav]: optics.defocus_um requires diffraction = true",
    ),
    Damage(
        "two spreads",
        LOOK,
        f'{LOOK}\noptics = {{ psf_image = "psf.png", diffraction = true }}',
        " [camera.nav]: optics.diffraction contradicts psf_image, which holds all of the spread",
    ),
    Damage(
        "samples of no picture",
        LOOK,
        f"{LOOK}\noptics.psf_samples_per_px = 2",
        " [camera.nav]: optics.psf_samples_per_px requires psf_image",
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
        " [camera.nav]: optics.coating_reflectance requires surfaces",
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
        " [camera.nav]: lidar.wavelength_nm must be a number >= 400.0, <= 1000.0, got 1550.0",
    ),
    Damage(
        "rolling shutter without its row time",
        LOOK,
        f'{LOOK}\npreset = "ideal"\nshutter = "rolling"',
        ' [camera.nav]: row_time_us is missing; shutter = "rolling" needs it',
    ),
    Damage(
        "row time without a rolling shutter",
        LOOK,
        f'{LOOK}\npreset = "ideal"\nrow_time_us = 20.0',
        ' [camera.nav]: row_time_us requires shutter = "rolling"',
    ),
    Damage(
        "hot pixels without their current",
        LOOK,
        f'{LOOK}\npreset = "ideal"\nhot_pixels = 0.1',
        " [camera.nav]: hot_pixels requires hot_current_e_s, which is missing",
    ),
    Damage(
        "current of hot pixels that are none",
        LOOK,
        f'{LOOK}\npreset = "ideal"\nhot_current_e_s = 10.0',
        " [camera.nav]: hot_current_e_s requires hot_pixels, which is missing",
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
        " [camera.nav]: hot_pixels must be a number >= 0.0, <= 1.0, got 2.0",
    ),
    Damage(
        "detector at room temperature in Celsius",
        LOOK,
        f"{LOOK}\ntemperature_k = 20.0",
        " [camera.nav]: temperature_k must be a number >= 100.0, <= 400.0, got 20.0",
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
        " [camera.nav]: serial must be a whole number >= 0, <= 4294967295, got -1",
    ),
    Damage(
        "negative transmission",
        LOOK,
        f"{LOOK}\ntransmission = -0.5",
        " [camera.nav]: transmission must lie in 0..1, got -0.5",
    ),
    Damage(
        "elevation at the pole",
        f"{PINHOLE}\n{LOOK}",
        'about = { target = "plate", azimuth_deg = 0.0, elevation_deg = 90.0, range_m = 5.0 }',
        " [camera.nav]: about.elevation_deg must be a number >= -89.9, <= 89.9, got 90.0",
    ),
)
