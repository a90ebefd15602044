"""CCSDS messages in XML (505.0-B): the same segments as in key-value form.

The lines of a segment's data are made of the named values, in the order of the key-value form, so
that both forms share their readers. A combined message (``ndm``) gives the segments of all parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from simgl.errors import ConfigError, did_you_mean
from simgl.motion.files.ccsds_kvn import Segment
from simgl.motion.files.text_lines import Line, shown

MESSAGES = ("oem", "opm", "aem", "apm")
# Elements inside one another, of which the standard needs nine.
_MAX_DEPTH = 20
# What one record of data is, and the units that its values have by the standard.
_RECORDS = {"oem": "stateVector", "aem": "attitudeState"}
_UNITS = {
    **dict.fromkeys(("X", "Y", "Z"), "km"),
    **dict.fromkeys(("X_DOT", "Y_DOT", "Z_DOT"), "km/s"),
    **dict.fromkeys(("ANGLE_1", "ANGLE_2", "ANGLE_3"), "deg"),
}
_STATE_KEYS = ("EPOCH", "X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
_ANGLE_KEYS = ("EPOCH", "ANGLE_1", "ANGLE_2", "ANGLE_3")
# Elements of a single state that are blocks of their own in key-value form.
_BLOCKS = {
    "quaternionState": "QUAT",
    "eulerAngleState": "EULER",
    "eulerElementsThree": "EULER",
    "eulerElementsSpin": "SPIN",
    "spin": "SPIN",
    "angularVelocity": "ANGVEL",
    "inertia": "INERTIA",
    "spacecraftParameters": "INERTIA",
    "covarianceMatrix": "COV",
    "userDefinedParameters": "USER",
    "maneuverParameters": "MAN",
}


@dataclass(frozen=True)
class _Element:
    """An element of the file, where it begins."""

    name: str
    line: Line
    unit: str | None
    children: list[_Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(self.pieces).strip()

    def all_named(self, name: str) -> list[_Element]:
        return [child for child in self.children if child.name == name]

    def only(self, name: str) -> _Element:
        """The child of this name; ConfigError with the line unless there is one."""
        named = self.all_named(name)
        if len(named) != 1:
            self.line.fail(f"<{self.name}>", f"must hold one <{name}>, got {len(named)}")
        return named[0]


def read_messages(lines: list[Line]) -> dict[str, list[Segment]]:
    """Segments of each kind of message in the file; ConfigError with the line for others."""
    root = _parsed(lines)
    messages = root.children if root.name == "ndm" else [root]
    result: dict[str, list[Segment]] = {}
    for message in messages:
        if message.name in ("COMMENT", "MESSAGE_ID"):
            continue
        if message.name not in MESSAGES:
            allowed = MESSAGES if message is not root else (*MESSAGES, "ndm")
            problem = f"is not a message that is read here; {did_you_mean(message.name, allowed)}"
            message.line.fail(f"<{message.name}>", problem)
        of_kind = result.setdefault(message.name, [])
        for segment in message.only("body").all_named("segment"):
            of_kind.append(_segment(segment, message.name))
        if not of_kind:
            message.line.fail(f"<{message.name}>", "holds no <segment>")
    if not result:
        root.line.fail(f"<{root.name}>", f"holds no message ({', '.join(MESSAGES)})")
    return result


def _parsed(lines: list[Line]) -> _Element:
    parser = expat.ParserCreate()
    path = lines[0].path
    stack: list[_Element] = []
    roots: list[_Element] = []

    def here() -> Line:
        number = parser.CurrentLineNumber
        return lines[min(number, len(lines)) - 1]

    def start(tag: str, attributes: dict[str, str]) -> None:
        # A prefix only tells the schema; the names are the same without.
        element = _Element(tag.rpartition(":")[2], here(), attributes.get("units"))
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)
        if len(stack) > _MAX_DEPTH:
            element.line.fail(f"<{element.name}>", f"lies in more than {_MAX_DEPTH} elements")

    def end(_tag: str) -> None:
        stack.pop()

    def characters(text: str) -> None:
        if stack:
            stack[-1].pieces.append(text)

    def doctype(*_: object) -> None:
        # Entities could grow without bound, or name other files; the standard has none.
        here().fail("<!DOCTYPE>", "is not allowed in a CCSDS message")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = characters, doctype
    try:
        # The text was decoded as UTF-8, whatever the declaration says.
        parser.Parse("\n".join(line.text for line in lines), True)
    except expat.ExpatError as error:
        where = lines[min(error.lineno, len(lines)) - 1].where
        problem = f"is not well-formed XML: {expat.ErrorString(error.code)}"
        raise ConfigError(where, "", problem) from None
    except (ValueError, LookupError) as error:
        raise ConfigError(str(path), "", f"is not XML that can be read: {error}") from None
    return roots[0]


def _segment(segment: _Element, kind: str) -> Segment:
    meta: dict[str, tuple[str, Line]] = {}
    _add(meta, segment.only("metadata").children)
    data = segment.only("data")
    if kind in _RECORDS:
        records = data.all_named(_RECORDS[kind])
        rows = tuple(_row(record, kind, meta) for record in records)
        return Segment(start=segment.line, meta=meta, data=rows)
    blocks: dict[str, Segment] = {}
    for child in data.children:
        if child.name in _BLOCKS:
            inner: dict[str, tuple[str, Line]] = {}
            # Manoeuvres repeat their keys; that there is one is all that counts.
            if child.name not in ("maneuverParameters", "userDefinedParameters"):
                _add(inner, _leaves(child))
            blocks[_BLOCKS[child.name]] = Segment(start=child.line, meta=inner, data=())
        else:
            _add(meta, _leaves(child))
    return Segment(start=segment.line, meta=meta, data=(), blocks=blocks)


def _add(meta: dict[str, tuple[str, Line]], elements: list[_Element]) -> None:
    for element in elements:
        if element.name == "COMMENT":
            continue
        if element.name in meta:
            element.line.fail(element.name, "is given twice in this segment")
        meta[element.name] = _value(element), element.line


def _value(element: _Element) -> str:
    """The text of an element, with the unit that the standard gives it."""
    if not element.text:
        element.line.fail(element.name, "has no value")
    unit = _UNITS.get(element.name)
    if element.unit is not None and unit is not None and element.unit != unit:
        element.line.fail(element.name, f"must be in {unit}, got units {shown(element.unit)}")
    return element.text


def _leaves(element: _Element) -> list[_Element]:
    return list(_named_leaves(element, ""))


def _named_leaves(element: _Element, parent: str) -> Iterator[_Element]:
    if not element.children:
        # Version 1 calls angles and rates by one name, inside elements that tell them apart.
        name = element.name
        if name.startswith("rotation") and parent in ("rotationAngles", "rotationRates"):
            name = f"ANGLE_{name[-1]}" + ("_DOT" if parent == "rotationRates" else "")
        yield _Element(name, element.line, element.unit, [], element.pieces)
    for child in element.children:
        yield from _named_leaves(child, element.name)


def _row(record: _Element, kind: str, meta: dict[str, tuple[str, Line]]) -> Line:
    """A record as a line of the key-value form; rates and accelerations are left out."""
    values: dict[str, tuple[str, Line]] = {}
    _add(values, _leaves(record))
    keys: tuple[str, ...]
    if kind == "oem":
        keys = _STATE_KEYS
    elif "EULER" in meta.get("ATTITUDE_TYPE", ("",))[0].upper():
        keys = _ANGLE_KEYS
    elif meta.get("QUATERNION_TYPE", ("",))[0].upper() == "FIRST":
        keys = ("EPOCH", "QC", "Q1", "Q2", "Q3")
    else:
        keys = ("EPOCH", "Q1", "Q2", "Q3", "QC")
    # A type without these values is refused by its name.
    known = "ATTITUDE_TYPE" not in meta or meta["ATTITUDE_TYPE"][0].upper().startswith(
        ("QUAT", "EULER")
    )
    for key in keys if known else ("EPOCH",):
        if key not in values:
            record.line.fail(key, f"is missing in this <{record.name}>")
    words = [values[key][0].split() for key in keys if key in values]
    return Line(record.line.path, record.line.number, " ".join(w for one in words for w in one))
