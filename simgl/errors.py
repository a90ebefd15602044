"""The exceptions of simgl, one tree.

SimglError
    ConfigError      a scenario, camera file, option or message holds an impossible value
    AssetError       a model, mesh, map or preset is missing or unreadable
    OutputError      a result cannot be written
    ContextError     no usable OpenGL context
    ShaderError      a shader does not assemble, compile or match its Python side
    BridgeError      the link to a client or server failed

Each message is one line that names the place, the given value and what is allowed.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

# Names in one line of an error; no table has as many keys.
_MAX_LISTED = 100
_LONGEST = 4000


class SimglError(Exception):
    """Base of all exceptions of simgl."""

    def __str__(self) -> str:
        """The message on one line, whatever the values and names of a file hold."""
        text = super().__str__()
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 2 :]}"
        return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class ConfigError(SimglError):
    """An impossible value in a file, option or message.

    where : the file, table or message, e.g. ``approach.toml [camera.navcam]``
    key : the key inside it
    problem : what is wrong, with the given value and what is allowed
    """

    def __init__(self, where: str, key: str, problem: str) -> None:
        self.where = where
        self.key = key
        self.problem = problem
        super().__init__(f"{where}: {key} {problem}" if key else f"{where}: {problem}")


class AssetError(SimglError):
    """A file that simgl reads is missing or unreadable."""


class OutputError(SimglError):
    """A result cannot be written."""


class ContextError(SimglError):
    """No usable OpenGL context.

    reason : why not
    remedy : what to do, such as the command that installs what is missing
    """

    def __init__(self, reason: str, remedy: str) -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(f"{reason}; {remedy}")


class ShaderError(SimglError):
    """A shader does not assemble, compile or match its Python side."""

    def __str__(self) -> str:
        """The message with the lines of the driver's log."""
        return Exception.__str__(self)


class BridgeError(SimglError):
    """The link between a client and a server failed."""


def did_you_mean(given: str, allowed: Iterable[str]) -> str:
    """A suggestion for a misspelt name, then all allowed names."""
    names = sorted(allowed)
    close = get_close_matches(given, names, n=1)
    more = [f"and {len(names) - _MAX_LISTED} more"] if len(names) > _MAX_LISTED else []
    listing = ", ".join([*names[:_MAX_LISTED], *more])
    listing = f"allowed: {listing}" if names else "none is allowed here"
    return f'did you mean "{close[0]}"? ({listing})' if close else listing
