"""Tables of motion: columns by name, whatever their order, unit and frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.motion.files.motion_reader import read_path
from simgl.physics.ephemeris import utc_from_tai_ns
from tests.motion.motion_files import EPOCH, ORBIT, SECOND, sampled_attitude, written

WHEN = EPOCH + 95 * SECOND
STK_MONTH = {"03": "Mar"}


def rows(time: str, scale: float, velocity: bool = True) -> list[str]:
    """A row every ten seconds, place and velocity times a factor."""
    actual = []
    for index in range(30):
        tai_ns = EPOCH + index * 10 * SECOND
        utc = utc_from_tai_ns(tai_ns)
        clock = {
            "utc": utc,
            "tai_ns": str(tai_ns),
            "time_s": f"{index * 10}",
            "Time (UTCG)": f"{utc[8:10]} {STK_MONTH[utc[5:7]]} {utc[:4]} {utc[11:]}.000",
        }[time]
        r, v = ORBIT.state(tai_ns)
        values = [*r, *v] if velocity else [*r]
        actual.append(",".join([clock, *(f"{scale * value:.9f}" for value in values)]))
    return actual


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("utc,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s", 1.0),
        ("tai_ns,x_icrf_km,y_icrf_km,z_icrf_km,vx_icrf_km_s,vy_icrf_km_s,vz_icrf_km_s", 1e-3),
        ("time_s,x_m,y_m,z_m", 1.0),
        (
            '"Time (UTCG)","x (km)","y (km)","z (km)","vx (km/sec)","vy (km/sec)","vz (km/sec)"',
            1e-3,
        ),
    ],
)
def test_an_orbit_comes_back_from_each_form(tmp_path: Path, header: str, scale: float) -> None:
    """Printed to a micrometre at least; the curve through ten-second steps adds less."""
    time = header.split(",")[0].strip('"')
    text = "\n".join([header, *rows(time, scale, "v" in header)])
    path, in_lvlh = read_path(written(tmp_path, text), EPOCH)
    assert not in_lvlh
    np.testing.assert_allclose(path.state(WHEN)[0], ORBIT.state(WHEN)[0], atol=1e-5)
    np.testing.assert_allclose(path.state(WHEN)[1], ORBIT.state(WHEN)[1], atol=1e-5)


def test_other_columns_comments_and_the_order_make_no_difference(tmp_path: Path) -> None:
    table = [row.split(",") for row in rows("utc", 1.0)]
    lines = ["# from a simulation", "mode,z_m,utc,y_m,x_m,vz_m_s,vy_m_s,vx_m_s"]
    lines += [",".join(["coast", t[3], t[0], t[2], t[1], t[6], t[5], t[4]]) for t in table]
    path, _ = read_path(written(tmp_path, "\n".join(lines) + "\n\n"), EPOCH)
    np.testing.assert_allclose(path.state(WHEN)[0], ORBIT.state(WHEN)[0], atol=1e-5)


def test_radial_in_track_and_cross_track_become_lvlh(tmp_path: Path) -> None:
    """In-track along x, cross-track along the orbit normal (-y), radial up (-z)."""
    header = "time_s,Radial (km),In-Track (km),Cross-Track (km)"
    text = "\n".join([header, *(f"{t},0.001,-0.2,0.03" for t in range(10))])
    path, in_lvlh = read_path(written(tmp_path, text), EPOCH)
    assert in_lvlh
    place, rate = path.state(EPOCH + 4_500_000_000)
    np.testing.assert_allclose(place, [-200.0, -30.0, -1.0], atol=1e-9)
    np.testing.assert_allclose(rate, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "header",
    ["time_s,qx,qy,qz,qw", "time_s,q1,q2,q3,q4", "time_s,q_icrf_x,q_icrf_y,q_icrf_z,q_icrf_w"],
)
def test_attitudes_are_frame_from_body(tmp_path: Path, header: str) -> None:
    """A quarter turn about z: the body's x axis along the frame's y."""
    half = np.sqrt(0.5)
    text = f"{header}\n0,0,0,0,1\n10,0,0,{half},{half}\n"
    attitude = sampled_attitude(written(tmp_path, text))
    assert not attitude.in_lvlh
    R = attitude.rotations.matrix(EPOCH + 10 * SECOND)
    np.testing.assert_allclose(R @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("time_s,q0,q1,q2,q3", "0.5,0.5,0.5,0.5"),
        ("time_s,yaw_deg,pitch_deg,roll_deg", "90,0,90"),
        ("time_s,roll_lvlh_deg,pitch_lvlh_deg,yaw_lvlh_deg", "90,0,90"),
    ],
)
def test_other_orders_of_an_attitude(tmp_path: Path, header: str, row: str) -> None:
    """A third of a turn about the diagonal: x to y to z; as yaw 90, roll 90 deg about the new x."""
    attitude = sampled_attitude(written(tmp_path, f"{header}\n0,{row}\n"))
    assert attitude.in_lvlh == ("lvlh" in header)
    R = attitude.rotations.matrix(EPOCH)
    np.testing.assert_allclose(R, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-12)


def test_attitudes_may_be_against_lvlh(tmp_path: Path) -> None:
    text = "time_s,q_lvlh_x,q_lvlh_y,q_lvlh_z,q_lvlh_w\n0,0,0,0,1\n10,0,0,0,1\n"
    assert sampled_attitude(written(tmp_path, text)).in_lvlh
