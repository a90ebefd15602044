"""Two-line elements: published cases of SGP4, and of the turn from TEME to GCRF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.motion.files.motion_reader import read_path
from simgl.motion.orbits import TwoLineElements, icrf_from_teme
from simgl.physics.ephemeris import tai_ns_from_utc
from tests.motion.motion_files import EPOCH, TLE, written

# Object 5 of the verification set of Vallado et al., AIAA 2006-6753: minutes after its epoch, TEME
# position [km] and velocity [km/s].
OBJECT_5 = """\
1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753
2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667
"""
EPOCH_5_UTC = "2000-06-27T18:50:19.733568"
CASES = [
    (0.0, [7022.46529266, -1400.08296755, 0.03995155], [1.893841015, 6.405893759, 4.534807250]),
    (
        360.0,
        [-7154.03120202, -3783.17682504, -3536.19412294],
        [4.741887409, -4.151817765, -2.093935425],
    ),
    (
        720.0,
        [-7134.59340119, 6531.68641334, 3260.27186483],
        [-4.113793027, -2.911922039, -2.557327851],
    ),
]


def elements(folder: Path, text: str) -> TwoLineElements:
    law, in_lvlh = read_path(written(folder, text), EPOCH)
    assert isinstance(law, TwoLineElements)
    assert not in_lvlh
    return law


@pytest.mark.parametrize(("minutes", "r_km", "v_km_s"), CASES)
def test_the_verification_case(
    tmp_path: Path, minutes: float, r_km: list[float], v_km_s: list[float]
) -> None:
    """To 2 cm: the instant here is the epoch of the set to 3 us, 7 km/s."""
    tai_ns = tai_ns_from_utc(EPOCH_5_UTC) + round(minutes * 60e9)
    r, v = elements(tmp_path, OBJECT_5).state(tai_ns)
    back = icrf_from_teme(tai_ns).T
    np.testing.assert_allclose(back @ r / 1e3, r_km, atol=2e-5)
    np.testing.assert_allclose(back @ v / 1e3, v_km_s, atol=1e-8)


def test_teme_to_gcrf_as_published() -> None:
    """Vallado et al., AIAA 2006-6753, appendix C.

    The nutation of 1980 with its corrections and that of 2000A agree to milliarcseconds, 0.1 m.
    """
    tai_ns = tai_ns_from_utc("2004-04-06T07:51:28.386009")
    R = icrf_from_teme(tai_ns)
    r = R @ [5094.18016210, 6127.64465950, 6380.34453270]
    np.testing.assert_allclose(r, [5102.5089592, 6123.0114020, 6378.1369283], atol=1e-4)
    v = R @ [-4.746131487, 0.785818041, 5.531931288]
    np.testing.assert_allclose(v, [-4.7432201610, 0.7905364950, 5.5337557240], atol=1e-7)


def test_an_object_is_named_by_its_title_or_number(tmp_path: Path) -> None:
    assert elements(tmp_path, TLE).name == "ISS (ZARYA)"
    assert elements(tmp_path, OBJECT_5).name == "00005"
    both = written(tmp_path, TLE + OBJECT_5)
    with pytest.raises(ConfigError, match="several objects"):
        read_path(both, EPOCH)
    law, _ = read_path(both, EPOCH, name="00005")
    assert isinstance(law, TwoLineElements)
    assert law.name == "00005"


def test_a_decayed_orbit_has_no_place(tmp_path: Path) -> None:
    """A set of 2008 with drag, asked for a century later."""
    text = TLE.replace("-.00002182", " .01000000").replace("-11606-4", " 11606-1")
    lines = text.splitlines()
    total = sum(int(c) if c.isdigit() else c == "-" for c in lines[1][:-1]) % 10
    lines[1] = lines[1][:-1] + str(total)
    law = elements(tmp_path, "\n".join(lines))
    with pytest.raises(ConfigError, match="two-line elements has no place at this epoch"):
        law.state(tai_ns_from_utc("2090-01-01T00:00:00"))
