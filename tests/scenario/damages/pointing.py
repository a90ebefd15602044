"""Where a camera sits and looks: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import LOOK, PINHOLE, Damage

DAMAGES = (
    Damage(
        "two mounts",
        PINHOLE,
        f'{PINHOLE}\non = "chaser"',
        " [camera.nav]: needs exactly one of on, about, position_icrf_m; got on and "
        "position_icrf_m",
    ),
    Damage(
        "no mount",
        f"{PINHOLE}\n",
        "",
        " [camera.nav]: needs exactly one of on, about, position_icrf_m; got none of them",
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
        " [camera.nav]: needs exactly one of look_at, limb, boresight; got none of them",
    ),
    Damage(
        "looking two ways",
        LOOK,
        f"{LOOK}\nboresight = [0.0, 0.0, -1.0]",
        " [camera.nav]: needs exactly one of look_at, limb, boresight; got look_at and boresight",
    ),
    Damage(
        "top of the image along the view",
        LOOK,
        "boresight = [0.0, 0.0, 2.0]\nup = [0.0, 0.0, -1.0]",
        " [camera.nav]: up must not lie along boresight, got [0.0, 0.0, -1.0]",
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
        " [camera.nav]: limb requires on, got position_icrf_m",
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
        " [camera.nav]: limb.tangent_height_km must be a number >= 0.0, <= 10000.0, got -1.0",
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
        " [camera.nav]: keep_from_sun_deg must be a number > 0.0, < 180.0, got 180.0",
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
        " [camera.nav]: needs exactly one of position_body_m, keypoint; got none of them",
    ),
    Damage(
        "on a body at two places",
        PINHOLE,
        'on = "chaser"\nkeypoint = "docking_port"\nposition_body_m = [0.0, 0.0, 1.0]',
        " [camera.nav]: needs exactly one of position_body_m, keypoint; got position_body_m and "
        "keypoint",
    ),
    Damage(
        "keypoint of a primitive",
        PINHOLE,
        'on = "plate"\nkeypoint = "tip"',
        ' [camera.nav]: keypoint is not on "plate": "tip"; none is allowed here',
    ),
    Damage(
        "keypoint without a body",
        PINHOLE,
        f'{PINHOLE}\nkeypoint = "docking_port"',
        " [camera.nav]: keypoint requires on, got position_icrf_m",
    ),
    Damage(
        "about nobody",
        f"{PINHOLE}\n{LOOK}",
        'about = { target = "x", azimuth_deg = 0.0, range_m = 5.0 }',
        ' [camera.nav]: about.target names no spacecraft: "x"; allowed: chaser, plate',
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
)
