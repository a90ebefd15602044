"""SPICE kernels that the test writes, against the motion that they were written from."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import spiceypy

from simgl.errors import ConfigError
from simgl.motion.files.spice import SpiceSource, read_spice_path, read_spice_rotations
from simgl.motion.samples import Path as SampledPath
from simgl.physics.ephemeris import moon_position, sun_position, tai_ns_from_utc
from simgl.physics.frames import angle_between
from simgl.scenario.loader import load_scenario
from tests.authorities.de421 import DE421, Places
from tests.motion.motion_files import EPOCH, ORBIT, SECOND

BODY, FRAME_ID = -999, -999_000
# Seconds from the epoch for which the kernels have states: two passages with a gap.
PASSAGES = [(-900.0, 3000.0), (3600.0, 6000.0)]
# The constants of NAIF's naif0012.tls that concern 2026.
LSK = """\
KPL/LSK
\\begindata
DELTET/DELTA_T_A = 32.184
DELTET/K = 1.657D-3
DELTET/EB = 1.671D-2
DELTET/M = ( 6.239996D0 1.99096871D-7 )
DELTET/DELTA_AT = ( 36, @2015-JUL-1 37, @2017-JAN-1 )
\\begintext
"""
SCLK = """\
KPL/SCLK
\\begindata
SCLK_KERNEL_ID = ( @2026-01-01 )
SCLK_DATA_TYPE_999 = ( 1 )
SCLK01_TIME_SYSTEM_999 = ( 1 )
SCLK01_N_FIELDS_999 = ( 2 )
SCLK01_MODULI_999 = ( 4294967296 65536 )
SCLK01_OFFSETS_999 = ( 0 0 )
SCLK01_OUTPUT_DELIM_999 = ( 1 )
SCLK_PARTITION_START_999 = ( 0.0 )
SCLK_PARTITION_END_999 = ( 2.8147497671065600E+14 )
SCLK01_COEFFICIENTS_999 = ( 0.0 0.0 1.0 )
\\begintext
"""
FK = """\
KPL/FK
\\begindata
FRAME_TEST_BODY = -999000
FRAME_-999000_NAME = 'TEST_BODY'
FRAME_-999000_CLASS = 3
FRAME_-999000_CLASS_ID = -999000
FRAME_-999000_CENTER = -999
CK_-999000_SCLK = -999
CK_-999000_SPK = -999
FRAME_TEST_CAMERA = -999001
FRAME_-999001_NAME = 'TEST_CAMERA'
FRAME_-999001_CLASS = 4
FRAME_-999001_CLASS_ID = -999001
FRAME_-999001_CENTER = -999
TKFRAME_-999001_RELATIVE = 'TEST_BODY'
TKFRAME_-999001_SPEC = 'ANGLES'
TKFRAME_-999001_UNITS = 'DEGREES'
TKFRAME_-999001_AXES = ( 3 2 1 )
TKFRAME_-999001_ANGLES = ( 90.0 0.0 0.0 )
\\begintext
"""
META = "KPL/MK\n\\begindata\nKERNELS_TO_LOAD = ( {} )\n\\begintext\n"
RATE = np.radians(0.2)


def ephemeris_time(tai_ns: int) -> float:
    """By SPICE's own conversion, with the leap-second kernel loaded."""
    j2000 = 946_728_000 * SECOND
    return float(spiceypy.unitim((tai_ns - j2000) * 1e-9, "TAI", "ET"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A mission of two passages: orbit, attitude, frames, clocks."""
    folder = tmp_path_factory.mktemp("kernels")
    for name, text in (("a.tls", LSK), ("a.tsc", SCLK), ("a.tf", FK)):
        (folder / name).write_text(text)
    spiceypy.kclear()
    try:
        for name in ("a.tls", "a.tsc", "a.tf"):
            spiceypy.furnsh(str(folder / name))
        write_orbit(folder / "a.bsp")
        write_attitude(folder / "a.bc")
        write_sun_and_moon(folder / "de421.bsp")
    finally:
        spiceypy.kclear()
    names = ["a.tls", "a.tsc", "a.tf", "a.bsp", "a.bc"]
    (folder / "mission.tm").write_text(META.format(" ".join(f"'{n}'" for n in names)))
    (folder / "sky.tm").write_text(META.format("'a.tls' 'de421.bsp'"))
    return folder


def write_orbit(path: Path) -> None:
    handle = spiceypy.spkopn(str(path), "test", 0)
    for first, last in PASSAGES:
        times = [EPOCH + round(s * SECOND) for s in np.arange(first, last + 1.0, 30.0)]
        states = [np.concatenate(ORBIT.state(t)) / 1e3 for t in times]
        et = [ephemeris_time(t) for t in times]
        spiceypy.spkw13(
            handle, BODY, 399, "J2000", et[0], et[-1], "orbit", 7, len(et), np.array(states), et
        )
    spiceypy.spkcls(handle)


def write_attitude(path: Path) -> None:
    """A turn about z at 0.2 deg/s from the epoch on, body to ICRF."""
    handle = spiceypy.ckopn(str(path), "test", 0)
    for first, last in PASSAGES:
        seconds = np.arange(first, last + 1.0, 30.0)
        et = [ephemeris_time(EPOCH + round(s * SECOND)) for s in seconds]
        ticks = np.array([spiceypy.sce2c(BODY, t) for t in et])
        half = 0.5 * RATE * seconds
        # A C-kernel holds rotations from the base frame to the body.
        quaternions = np.stack([np.cos(half), 0 * half, 0 * half, -np.sin(half)], axis=1)
        spiceypy.ckw03(
            handle, ticks[0], ticks[-1], FRAME_ID, "J2000", False, "turn", len(ticks), ticks,
            quaternions, np.zeros((len(ticks), 3)), 1, ticks[:1],
        )  # fmt: skip
    spiceypy.ckcls(handle)


def write_sun_and_moon(path: Path) -> None:
    """Their places by DE421, with speeds of simgl's, a minute around each instant."""
    handle = spiceypy.spkopn(str(path), "test", 0)
    for place in DE421:
        when = tai_ns_from_utc(place.utc)
        et = [ephemeris_time(when + s * SECOND) for s in (-60, 0, 60)]
        for body, r, law in ((10, place.sun, sun_position), (301, place.moon, moon_position)):
            v = (law(when + SECOND) - law(when - SECOND)) / 2e3
            states = [[*(np.array(r) + s * v), *v] for s in (-60.0, 0.0, 60.0)]
            spiceypy.spkw09(
                handle, body, 399, "J2000", et[0], et[-1], "place", 1, 3, np.array(states), et
            )
    spiceypy.spkcls(handle)


def source(
    folder: Path, span_s: tuple[float, float] = (0.0, 900.0), name: str = "mission.tm"
) -> SpiceSource:
    return SpiceSource(path=folder / name, epoch_tai_ns=EPOCH, span_s=span_s)


def test_an_orbit_comes_back(folder: Path) -> None:
    """Nodes 30 s apart hold the orbit to 0.01 mm; SPICE's seconds step by 1e-7 s, 0.9 mm."""
    path = read_spice_path(source(folder), BODY, 1.0)
    for seconds in (0.0, 12.345, 599.5, 900.0):
        when = EPOCH + round(seconds * SECOND)
        r, v = path.state(when)
        np.testing.assert_allclose(r, ORBIT.state(when)[0], atol=1e-3)
        np.testing.assert_allclose(v, ORBIT.state(when)[1], atol=1e-5)


@pytest.mark.parametrize(("frame", "offset"), [("TEST_BODY", 0.0), ("TEST_CAMERA", -90.0)])
def test_an_attitude_comes_back(folder: Path, frame: str, offset: float) -> None:
    """A constant rate is exact by slerp; a frame kernel's camera is turned from the body."""
    rotations = read_spice_rotations(source(folder), frame)
    angle = RATE * 123.4 + np.radians(offset)
    x = rotations.matrix(EPOCH + round(123.4 * SECOND)) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(x, [np.cos(angle), np.sin(angle), 0.0], atol=1e-7)


# Of a Moon whose prime meridian turns about ICRF's z axis.
PCK = """\
KPL/PCK
\\begindata
BODY301_POLE_RA = ( 270.0 0.0 0.0 )
BODY301_POLE_DEC = ( 90.0 0.0 0.0 )
BODY301_PM = ( 38.0 13.17 0.0 )
\\begintext
"""
MOON_KM = np.array([384e3, 0.0, 0.0, 0.0, 1.0, 0.0])


def test_a_spacecraft_beyond_the_earth_comes_by_the_body_that_it_goes_about(folder: Path) -> None:
    """Its kernel is relative to the Moon, and another one has the Moon."""
    (folder / "moon.tpc").write_text(PCK)
    when = EPOCH + round(123.4 * SECOND)
    seconds = np.arange(-900.0, 1801.0, 30.0)
    about = [np.concatenate(ORBIT.state(EPOCH + round(s * SECOND))) / 1e3 for s in seconds]
    moon = [MOON_KM + s * np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]) for s in seconds]
    spiceypy.kclear()
    try:
        spiceypy.furnsh(str(folder / "a.tls"))
        et = [ephemeris_time(EPOCH + round(s * SECOND)) for s in seconds]
        turn = np.radians(38.0 + 13.17 * ephemeris_time(when) / 86400.0)
        handle, ends = spiceypy.spkopn(str(folder / "moon.bsp"), "test", 0), (et[0], et[-1])
        spiceypy.spkw13(handle, -998, 301, "J2000", *ends, "lunar", 7, len(et), np.array(about), et)
        spiceypy.spkw09(handle, 301, 399, "J2000", *ends, "moon", 1, len(et), np.array(moon), et)
        spiceypy.spkcls(handle)
    finally:
        spiceypy.kclear()
    (folder / "moon.tm").write_text(META.format("'a.tls' 'moon.bsp' 'moon.tpc'"))
    path = read_spice_path(source(folder, name="moon.tm"), -998, 1.0)
    r, v = path.state(when)
    r_about, v_about = ORBIT.state(when)
    np.testing.assert_allclose(r, np.add(r_about, (384e6, 123.4e3, 0.0)), atol=1e-3)
    np.testing.assert_allclose(v, np.add(v_about, (0.0, 1e3, 0.0)), atol=1e-5)
    # Axes that a PCK defines, by the time since J2000.
    rotations = read_spice_rotations(source(folder, name="moon.tm"), "IAU_MOON")
    x = rotations.matrix(when) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(x, [np.cos(turn), np.sin(turn), 0.0], atol=1e-7)


