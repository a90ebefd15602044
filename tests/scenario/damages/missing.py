"""Files named by a scenario: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import LAMP, LOOK, MODEL, RENDER, Damage

DAMAGES = (
    Damage(
        "axes of a shipped model",
        MODEL,
        f'{MODEL}\nup_axis = "y"',
        ' [spacecraft.chaser]: model: model "cubesat_12u" knows its axes; up_axis is '
        "allowed only for a mesh file",
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
        "model in a format that is not read",
        MODEL,
        'model = "craft.step"',
        " [spacecraft.chaser]: model: FOLDER/craft.step: no such model file",
    ),
    Damage(
        "unit of a shipped model",
        MODEL,
        f"{MODEL}\nunit_m = 0.001",
        ' [spacecraft.chaser]: model: model "cubesat_12u" knows its unit; unit_m is '
        "allowed only for a mesh file",
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
    Damage(
        "filter file missing",
        RENDER,
        f'[bands]\nfilter = "no.csv"\n{RENDER}',
        " [bands]: filter: FOLDER/no.csv: cannot be read (No such file or directory)",
    ),
    Damage(
        "curve of a material missing",
        "reflectance = 0.5",
        'reflectance = "no.csv"',
        " [spacecraft.plate]: model.plate.material.reflectance: FOLDER/no.csv: cannot "
        "be read (No such file or directory)",
    ),
    Damage(
        "curve of a lamp missing",
        RENDER,
        LAMP.replace("temperature_k = 3000.0", 'wavelength_nm = "no.csv"'),
        " [lamp.spot]: wavelength_nm: FOLDER/no.csv: cannot be read (No such file or directory)",
    ),
    Damage(
        "image of the spread missing",
        LOOK,
        f'{LOOK}\noptics.psf_image = "no.png"',
        " [camera.nav]: optics.psf_image: FOLDER/no.png: cannot be read (No such file or "
        "directory)",
    ),
)
