"""A file as a whole: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import EPOCH, SEED, UTC, Damage

DAMAGES = (
    Damage(
        "unknown table",
        "[render]",
        "[rendering]",
        ': rendering is not a table here; did you mean "render"? (allowed: assess, bands, '
        "camera, earth, epoch, lamp, render, requirements, sky, spacecraft, sun, thermal, "
        "uncertainty)",
    ),
    Damage(
        "unknown table on two lines",
        "[render]",
        '["a\\nb"]',
        ': "a\\nb" is not a table here; allowed: assess, bands, camera, earth, epoch, lamp, '
        "render, requirements, sky, spacecraft, sun, thermal, uncertainty",
    ),
    Damage(
        "unknown key",
        SEED,
        "sead = 1",
        ' [render]: sead is not a key here; did you mean "seed"? (allowed: '
        "between_spacecraft, gather, glossy_reflections, inter_reflection, joint_light, "
        "samples_per_pixel, seed)",
    ),
    Damage(
        "unknown key on two lines",
        SEED,
        '"a\\nb" = 1',
        ' [render]: "a\\nb" is not a key here; allowed: between_spacecraft, gather, '
        "glossy_reflections, inter_reflection, joint_light, samples_per_pixel, seed",
    ),
    Damage(
        "unknown gather",
        SEED,
        'gather = "voxel"',
        ' [render]: gather must be one of "pixel", "vertex", got "voxel"',
    ),
    Damage(
        "gather without interreflection",
        SEED,
        'gather = "pixel"\ninter_reflection = false',
        " [render]: gather requires inter_reflection = true",
    ),
    Damage(
        "epoch is not a table",
        EPOCH,
        'epoch = "2026-03-20T12:00:00"\n',
        ' [epoch]: must be a table, got "2026-03-20T12:00:00"',
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
        ': camera."../nav" must be a name of letters a to z or A to Z, digits, _ and -',
    ),
    Damage(
        "spacecraft name on two lines",
        "[spacecraft.chaser]",
        '[spacecraft."a\\nb"]',
        ': spacecraft."a\\nb" must be a name of letters a to z or A to Z, digits, _ and -',
    ),
    Damage(
        "spacecraft name with an umlaut",
        "[spacecraft.chaser]",
        '[spacecraft."jäger"]',
        ': spacecraft."jäger" must be a name of letters a to z or A to Z, digits, _ and -',
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
        "fraction for a whole number",
        SEED,
        "seed = 1.5",
        " [render]: seed must be a whole number, got 1.5",
    ),
    Damage(
        "whole number beyond all sizes",
        SEED,
        "seed = 1" + "0" * 30,
        " [render]: seed must lie within +-1e+18, got 1.00000e+30",
    ),
    Damage(
        "negative seed",
        SEED,
        "seed = -1",
        " [render]: seed must be a whole number >= 0, <= 4294967295, got -1",
    ),
    Damage(
        "seed of 33 bits",
        SEED,
        "seed = 4294967296",
        " [render]: seed must be a whole number >= 0, <= 4294967295, got 4294967296",
    ),
    Damage(
        "too few samples",
        SEED,
        "samples_per_pixel = 4",
        " [render]: samples_per_pixel must be a whole number >= 5, <= 256, got 4",
    ),
    Damage(
        "whole number beyond a float",
        SEED,
        "seed = 1" + "0" * 400,
        " [render]: seed must lie within +-1e+18, got 1.00000e+400",
    ),
)
