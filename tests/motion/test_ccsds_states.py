"""Messages of one state: the orbit through it, and the attitude that stays."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.motion.files.motion_reader import read_attitude, read_path
from simgl.motion.orbits import KeplerianOrbit, icrf_from_teme, keplerian_orbit
from simgl.motion.trajectory import FixedAttitude, LvlhAttitude
from simgl.physics.constants import EARTH_MU
from tests.motion.motion_files import APM, EPOCH, ORBIT, SECOND, opm, written


def test_the_orbit_through_a_state_goes_on(tmp_path: Path) -> None:
    """1 um/s of rounding is 3 x 5500 s x 0.5 um/s = 8 mm along the track after a revolution."""
    orbit, in_lvlh = read_path(written(tmp_path, opm()), EPOCH)
    assert isinstance(orbit, KeplerianOrbit)
    assert not in_lvlh
    np.testing.assert_allclose(orbit.state(EPOCH)[0], ORBIT.state(EPOCH)[0], atol=2e-6)
    later = EPOCH + 5500 * SECOND
    np.testing.assert_allclose(orbit.state(later)[0], ORBIT.state(later)[0], atol=0.02)


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 0.9, np.pi / 2, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize("excess", [0.0, 1e-9, 0.01, 0.2])
@pytest.mark.parametrize("place", [0.0, 2.0, np.pi, 5.0])
def test_any_closed_orbit_passes_through_its_state(
    tilt: float, excess: float, place: float
) -> None:
    """Also equatorial and circular ones, whose node or perigee is arbitrary."""
    r = 7.0e6 * np.array(
        [np.cos(place), np.sin(place) * np.cos(tilt), np.sin(place) * np.sin(tilt)]
    )
    along = np.array([-np.sin(place), np.cos(place) * np.cos(tilt), np.cos(place) * np.sin(tilt)])
    v = np.sqrt(EARTH_MU / 7.0e6) * (1.0 + excess) * along
    position, velocity = keplerian_orbit(r, v, EPOCH).state(EPOCH)
    # 7e6 m in double precision are 1e-9 m; angles of 1e-9 rad come by arccos to 1e-8: 0.1 m.
    near_pole = tilt in (1e-9, np.pi - 1e-9)
    np.testing.assert_allclose(position, r, atol=0.2 if near_pole else 1e-4)
    np.testing.assert_allclose(velocity, v, atol=2e-4 if near_pole else 1e-7)


@pytest.mark.parametrize(
    ("velocity", "complaint"),
    [
        ([0.0, 11_000.0, 0.0], "must be on a closed orbit, got the eccentricity"),
        ([0.0, 6_000.0, 0.0], "must be on an orbit outside the Earth, got a perigee"),
        ([7_000.0, 0.0, 0.0], "must be a state on an orbit, got a radial velocity"),
    ],
)
def test_what_is_no_orbit(velocity: list[float], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        keplerian_orbit(np.array([7.0e6, 0.0, 0.0]), np.array(velocity), EPOCH)


def test_a_state_in_teme_is_turned(tmp_path: Path) -> None:
    text = opm().replace("= ICRF", "= TEME")
    orbit, _ = read_path(written(tmp_path, text), EPOCH)
    expected = icrf_from_teme(EPOCH) @ ORBIT.state(EPOCH)[0]
    np.testing.assert_allclose(orbit.state(EPOCH)[0], expected, atol=1e-5)
    # Precession of 26 years is 0.36 deg: 43 km of the orbit's radius.
    assert np.linalg.norm(expected - ORBIT.state(EPOCH)[0]) > 1e4


OPM_XML = """\
<opm version="2.0"><header/><body><segment><metadata><OBJECT_NAME>A</OBJECT_NAME>
<CENTER_NAME>EARTH</CENTER_NAME><REF_FRAME>ICRF</REF_FRAME><TIME_SYSTEM>TAI</TIME_SYSTEM></metadata>
<data><stateVector><EPOCH>2026-03-20T12:00:37</EPOCH><X units="km">7000</X><Y>0</Y><Z>0</Z>
<X_DOT>0</X_DOT><Y_DOT>7.6</Y_DOT><Z_DOT>0</Z_DOT></stateVector>{more}</data></segment></body></opm>
"""


def test_a_state_in_xml(tmp_path: Path) -> None:
    """12:00:37 TAI is 12:00:00 UTC."""
    more = "<spacecraftParameters><MASS>5</MASS></spacecraftParameters>"
    orbit, _ = read_path(written(tmp_path, OPM_XML.format(more=more)), EPOCH)
    r, v = orbit.state(EPOCH)
    np.testing.assert_allclose(r, [7.0e6, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(v, [0.0, 7600.0, 0.0], atol=1e-9)
    more = "<maneuverParameters><MAN_DURATION>5</MAN_DURATION></maneuverParameters>"
    with pytest.raises(ConfigError, match="line 4: plans a manoeuvre"):
        read_path(written(tmp_path, OPM_XML.format(more=more)), EPOCH)


def test_a_state_has_no_samples(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="is an OPM, which has no samples; longest_gap_s req"):
        read_path(written(tmp_path, opm()), EPOCH, longest_gap_s=5.0)


# Version 1 in key-value form has no blocks, and frames with names of their own.
_V1 = APM.replace("= 2.0", "= 1.0").replace("REF_FRAME", "Q_FRAME").replace("META_START\n", "")
V1 = re.sub("(META|QUAT)_(START|STOP)\n", "", _V1)
ANGLES = re.sub("Q[123C] = .*\n", "", APM.replace("QUAT", "EULER"))
ANGLES = ANGLES.replace(
    "EULER_STOP", "EULER_ROT_SEQ = 321\nANGLE_1 = 60 [deg]\nANGLE_2 = 0\nANGLE_3 = 0\nEULER_STOP"
)
V1_ANGLES = re.sub("Q[123C] = .*\n", "", V1).replace("Q_FRAME", "EULER_FRAME") + (
    "EULER_DIR = A2B\nEULER_ROT_SEQ = 321\nX_ANGLE = 0\nY_ANGLE = 0\nZ_ANGLE = 60\n"
)
EXCHANGED = APM.replace("A = ICRF", "A = SC_BODY").replace("B = SC_BODY_1", "B = ICRF")
EXCHANGED = EXCHANGED.replace("Q3 = 0.5", "Q3 = -0.5")
XML = """\
<apm version="2.0"><header/><body><segment><metadata><OBJECT_NAME>A</OBJECT_NAME>
<TIME_SYSTEM>UTC</TIME_SYSTEM></metadata><data><EPOCH>2026-03-20T12:00:00</EPOCH><quaternionState>
<REF_FRAME_A>ICRF</REF_FRAME_A><REF_FRAME_B>SC_BODY_1</REF_FRAME_B><quaternion><Q1>0</Q1><Q2>0</Q2>
<Q3>0.5</Q3><QC>0.8660254037844386</QC></quaternion></quaternionState></data></segment></body></apm>
"""


def fixed(tmp_path: Path, text: str) -> Array:
    law = read_attitude(written(tmp_path, text), EPOCH)
    assert isinstance(law, FixedAttitude)
    return law.R_icrf_from_body


@pytest.mark.parametrize("text", [APM, V1, ANGLES, V1_ANGLES, EXCHANGED, XML])
def test_an_attitude_in_every_form(tmp_path: Path, text: str) -> None:
    """60 deg about z carry ICRF's x to the body's x."""
    x_body = fixed(tmp_path, text) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(x_body, [0.5, np.sqrt(0.75), 0.0], atol=1e-12)


def test_an_attitude_may_be_against_lvlh(tmp_path: Path) -> None:
    law = read_attitude(written(tmp_path, APM.replace("= ICRF", "= LVLH")), EPOCH)
    assert isinstance(law, LvlhAttitude)


def test_an_attitude_that_turns_is_refused(tmp_path: Path) -> None:
    rate = APM.replace("QUAT_STOP", "Q1_DOT = {} [1/s]\nQUAT_STOP")
    assert fixed(tmp_path, rate.format("0.0")).shape == (3, 3)
    with pytest.raises(ConfigError, match="line 17: Q1_DOT must be 0; attitudes that turn go into"):
        fixed(tmp_path, rate.format("0.1"))
