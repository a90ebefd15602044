"""A window of its own process, as a person sees it: keys and mouse in, words and pictures out."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from simgl.arrays import Image8
from tests.patience import wait_until
from tests.viewer.x_input import XInput

# The pointer's place when it is of no interest: over the window, which then gets the keys, beside
# every image.
ASIDE = (2, 2)


class OpenedWindow:
    """An open ``simgl view``."""

    def __init__(self, process: subprocess.Popen[str], person: XInput, folder: Path) -> None:
        self._process, self.person, self.folder = process, person, folder
        self.printed: list[str] = []

    def said(self) -> dict[str, Any]:
        """What the window says at this moment."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("?\n")
        self._process.stdin.flush()
        for line in self._process.stdout:
            if line.startswith("said "):
                return dict(json.loads(line[5:]))
            self.printed.append(line.strip())
        raise AssertionError(f"the window ended: {self._process.wait()}")

    def wait_for(self, condition: Callable[[dict[str, Any]], bool], what: str) -> dict[str, Any]:
        """What the window says once it is up to date and a condition holds."""
        last: dict[str, Any] = {}

        def holds() -> bool:
            last.clear()
            last.update(self.said())
            return condition(last)

        try:
            wait_until(holds, what, 10.0)
        except AssertionError as error:
            raise AssertionError(f"{error}; the window says {last}") from None
        return last

    def wait_for_box(self, name: str, lines: list[str]) -> None:
        """Wait until a box has these lines."""
        self.wait_for(lambda said: said["boxes"].get(name) == lines, f"{name}: {lines}")

    def wait_for_pixel(self, name: str) -> None:
        """Wait until the values of a pixel are shown, such as "pixel 3, 4"."""
        self.wait_for(lambda said: said["boxes"].get("pixel", [""])[0] == name, name)

    def press(self, *keys: str, says: str) -> dict[str, Any]:
        """Press keys, and wait until the window says something."""
        self.person.key(*keys)
        return self.wait_for(lambda said: says in said["message"], f"{keys}: {says}")

    def screenshot(self) -> tuple[Image8, str]:
        """The window by its key, and the name that the files have."""
        said = self.press("s", says="saved")
        name = str(said["message"]).split()[1].removesuffix(".png")
        with Image.open(self.folder / f"{name}.png") as image:
            return np.asarray(image), name


@contextmanager
def opened_window(
    display: str, folder: Path, *arguments: str, dots_per_inch: int = 96
) -> Iterator[OpenedWindow]:
    """Opened on a display, with a folder as its working directory; closed by q at the end.

    arguments : of ``window_program``
    """
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("WAYLAND", "XDG_"))}
    root = str(Path(__file__).parents[2])
    environment["PYTHONPATH"] = os.pathsep.join(
        filter(None, [root, os.path.join(root, "bridge"), os.environ.get("PYTHONPATH")])
    )
    person = XInput(display, dots_per_inch)
    person.move(*ASIDE)
    command = [sys.executable, "-W", "error", "-m", "tests.viewer.window_program"]
    with subprocess.Popen(
        [*command, *arguments],
        env={**environment, "DISPLAY": display},
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            window = OpenedWindow(process, person, folder)
            window.wait_for(lambda _: True, "the window")
            yield window
            person.move(*ASIDE)
            person.key("q")
            assert process.stdin is not None
            process.stdin.close()
            assert process.wait(60.0) == 0
        finally:
            process.kill()
            person.close()
