"""Damages of a file: bytes, lines, numbers, words, objects of JSON, and what is no file at all."""

from __future__ import annotations

import json
import os
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.damaged_files.valid_files import READERS

# What a number is replaced with.
_NUMBERS = (
    *("0", "-1", "-0.0", "1e-320", "1e300", "-1e18", "1e400", "nan", "-inf", "2147483648"),
    *("9223372036854775808", "99999999999999999999999", "65536", "0.1", "true", '""', "[]", "{}"),
    *("[1.0, 2.0]", '"1"', "[[[[[[]]]]]]", "1000001"),
)
_VALUES: tuple[Any, ...] = (
    *(None, True, 0, -1, 1, 255, 65536, 2**31, 2**63, 10**30, 0.5, -1e300, 1e308, 1e-320),
    *("", "a", "x" * 5000, "../../etc/passwd", "\0", "/dev/zero", "data:,", "data:;base64,AAAA"),
    *([], {}, [0] * 5, [[]], {"a": {}}, [1, 0, 0, 1]),
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_]{3,}")

Damage = Callable[[bytes, Random], bytes]


def flipped(content: bytes, dice: Random) -> bytes:
    """Some bytes changed."""
    changed = bytearray(content)
    for _ in range(dice.choice((1, 1, 2, 4, 16))):
        changed[dice.randrange(len(changed))] = dice.choice(
            (0, 1, 127, 128, 255, dice.randrange(256))
        )
    return bytes(changed)


def cut(content: bytes, dice: Random) -> bytes:
    """The end is missing."""
    return content[: dice.randrange(len(content))]


def shifted(content: bytes, dice: Random) -> bytes:
    """A block is missing, doubled, or has zeros in its place."""
    start = dice.randrange(len(content))
    end = min(start + dice.choice((1, 4, 30, 300)), len(content))
    block = dice.choice((b"", 2 * content[start:end], bytes(end - start)))
    return content[:start] + block + content[end:]


def large_counts(content: bytes, dice: Random) -> bytes:
    """Four bytes hold a large or negative number."""
    start = dice.randrange(max(len(content) - 4, 1))
    number = dice.choice((0xFFFFFFFF, 0x7FFFFFFF, 0x80000000, 0x10000000, 100_000))
    order = dice.choice("<>")
    return content[:start] + struct.pack(f"{order}I", number) + content[start + 4 :]


def lines(content: bytes, dice: Random) -> bytes:
    """A line lost, doubled, cut or exchanged."""
    rows = content.split(b"\n")
    here, other = dice.randrange(len(rows)), dice.randrange(len(rows))
    kind = dice.randrange(4)
    if kind == 0:
        del rows[here]
    elif kind == 1:
        rows.insert(other, rows[here])
    elif kind == 2:
        rows[here] = rows[here][: dice.randrange(len(rows[here]) + 1)]
    else:
        rows[here], rows[other] = rows[other], rows[here]
    return b"\n".join(rows)


def _replaced(content: bytes, pattern: re.Pattern[bytes], other: bytes, dice: Random) -> bytes:
    places = list(pattern.finditer(content))
    if not places:
        return content + other
    place = dice.choice(places)
    return content[: place.start()] + other + content[place.end() :]


def numbers(content: bytes, dice: Random) -> bytes:
    """A number of a text is another one, or none."""
    return _replaced(content, _NUMBER, dice.choice(_NUMBERS).encode(), dice)


def words(content: bytes, dice: Random) -> bytes:
    """A word of a text is another one of it, or nonsense."""
    other = dice.choice(
        [*_WORD.findall(content), b"", b"x" * 3000, b"\xff\xfe", b"a\nb", b"\x1b[2J"]
    )
    return _replaced(content, _WORD, other, dice)


def nested(content: bytes, dice: Random) -> bytes:
    """A value of a text is a list of lists of lists, thousands deep."""
    depth = dice.choice((40, 500, 5000, 100_000))
    left, right = dice.choice(((b"[", b"]"), (b'{"a":', b"0}"), (b"{a=", b"0}")))
    return _replaced(content, _NUMBER, left * depth + right * depth, dice)


def _places(value: Any, entries_of: list[tuple[Any, Any]]) -> None:
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in list(entries):
        entries_of.append((value, key))
        if isinstance(inner, dict | list):
            _places(inner, entries_of)


