"""``docs/protocol.md``, made from the message types: ``python -m tools.protocol_page > FILE``."""

from __future__ import annotations

import ast
import inspect
import re
import types
import typing
from collections.abc import Iterator
from pathlib import Path

import msgspec
from simgl_bridge import (
    client_call,
    client_sessions,
    framing,
    hashes,
    message_parts,
    messages,
    render_queue,
    renderer_link,
    router_socket,
    session_recording,
)

_INTRODUCTION = Path(__file__).with_name("protocol.md")
# Types without a message tag, after the messages that hold them.
_PARTS = (
    message_parts.ServerStatus,
    message_parts.CameraDescription,
    message_parts.SentPose,
    message_parts.SentSun,
    message_parts.Shot,
    message_parts.CameraImage,
    message_parts.Plane,
)
_NAMES = {int: "int", float: "float", str: "str", bool: "bool", type(None): "nil"}
_LISTS = {
    message_parts.Vector: "3 floats",
    message_parts.Quaternion: "4 floats",
    message_parts.Matrix: "3 x 3 floats",
}
_ENTRY = re.compile(r"^([a-z][\w, ]*?) : (.*)$")


def page() -> str:
    """The full page: the text of ``protocol.md`` in this folder, then the generated reference."""
    text = _INTRODUCTION.read_text(encoding="utf-8")
    for name, value in {
        "WINDOW": render_queue.WINDOW,
        "LARGEST_HEADER": framing.LARGEST_HEADER,
        "LARGEST_FRAME": router_socket.LARGEST_FRAME,
        "MAX_WAITING": router_socket.MAX_WAITING,
        "OWNER_SILENCE": f"{client_sessions.OWNER_SILENCE:g}",
        "SILENCE": f"{client_call.SILENCE:g}",
        "READY_TIMEOUT": f"{client_call.READY_TIMEOUT:g}",
        "LONGEST_DRAW": f"{renderer_link.LONGEST_DRAW:g}",
        "MAX_EARLY_DEATHS": renderer_link.MAX_EARLY_DEATHS,
    }.items():
        text = text.replace(f"@{name}@", str(value))
    return text + "\n" + "\n".join(_reference())


def _reference() -> Iterator[str]:
    yield "## Messages from client to server\n"
    for kind in messages.REQUESTS:
        yield from _struct(kind, f"`{kind.__struct_config__.tag}`")
    yield "## Messages from server to client\n"
    for kind in messages.REPLIES:
        if kind is not messages.Bye:
            yield from _struct(kind, f"`{kind.__struct_config__.tag}`")
    yield "`bye`: as from the client, with the server's `boot`.\n"
    yield "## Parts of messages\n"
    for part in _PARTS:
        yield from _struct(part, part.__name__)
    yield "## Records of a session\n"
    for record in session_recording.RECORDS:
        yield from _struct(record, f"`{record.__struct_config__.tag}`")
    yield "## State hash\n"
    yield f"{_read(inspect.getdoc(hashes.state_hash) or '')[0]}\n"
    yield "## Error codes\n"
    yield "| code | meaning |"
    yield "|---|---|"
    for code, meaning in _codes():
        yield f"| `{code}` | {meaning} |"
    yield ""


def _struct(kind: type[msgspec.Struct], title: str) -> Iterator[str]:
    summary, entries = _read(inspect.getdoc(kind) or "")
    yield f"### {title}\n"
    yield f"{summary}\n"
    fields = msgspec.structs.fields(kind)
    if not fields:
        return
    yield "| field | type | default | |"
    yield "|---|---|---|---|"
    for field in fields:
        default = "required" if field.required else _shown(field)
        about = entries.get(field.name, "")
        yield f"| `{field.name}` | {_type(field.type)} | {default} | {about} |"
    yield ""


def _read(docstring: str) -> tuple[str, dict[str, str]]:
    """The prose of a docstring, and the description of each field."""
    prose: list[str] = []
    entries: dict[str, str] = {}
    names: list[str] = []
    for line in docstring.splitlines():
        if match := _ENTRY.match(line):
            names = [name.strip() for name in match[1].split(",")]
            entries |= dict.fromkeys(names, match[2])
        elif names and line.startswith("    "):
            entries |= {name: f"{entries[name]} {line.strip()}" for name in names}
        else:
            names = []
            prose.append(line.strip())
    text = " ".join(prose).replace("``", "`").strip()
    return re.sub(r"\s+", " ", text), {k: v.replace("``", "`") for k, v in entries.items()}


def _type(kind: typing.Any) -> str:
    """A type in terms of any language, with the range of its values."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return f"{_type(arguments[0])} {arguments[1]}"
    if kind in _LISTS:
        return _LISTS[kind]
    if kind in _NAMES:
        return _NAMES[kind]
    if origin in (typing.Union, types.UnionType):
        return ", or ".join(_type(a) for a in arguments)
    if origin is dict:
        return f"map of {_type(arguments[0])} to {_type(arguments[1])}"
    if origin is tuple and arguments[-1] is Ellipsis:
        return f"list of {_type(arguments[0])}"
    if origin is tuple:
        return f"{len(arguments)} {_type(arguments[0])}s"
    return str(kind.__name__)


def _shown(field: msgspec.structs.FieldInfo) -> str:
    if field.default_factory is not msgspec.NODEFAULT:
        return "empty"
    value = field.default
    if value in ((), "", {}):
        return "empty"
    if value is None:
        return "nil"
    return "`" + str(list(value) if isinstance(value, tuple) else value).replace("'", '"') + "`"


def _codes() -> Iterator[tuple[str, str]]:
    """Error codes with the docstring of each."""
    (tree,) = ast.parse(inspect.getsource(messages.ErrorCode)).body
    assert isinstance(tree, ast.ClassDef)
    for item, after in zip(tree.body, tree.body[1:], strict=False):
        if isinstance(item, ast.Assign) and isinstance(after, ast.Expr):
            name, text = item.targets[0], after.value
            assert isinstance(name, ast.Name)
            assert isinstance(text, ast.Constant)
            yield name.id, str(text.value).replace("``", "`")


if __name__ == "__main__":
    print(page(), end="")
