"""CCSDS messages in XML say what those in key-value form say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.errors import ConfigError
from simgl.motion.files.motion_reader import read_path
from tests.motion.motion_files import AEM, EPOCH, SECOND, in_xml, oem, sampled_attitude, written

HALF = EPOCH + 615 * SECOND


def test_an_orbit_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    plain, _ = read_path(written(tmp_path, oem(), "plain.oem"), EPOCH)
    marked, in_lvlh = read_path(written(tmp_path, in_xml("oem", oem()), "marked.xml"), EPOCH)
    assert not in_lvlh
    np.testing.assert_array_equal(np.array(marked.state(HALF)), np.array(plain.state(HALF)))


def test_an_attitude_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    when = EPOCH + 45 * SECOND
    plain = sampled_attitude(written(tmp_path, AEM, "plain.aem")).rotations
    marked = sampled_attitude(written(tmp_path, in_xml("aem", AEM), "marked.xml")).rotations
    np.testing.assert_array_equal(marked.matrix(when), plain.matrix(when))


def test_values_have_names_so_that_their_order_makes_no_difference(tmp_path: Path) -> None:
    when = EPOCH + 45 * SECOND
    text = in_xml("aem", AEM)
    first = text.replace("<Q1>0.0</Q1><Q2>0.0</Q2>", "<Q2>0.0</Q2><Q1>0.0</Q1>")
    assert first != text
    first = first.replace("<QUATERNION_TYPE>LAST", "<QUATERNION_TYPE>FIRST")
    expected = sampled_attitude(written(tmp_path, text, "a.xml")).rotations.matrix(when)
    got = sampled_attitude(written(tmp_path, first, "b.xml")).rotations.matrix(when)
    np.testing.assert_array_equal(got, expected)


ANGLES = """\
<aem version="1.0"><header/><body><segment><metadata>
<OBJECT_NAME>TARGET</OBJECT_NAME><REF_FRAME_A>ICRF</REF_FRAME_A>
<REF_FRAME_B>SC_BODY_1</REF_FRAME_B><ATTITUDE_DIR>A2B</ATTITUDE_DIR>
<TIME_SYSTEM>UTC</TIME_SYSTEM><ATTITUDE_TYPE>{kind}</ATTITUDE_TYPE>
<EULER_ROT_SEQ>321</EULER_ROT_SEQ></metadata><data><attitudeState><eulerAngle>
<EPOCH>2026-03-20T12:00:00</EPOCH>{angles}</eulerAngle></attitudeState></data></segment></body></aem>
"""
VERSION_2 = "<ANGLE_1>90</ANGLE_1><ANGLE_2>90</ANGLE_2><ANGLE_3>0</ANGLE_3>"
VERSION_1 = (
    '<rotationAngles><rotation1 angle="Z_ANGLE" units="deg">90</rotation1>'
    '<rotation2 angle="Y_ANGLE" units="deg">90</rotation2>'
    '<rotation3 angle="X_ANGLE" units="deg">0</rotation3></rotationAngles>'
)
RATES = '<rotationRates><rotation1 rate="Z_RATE">4.5</rotation1></rotationRates>'


@pytest.mark.parametrize(
    ("kind", "angles"),
    [
        ("EULER_ANGLE", VERSION_2),
        ("EULER_ANGLE", VERSION_1),
        ("EULER_ANGLE/RATE", VERSION_1 + RATES),
    ],
)
def test_angles_of_both_versions(tmp_path: Path, kind: str, angles: str) -> None:
    """321 by 90, 90, 0: yaw takes x to y, then pitch about the new y takes x down to -z."""
    file = written(tmp_path, ANGLES.format(kind=kind, angles=angles))
    R = sampled_attitude(file).rotations.matrix(EPOCH)
    np.testing.assert_allclose(R @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(R @ [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], atol=1e-12)


def body(text: str) -> str:
    return text.partition("?>")[2]


def test_a_combined_message_serves_both_keys(tmp_path: Path) -> None:
    parts = body(in_xml("oem", oem())) + body(in_xml("aem", AEM))
    file = written(tmp_path, f"<ndm><COMMENT>both</COMMENT>{parts}</ndm>")
    assert np.all(np.isfinite(read_path(file, EPOCH)[0].state(HALF)[0]))
    assert sampled_attitude(file).rotations.matrix(EPOCH).shape == (3, 3)


def test_a_message_of_another_kind_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"line 1: <omm> is not a message that is read here; did"):
        read_path(written(tmp_path, "<omm></omm>"), EPOCH)
    with pytest.raises(ConfigError, match="holds attitudes; give it as attitude_file"):
        read_path(written(tmp_path, in_xml("aem", AEM)), EPOCH)


def test_a_message_that_would_grow_without_bound_is_refused(tmp_path: Path) -> None:
    """Entities that hold entities, and elements in elements."""
    entities = '<!DOCTYPE a [<!ENTITY b "cc"><!ENTITY c "&b;&b;">]><oem>&c;</oem>'
    with pytest.raises(ConfigError, match="<!DOCTYPE> is not allowed"):
        read_path(written(tmp_path, entities), EPOCH)
    with pytest.raises(ConfigError, match="lies in more than 20 elements"):
        read_path(written(tmp_path, "<oem>" + "<a>" * 100_000), EPOCH)