def objects(document: Any, dice: Random) -> Any:
    """A JSON document with values changed, doubled or removed."""
    document = json.loads(json.dumps(document))
    for _ in range(dice.choice((1, 1, 2, 3))):
        entries_of: list[tuple[Any, Any]] = []
        _places(document, entries_of)
        holder, key = dice.choice(entries_of)
        kind = dice.randrange(6)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, list):
            holder.extend([holder[key]] * dice.choice((1, 100)))
        elif kind == 2 and isinstance(holder[key], int | float):
            holder[key] = dice.choice((holder[key] + 1, -holder[key], 7 * holder[key]))
        else:
            holder[key] = dice.choice(_VALUES)
    return document


def json_values(content: bytes, dice: Random) -> bytes:
    """A .gltf file with other values."""
    return json.dumps(objects(json.loads(content), dice)).encode()


def glb_values(content: bytes, dice: Random) -> bytes:
    """A .glb file with other values in its JSON, and right lengths."""
    (length,) = struct.unpack_from("<I", content, 12)
    text = json_values(content[20 : 20 + length], dice)
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + content[20 + length :]
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def glb_graph(content: bytes, dice: Random) -> bytes:
    """Nodes that hold each other often, in a circle, or in a long chain."""
    (length,) = struct.unpack_from("<I", content, 12)
    document = json.loads(content[20 : 20 + length])
    nodes = document["nodes"]
    depth = dice.choice((2, 15, 40, 300, 20_000))
    breadth = dice.choice((1, 2, 2, 50)) if depth <= 300 else 1
    first = len(nodes)
    nodes += [{"children": [first + i + 1] * breadth} for i in range(depth)]
    nodes.append(dice.choice(({"mesh": 0}, {}, {"children": [first]}, {"children": [0]})))
    nodes[1]["children"] = [first]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + content[20 + length :]
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def png_head(content: bytes, dice: Random) -> bytes:
    """A PNG file whose head promises another size or kind of pixel, with a right checksum."""
    head = bytearray(content[12:29])
    if dice.randrange(3):
        size = dice.choice((0, 1, 3, 16, 512, 8192, 16384, 100_000, 2**31 - 1))
        struct.pack_into(">I", head, dice.choice((4, 8)), size)
        if dice.randrange(2):
            struct.pack_into(">II", head, 4, 2 * size & 0x7FFFFFFF, size)
    else:
        head[dice.choice((12, 13, 14, 15, 16))] = dice.choice((0, 1, 2, 3, 4, 6, 8, 16, 255))
    checksum = struct.pack(">I", zlib.crc32(head))
    return content[:12] + bytes(head) + checksum + content[33:]


def empty(_content: bytes, _dice: Random) -> bytes:
    """No byte at all."""
    return b""


def noise(_content: bytes, dice: Random) -> bytes:
    """Any bytes."""
    return dice.randbytes(dice.choice((1, 100, 5000)))


_ANY: tuple[Damage, ...] = (flipped, flipped, cut, shifted, large_counts, empty, noise)
_TEXT: tuple[Damage, ...] = (*_ANY, lines, lines, numbers, numbers, numbers, words, words, nested)
_BY_ENDING: dict[str, tuple[Damage, ...]] = {
    ".glb": (*_ANY, *5 * (glb_values,), glb_graph, glb_graph, nested),
    ".gltf": (*_TEXT, *7 * (json_values,)),
    ".png": (*_ANY, png_head, png_head, png_head),
    ".bin": _ANY,
    ".npz": _ANY,
}


def damaged(name: str, content: bytes, dice: Random) -> tuple[str, bytes]:
    """The kind of damage, and the damaged content of a file; the name says what it holds."""
    ending = os.path.splitext(name)[1]
    kinds = _BY_ENDING.get(ending, _TEXT)
    if name == "part.stl":
        kinds = _ANY
    damage = dice.choice(kinds)
    return damage.__name__, damage(content, dice)


def damage_one(number: int, seed: int, folder: Path) -> tuple[str, str]:
    """Damage one file in a folder of valid ones, the same for the same numbers.

    returns : its name, and a description for whoever wants to repeat it
    """
    name = list(READERS)[number % len(READERS)]
    path = folder / name
    kind, content = damaged(name, path.read_bytes(), Random(f"{seed} {number}"))
    path.write_bytes(content)
    return name, f"case {number} of seed {seed}: {name} {kind}"