@pytest.mark.parametrize("place", [DE421[0], DE421[-1]], ids=lambda p: p.utc)
def test_sun_and_moon_stand_where_simgl_has_them(folder: Path, place: Places) -> None:
    """Through SPICE's time scale and axes: 0.01 and 10 arcsec, what simgl states of its own."""
    when = tai_ns_from_utc(place.utc)
    sky = SpiceSource(path=folder / "sky.tm", epoch_tai_ns=when, span_s=(-50.0, 50.0))
    for body, law, arcsec in ((10, sun_position, 0.01), (301, moon_position, 10.0)):
        r, _ = read_spice_path(sky, body, 1e3).state(when)
        assert np.degrees(angle_between(r, law(when))) * 3600.0 < arcsec


def test_a_gap_is_one_line(folder: Path) -> None:
    path = read_spice_path(source(folder, (0.0, 5000.0)), BODY, 1.0)
    assert len(path.segments) == 2
    with pytest.raises(ConfigError, match=r"mission.tm: naif_id -999: has a gap between its seg"):
        path.state(EPOCH + 3300 * SECOND)
    rotations = read_spice_rotations(source(folder, (0.0, 5000.0)), "TEST_BODY")
    with pytest.raises(ConfigError, match=r'mission.tm: frame "TEST_BODY": has a gap from 2026-'):
        rotations.matrix(EPOCH + 3300 * SECOND)


