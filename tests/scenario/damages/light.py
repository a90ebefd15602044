"""Sun, Earth, sky and lamps: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import LAMP, RENDER, SHAPE, SUNWARD, Damage

DAMAGES = (
    Damage(
        "sun is a list of tables",
        "[sun]",
        "[[sun]]",
        " [sun]: must be a table, got a list of tables",
    ),
    Damage(
        "number for true or false",
        SUNWARD,
        "visible = 1",
        " [sun]: visible must be true or false, got 1",
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
        " [sun]: temperature_k must be a number >= 1000.0, <= 50000.0, got 300.0",
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
        " [sun]: angular_diameter_deg must be a number > 0.0, <= 10.0, got 11.0",
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
        ' [earth]: radius_km requires shape = "sphere", got "wgs84"',
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
        ' [earth]: albedo requires an Earth, got shape = "none"',
    ),
    Damage(
        "atmosphere of no Earth",
        SHAPE,
        f'{SHAPE}\natmosphere = "source"',
        ' [earth]: atmosphere requires an Earth, got shape = "none"',
    ),
    Damage(
        "heat of an Earth with maps",
        SHAPE,
        f"{SHAPE}\nlongwave_w_m2 = 239.0",
        " [earth]: longwave_w_m2 requires albedo; an Earth with maps has a climate and clouds",
    ),
    Damage(
        "airglow without air",
        SHAPE,
        'shape = "wgs84"\natmosphere = "none"\nairglow = true',
        " [earth]: airglow requires an atmosphere, got none",
    ),
    Damage(
        "moonlight without a Moon",
        SHAPE,
        'shape = "wgs84"\nmoonlight = true',
        " [earth]: moonlight requires a Moon; a scene with a fixed Sun has none",
    ),
    Damage(
        "moonlight on a grey Earth",
        SHAPE,
        'shape = "wgs84"\nalbedo = 0.3\nmoonlight = true',
        " [earth]: moonlight requires an Earth with maps, got albedo",
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
        "bands beyond the infrared",
        RENDER,
        f"[bands]\nedges_nm = [[840.0, 860.0], [2400.0, 2600.0]]\n{RENDER}",
        " [bands]: edges_nm must hold bands from 300 to 2500, at least 1 wide, got [2400, 2600]",
    ),
    Damage(
        "bands that overlap",
        RENDER,
        f"[bands]\nedges_nm = [[500.0, 600.0], [450.0, 550.0]]\n{RENDER}",
        " [bands]: edges_nm must not overlap; one band ends at 550, another begins at 500",
    ),
    Damage(
        "five bands",
        RENDER,
        f"[bands]\nedges_nm = {[[400.0 + n, 401.0 + n] for n in range(5)]}\n{RENDER}",
        " [bands]: edges_nm must be a list of length <= 4, got [[400.0, 401.0], [401.0, 402.0], "
        "[402.0, 403.0], [403.0, 404.0], [404.0, 405.0]]",
    ),
    Damage(
        "names of bands that are none",
        RENDER,
        f'[bands]\nnames = ["a"]\n{RENDER}',
        " [bands]: names requires edges_nm or filter",
    ),
    Damage(
        "names of too few bands",
        RENDER,
        f'[bands]\nedges_nm = [[400.0, 500.0], [500.0, 600.0]]\nnames = ["a", "a"]\n{RENDER}',
        " [bands]: names must be 2 different names, one for each band",
    ),
    Damage(
        "a band named as the depth",
        RENDER,
        f'[bands]\nedges_nm = [[400.0, 500.0]]\nnames = ["Z"]\n{RENDER}',
        " [bands]: names must be of letters a to z or A to Z, digits, _ and -, at most 32, not Z "
        "and partId",
    ),
    Damage(
        "air of the study in other bands",
        SHAPE,
        'atmosphere = "source"\n[bands]\nedges_nm = [[840.0, 860.0]]',
        ' [earth]: atmosphere must be "standard" or "none" with [bands], got "source": it is known '
        "in R, G, B and N alone",
    ),
    Damage(
        "lamp in none of the bands",
        RENDER,
        LAMP.replace("temperature_k = 3000.0", "wavelength_nm = 940.0").replace(
            "[render]", "[bands]\nedges_nm = [[840.0, 860.0]]\n[render]"
        ),
        " [lamp.spot]: wavelength_nm must have a line in [bands] (840-860nm 840-860), got [940.0]",
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
        " [sky]: faintest_star_mag must be a number >= -2.0, <= 7.5, got 9.0",
    ),
    Damage(
        "faintest star without stars",
        RENDER,
        f"[sky]\nfaintest_star_mag = 3.0\n{RENDER}",
        " [sky]: faintest_star_mag requires stars = true; by default, a scene with a fixed "
        "Sun has no stars",
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
        " [lamp.spot]: needs exactly one of position_body_m, keypoint; got position_body_m and "
        "keypoint",
    ),
    Damage(
        "lamp at a keypoint of none",
        RENDER,
        LAMP.replace('on = "chaser"', 'on = "plate"').replace(
            'look_at = "plate"', 'look_at = "chaser"'
        ),
        ' [lamp.spot]: keypoint is not on "plate": "docking_port"; none is allowed here',
    ),
    Damage(
        "lamp in two directions",
        RENDER,
        LAMP.replace("half", "boresight = [1.0, 0.0, 0.0]\nhalf"),
        " [lamp.spot]: needs exactly one of look_at, boresight; got look_at and boresight",
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
        " [lamp.spot]: power_w as one number needs wavelength_nm, temperature_k or band_shares; "
        "got none of them",
    ),
    Damage(
        "lamp of two spectra",
        RENDER,
        LAMP.replace("temperature", "band_shares = [0.2, 0.3, 0.2, 0.0]\ntemperature"),
        " [lamp.spot]: power_w as one number needs wavelength_nm, temperature_k or band_shares; "
        "got temperature_k and band_shares",
    ),
    Damage(
        "lamp with a line in no band",
        RENDER,
        LAMP.replace("temperature_k = 3000.0", "wavelength_nm = [850.0, 1064.0]"),
        " [lamp.spot]: wavelength_nm must lie in 400..1000, got 1064",
    ),
    Damage(
        "lamp with weights of other lines",
        RENDER,
        LAMP.replace(
            "temperature_k = 3000.0", "wavelength_nm = [850.0, 640.0]\nline_weights = [1.0]"
        ),
        " [lamp.spot]: line_weights needs one number for each of 2 lines, got 1",
    ),
    Damage(
        "lamp with weights of a single line",
        RENDER,
        LAMP.replace("temperature_k = 3000.0", "wavelength_nm = 850.0\nline_weights = [1.0]"),
        " [lamp.spot]: line_weights requires a list of lines in wavelength_nm",
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
