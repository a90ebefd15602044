"""Motion files of any format, which is detected by content."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import IndexArray
from simgl.errors import ConfigError, did_you_mean
from simgl.motion.files import aem, ccsds_states, oem, stk
from simgl.motion.files.ccsds_kvn import Segment, segments, single_state
from simgl.motion.files.ccsds_xml import read_messages
from simgl.motion.files.csv_table import Table
from simgl.motion.files.motion_record import AttitudeRecord, StateRecord, attitude_in_icrf, in_icrf
from simgl.motion.files.text_lines import Line, lines_of, shown, text_of
from simgl.motion.files.tle import read_tle
from simgl.motion.orbits import KeplerianOrbit, TwoLineElements
from simgl.motion.samples import Path as SampledPath
from simgl.motion.samples import SampledAngles, SampledRotations, SampledStates, default_gap_ns
from simgl.motion.trajectory import FixedAttitude, LvlhAttitude, SampledAttitude

_KINDS = (
    "a CCSDS OEM, OPM, AEM or APM, an ephemeris or attitude of STK, two-line elements, "
    "or a table (CSV) with a header"
)
_Record = TypeVar("_Record", StateRecord, AttitudeRecord, TwoLineElements, ccsds_states.NamedOrbit)
_VERSION_KEYS = {
    "oem": oem.VERSION_KEY,
    "opm": ccsds_states.OPM_KEY,
    "aem": aem.VERSION_KEY,
    "apm": ccsds_states.APM_KEY,
}
_ORBITS = ("oem", "opm", "stk_ephemeris", "tle")
_ATTITUDES = ("aem", "apm", "stk_attitude")

# Largest interpolation error where none is given [m].
DEFAULT_ALLOWED_ERROR = 1.0
# Largest rotation between two attitude samples: for half a turn the direction would be ambiguous.
_MAX_ROTATION = np.radians(150.0)


def read_path(
    path: Path,
    epoch_tai_ns: int,
    *,
    name: str | None = None,
    longest_gap_s: float | None = None,
    allowed_error: float | None = None,
) -> tuple[SampledPath | TwoLineElements | KeplerianOrbit, bool]:
    """The trajectory of an object, and whether it is in another one's LVLH axes instead of ICRF.

    epoch_tai_ns : origin of a table's times in seconds
    name : of the object, for a file with several
    longest_gap_s : a longer step between samples is a gap; by default five median steps
    allowed_error : largest estimated interpolation error, 1 m if omitted [m]

    Raises ConfigError or AssetError that names file and line.
    """
    lines = lines_of(path, text_of(path))
    kind, ccsds = _contents(lines, path, _ORBITS, "holds attitudes; give it as attitude_file")
    if kind in ("tle", "opm"):
        law = _orbit(path, lines, kind, ccsds, name)
        if longest_gap_s is not None or allowed_error is not None:
            what = "two-line elements, which have" if kind == "tle" else "an OPM, which has"
            key = "interpolation_error_m" if longest_gap_s is None else "longest_gap_s"
            _fail(path, f"is {what} no samples; {key} requires samples")
        return law, False
    if kind == "oem":
        records = _of_name(path, oem.read_oem(ccsds), name)
    else:
        _refuse_object(path, name, kind)
        records = (
            stk.read_ephemeris(lines, path.stem)
            if kind == "stk_ephemeris"
            else [Table(lines, epoch_tai_ns).states(path.stem)]
        )
    in_lvlh = {record.frame == "lvlh" for record in records}
    if len(in_lvlh) > 1:
        _fail(path, "mixes LVLH with other frames")
    segments = tuple(
        SampledStates(
            source=str(path),
            tai_ns=record.tai_ns,
            positions=record.positions,
            velocities=record.velocities,
            longest_gap_ns=_gap_ns(record.tai_ns, longest_gap_s),
            span_ns=record.span_ns,
        )
        for record in sorted(map(in_icrf, records), key=lambda r: r.span_ns[0])
    )
    curve = SampledPath(source=str(path), segments=segments)
    allowed_error = DEFAULT_ALLOWED_ERROR if allowed_error is None else allowed_error
    if curve.interpolation_error > allowed_error:
        _fail(
            path,
            "has samples too far apart: between them a curve may be off by "
            f"{curve.interpolation_error:.3g} m (interpolation_error_m allows {allowed_error:g} m)",
        )
    return curve, in_lvlh.pop()


def _orbit(
    path: Path, lines: list[Line], kind: str, ccsds: list[Segment], name: str | None
) -> TwoLineElements | KeplerianOrbit:
    if kind == "tle":
        return _of_name(path, read_tle(lines), name)[0]
    orbits = _of_name(path, ccsds_states.read_opm(ccsds), name)
    if len(orbits) > 1:
        _fail(path, "holds several states of this object; give one, or an OEM")
    return orbits[0].orbit


def read_attitude(
    path: Path, epoch_tai_ns: int, *, name: str | None = None, longest_gap_s: float | None = None
) -> SampledAttitude | FixedAttitude | LvlhAttitude:
    """The law of attitude of an object: samples, or the one attitude of an APM.

    Arguments and errors as for ``read_path``.
    """
    lines = lines_of(path, text_of(path))
    kind, ccsds = _contents(lines, path, _ATTITUDES, "holds an orbit; give it as trajectory")
    if kind != "apm":
        rotations, in_lvlh = _sampled_rotations(
            path, lines, kind, ccsds, epoch_tai_ns, name, longest_gap_s
        )
        return SampledAttitude(rotations=rotations, in_lvlh=in_lvlh)
    if longest_gap_s is not None:
        _fail(path, "is an APM, which has no samples; longest_gap_s requires samples")
    records = _of_name(path, ccsds_states.read_apm(ccsds), name)
    if len(records) > 1:
        _fail(path, "holds several attitudes of this object; give one, or an AEM")
    R = Rotation.from_quat(records[0].q_frame_from_body_xyzw[0]).as_matrix()
    if records[0].frame == "lvlh":
        return LvlhAttitude(R_lvlh_from_body=R)
    return FixedAttitude(R_icrf_from_body=R)


def _sampled_rotations(
    path: Path,
    lines: list[Line],
    kind: str,
    ccsds: list[Segment],
    epoch_tai_ns: int,
    name: str | None,
    longest_gap_s: float | None,
) -> tuple[SampledRotations, bool]:
    if kind == "aem":
        records = _of_name(path, aem.read_aem(ccsds), name)
        if len(records) > 1:
            _fail(path, "holds several segments of this object; join them")
        record = records[0]
    else:
        _refuse_object(path, name, kind)
        record = (
            stk.read_attitude(lines, path.stem)
            if kind == "stk_attitude"
            else Table(lines, epoch_tai_ns).attitudes(path.stem)
        )
    turned = attitude_in_icrf(record)
    rotations = SampledRotations(
        source=str(path),
        tai_ns=turned.tai_ns,
        q_reference_from_body_xyzw=turned.q_frame_from_body_xyzw,
        longest_gap_ns=_gap_ns(turned.tai_ns, longest_gap_s),
    )
    rotations.check_turns(_MAX_ROTATION)
    return rotations, record.frame == "lvlh"


def read_angles(
    path: Path, epoch_tai_ns: int, *, longest_gap_s: float | None = None
) -> SampledAngles:
    """The joint values of an object, from a table.

    Arguments and errors as for ``read_path``.
    """
    lines = lines_of(path, text_of(path))
    if _kind(lines, path) != "table":
        _fail(path, "is not a table of joint angles (CSV) with a header")
    table = Table(lines, epoch_tai_ns)
    names, angles, slides = table.joint_angles()
    return SampledAngles(
        source=str(path),
        tai_ns=table.tai_ns,
        names=names,
        angles=angles,
        slides=slides,
        longest_gap_ns=_gap_ns(table.tai_ns, longest_gap_s),
    )


def _fail(path: Path, problem: str) -> NoReturn:
    raise ConfigError(str(path), "", problem)


def _refuse_object(path: Path, name: str | None, kind: str) -> None:
    """Raise ConfigError where an object is named of a file that holds one without a name."""
    if name is not None:
        what = "a table" if kind == "table" else "an STK file"
        _fail(path, f"is {what} of one object; object = {shown(name)} requires CCSDS or TLE")


def _gap_ns(tai_ns: IndexArray, longest_gap_s: float | None) -> int:
    return default_gap_ns(tai_ns) if longest_gap_s is None else round(longest_gap_s * 1e9)


def _contents(
    lines: list[Line], path: Path, kinds: tuple[str, ...], otherwise: str
) -> tuple[str, list[Segment]]:
    """What the file holds of these kinds, or "table"; and the segments of a CCSDS message.

    Raises ConfigError with ``otherwise`` for a file of other kinds.
    """
    kind = _kind(lines, path)
    if kind == "xml":
        messages = read_messages(lines)
        of_kinds = [kind for kind in kinds if kind in messages]
        if not of_kinds:
            _fail(path, otherwise)
        return of_kinds[0], messages[of_kinds[0]]
    if kind not in (*kinds, "table"):
        _fail(path, otherwise)
    if kind in _VERSION_KEYS:
        is_single = kind in ("opm", "apm")
        return kind, single_state(lines) if is_single else segments(lines, _VERSION_KEYS[kind])
    return kind, []


def _kind(lines: list[Line], path: Path) -> str:
    first = next((line for line in lines if line.text.strip()), None)
    if first is None:
        _fail(path, f"is empty; it must be {_KINDS}")
    text = first.text.strip()
    for kind, version_key in _VERSION_KEYS.items():
        if text.startswith(version_key):
            return kind
    if text.startswith("<"):
        return "xml"
    if text.startswith("KPL/"):
        _fail(path, "is a SPICE kernel; give a meta-kernel and naif_id, or frame for an attitude")
    if text.lower().startswith(stk.VERSION_KEY):
        return stk.kind_of(lines)
    body = [line.text for line in lines if line.text.strip()]
    if any(one.startswith("1 ") for one in body[:2]):
        return "tle"
    head = next((one for one in body if not one.startswith("#")), "")
    if "," in head:
        return "table"
    for mark, marks in ((";", "semicolons"), ("\t", "tabs")):
        if mark in head:
            problem = f"has {marks} between its columns; a table needs commas, and decimal points"
            raise ConfigError(first.where, "", problem)
    raise ConfigError(first.where, "", f"is not the start of {_KINDS}, got {shown(text)}")


def _of_name(path: Path, records: list[_Record], name: str | None) -> list[_Record]:
    names = list(dict.fromkeys(record.name for record in records))
    if name is None:
        if len(names) > 1:
            _fail(path, f"holds several objects; name one by object ({', '.join(names)})")
        return records
    if name not in names:
        _fail(path, f"has no object {shown(name)}; {did_you_mean(name, names)}")
    return [record for record in records if record.name == name]
