"""``simgl view`` in a process that also tells what its window says: a line of JSON for each read.

python -m tests.viewer.window_program SCENARIO [--shaders FOLDER] | --follow ADDRESS
"""

from __future__ import annotations

import argparse
import json
import queue
import sys
import threading
from contextlib import ExitStack
from pathlib import Path

import glfw
from simgl_bridge.preview import PreviewClient

from simgl import assets
from simgl.viewer.window import opened, opened_on_server
from simgl.viewer.window_session import WindowSession

_asked: queue.SimpleQueue[str] = queue.SimpleQueue()


_step = WindowSession._step


def _answering_step(session: WindowSession, now: float) -> None:
    """A step of the window's loop, after which it answers."""
    _step(session, now)
    while not _asked.empty():
        _asked.get()
        said = {
            "message": session.message,
            "size": session._size,
            "error": session._subject.error,
            "number": session._subject.number,
            "boxes": session._painter.written,
        }
        print("said " + json.dumps(said), flush=True)


def _listen() -> None:
    for line in sys.stdin:
        _asked.put(line)
        glfw.post_empty_event()


def main() -> None:
    """The process."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("scenario", type=Path, nargs="?")
    arguments.add_argument("--follow")
    arguments.add_argument("--shaders", type=Path)
    given = arguments.parse_args()
    if given.shaders is not None:
        assets.shaders = lambda: given.shaders
    WindowSession._step = _answering_step  # type: ignore[method-assign, assignment]
    with ExitStack() as stack:
        if given.follow:
            source = stack.enter_context(PreviewClient(given.follow))
            session = stack.enter_context(opened_on_server(given.follow, source))
        else:
            session = stack.enter_context(opened(given.scenario))
        threading.Thread(target=_listen, daemon=True).start()
        session.run()


if __name__ == "__main__":
    main()