META_OF = {
    "no_orbit.tm": "'a.tls' 'a.tsc' 'a.tf' 'a.bc'",
    "no_clock.tm": "'a.tf' 'a.bsp'",
    "no_file.tm": "'a.tls' 'lost.bsp'",
    "no_frames.tm": "'a.tls' 'a.bsp' 'a.bc'",
    "no_attitude.tm": "'a.tls' 'a.tsc' 'a.tf' 'a.bsp'",
}


@pytest.mark.parametrize(
    ("name", "body", "frame", "complaint"),
    [
        ("mission.tm", -5, None, ": holds no states of naif_id -5; allowed: -999"),
        ("no_orbit.tm", -999, None, ": holds no states of naif_id -999; allowed: no SPK is "),
        ("no_clock.tm", -999, None, ": names no leap-second kernel (LSK), which times need"),
        ("no_file.tm", -999, None, ": cannot be loaded: SPICE(NOSUCHFILE): "),
        ("mission.tm", 0, "LOST", ': knows no frame "LOST"; a frame kernel (FK) or a PCK must'),
        ("no_frames.tm", 0, "TEST_BODY", ': knows no frame "TEST_BODY"; a frame kernel'),
        ("no_attitude.tm", 0, "TEST_BODY", ': holds no attitudes of frame "TEST_BODY" (CK -9'),
        ("no_attitude.tm", 0, "TEST_CAMERA", ': gives nothing at 2026-03-20T12:00:00 for frame "T'),
    ],
)  # fmt: skip
def test_what_is_missing_is_one_line(
    folder: Path, name: str, body: int, frame: str | None, complaint: str
) -> None:
    if name in META_OF:
        (folder / name).write_text(META.format(META_OF[name]))
    where = source(folder, name=name)
    with pytest.raises(ConfigError, match=re.escape(f"{folder / name}{complaint}")) as caught:
        read_spice_rotations(where, frame) if frame else read_spice_path(where, body, 1.0)
    assert "\n" not in str(caught.value)


