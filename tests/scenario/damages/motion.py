"""Places, orbits and attitudes of a spacecraft: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import ORBIT, PLACE, Damage

DAMAGES = (
    Damage(
        "open orbit",
        ORBIT,
        "orbit = { semi_major_axis_km = 7000.0, eccentricity = 1.0 }",
        " [spacecraft.chaser]: orbit.eccentricity must be a number >= 0.0, < 1.0, got 1.0",
    ),
    Damage(
        "inclination above 180",
        ORBIT,
        "orbit = { altitude_km = 400.0, inclination_deg = 200.0 }",
        " [spacecraft.chaser]: orbit.inclination_deg must be a number >= 0.0, <= 180.0, got 200.0",
    ),
    Damage(
        "two places",
        PLACE,
        PLACE + "\norbit = { altitude_km = 400.0, inclination_deg = 51.6 }",
        " [spacecraft.plate]: needs exactly one of orbit, trajectory, relative_to, "
        "position_icrf_m; got orbit and position_icrf_m",
    ),
    Damage(
        "no place",
        f"{PLACE}\n",
        "",
        " [spacecraft.plate]: needs exactly one of orbit, trajectory, relative_to, "
        "position_icrf_m; got none of them",
    ),
    Damage(
        "velocity of another place",
        ORBIT,
        f"{ORBIT}\nvelocity_icrf_m_s = [0.0, 0.0, 0.0]",
        " [spacecraft.chaser]: velocity_icrf_m_s requires position_icrf_m, got orbit",
    ),
    Damage(
        "relative place without a reference",
        ORBIT,
        f"{ORBIT}\nposition_lvlh_m = [0.0, 0.0, 0.0]",
        " [spacecraft.chaser]: position_lvlh_m requires relative_to, got orbit",
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
        " [spacecraft.chaser]: orbit needs exactly one of altitude_km, semi_major_axis_km; "
        "got none of them",
    ),
    Damage(
        "orbit of two sizes",
        ORBIT,
        "orbit = { altitude_km = 400.0, semi_major_axis_km = 6778.0 }",
        " [spacecraft.chaser]: orbit needs exactly one of altitude_km, semi_major_axis_km; "
        "got altitude_km and semi_major_axis_km",
    ),
    Damage(
        "altitude in metres",
        ORBIT,
        "orbit = { altitude_km = 400e3 }",
        " [spacecraft.chaser]: orbit.altitude_km must be a number > 0.0, <= 100000.0, got 400000.0",
    ),
    Damage(
        "semi-major axis in metres",
        ORBIT,
        "orbit = { semi_major_axis_km = 6778e3 }",
        " [spacecraft.chaser]: orbit.semi_major_axis_km must be a number > 0.0, <= 1000000.0, got "
        "6778000.0",
    ),
    Damage(
        "eccentric altitude",
        ORBIT,
        "orbit = { altitude_km = 400.0, eccentricity = 0.1 }",
        " [spacecraft.chaser]: orbit.eccentricity requires semi_major_axis_km",
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
)