def test_a_time_outside_is_one_line(folder: Path) -> None:
    with pytest.raises(ConfigError, match=r"covers naif_id -999 from .* not in span_s, 2026"):
        read_spice_path(source(folder, (7000.0, 8000.0)), BODY, 1.0)


def test_the_pool_of_a_program_that_uses_spice_itself_is_left_alone(folder: Path) -> None:
    spiceypy.kclear()
    try:
        spiceypy.furnsh(str(folder / "a.tls"))
        read_spice_path(source(folder), BODY, 1.0)
        assert spiceypy.ktotal("ALL") == 1
    finally:
        spiceypy.kclear()


SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[spacecraft.target]
model.sphere = { radius_m = 1.0, material = "white_paint" }
trajectory = { file = "mission.tm", naif_id = -999, span_s = [0.0, 300.0] }
attitude_file = { file = "mission.tm", frame = "TEST_BODY", span_s = [0.0, 300.0] }
"""


def scene(folder: Path, text: str = SCENE) -> Path:
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_a_spacecraft_follows_its_kernels(folder: Path) -> None:
    when = EPOCH + 100 * SECOND
    target = load_scenario(scene(folder)).poses(when)["target"]
    np.testing.assert_allclose(target.position, ORBIT.state(when)[0], atol=1e-3)
    turn = 100.0 * RATE
    np.testing.assert_allclose(
        target.R_icrf_from_body[:2, 0], [np.cos(turn), np.sin(turn)], atol=1e-7
    )


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("naif_id = -999, ", "", "trajectory.span_s requires naif_id"),
        ("naif_id = -999, span_s = [0.0, 300.0]", "object = 'a'",
         "is a SPICE kernel; give a meta-kernel"),
        ('file = "mission.tm", naif', 'file = "a.tf", naif', "a.tf: is not a SPICE meta-kernel"),
        ('file = "mission.tm", naif', 'file = "a.bsp", naif', "a.bsp: is one SPICE kernel; "),
        ("naif_id", "frame = 'x', naif_id", "trajectory.frame is allowed only in attitude_file"),
        ("naif_id", "object = 'x', naif_id",
         "trajectory.object is allowed only for files of several objects; SPICE has naif_id and"),
        ("span_s = [0.0, 300.0]", "span_s = [3.0, 3.0]", "trajectory.span_s must begin before"),
        ('frame = "TEST_BODY"', "naif_id = -999",
         "attitude_file.naif_id is allowed only in trajectory"),
    ],
)  # fmt: skip
def test_contradictions_are_one_line(folder: Path, old: str, new: str, complaint: str) -> None:
    assert old in SCENE
    with pytest.raises(ConfigError, match=re.escape(complaint)):
        load_scenario(scene(folder, SCENE.replace(old, new, 1)))


def test_without_the_extra_one_line_says_how_to_get_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "spiceypy", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(ConfigError, match=re.escape('pip install "simgl[spice]"')):
        read_spice_path(source(folder), BODY, 1.0)


def test_simgl_does_not_import_it() -> None:
    program = "import sys, simgl, simgl.cli; sys.exit('spiceypy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_curve_that_samples_cannot_hold_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The nodes round to micrometres: no curve through them is good to 1e-12 m."""
    monkeypatch.setattr("simgl.motion.files.spice._MIN_STEP_NS", 40 * SECOND)
    with pytest.raises(ConfigError, match="moves naif_id -999 too unevenly for samples 60 s apart"):
        read_spice_path(source(folder), BODY, 1e-12)


def test_the_path_is_plain_samples(folder: Path) -> None:
    """So that workers and caches need no kernels."""
    assert isinstance(read_spice_path(source(folder), BODY, 1.0), SampledPath)
