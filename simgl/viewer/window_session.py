"""One open window: GLFW's events reach the subject, and what it shows is drawn."""

from __future__ import annotations

import itertools
import math
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import glfw
import moderngl

from simgl.display_images import png_bytes
from simgl.errors import OutputError
from simgl.output import complete_file
from simgl.video import mp4_file
from simgl.viewer.overlay_boxes import BoxStyle
from simgl.viewer.subject import Size, Subject
from simgl.viewer.view_commands import HELP_OF_WINDOW
from simgl.viewer.window_painter import WindowPainter, Words, pixel_at, read_window

# Seconds that an idle window waits for events; short enough for Ctrl-C to be felt.
_IDLE = 0.25
# A window that is being resized shows the old image until its size is stable for this long [s].
_SETTLE = 0.2
# For how long the window says what has changed [s].
_MESSAGE_TIME = 3.0
# Of videos [Hz]. While one is recorded, the scene's time goes on by such steps.
_FRAME_RATE = 25

# Characters arrive as the keyboard layout types them; these keys type no character.
_NAMED_KEYS = {
    glfw.KEY_LEFT: "left",
    glfw.KEY_RIGHT: "right",
    glfw.KEY_UP: "up",
    glfw.KEY_DOWN: "down",
    glfw.KEY_ESCAPE: "escape",
}


def free_name(folder: Path) -> str:
    """The first ``simgl_view_NNN`` of which a folder has no file."""
    taken = {path.name.partition(".")[0] for path in folder.glob("simgl_view_*")}
    return next(n for i in itertools.count(1) if (n := f"simgl_view_{i:03d}") not in taken)


class WindowSession:
    """Shows a subject until its window is closed.

    message : what has just changed, as the window says it
    """

    def __init__(
        self, window: Any, ctx: moderngl.Context, subject: Subject, painter: WindowPainter
    ) -> None:
        self._window, self._subject, self._painter = window, subject, painter
        self._target = ctx.screen
        self._size: Size = glfw.get_framebuffer_size(window)
        self._settled_size = self._size
        self._resized_at = -math.inf
        self._shown: tuple[object, ...] | None = None
        self._shown_at = -math.inf
        self._exposed = True
        self._cursor: tuple[float, float] | None = None
        self._help_is_open, self._has_text = False, True
        self.message, self._said_at = "", -math.inf
        self._video: tuple[ExitStack, Any, Path, Size] | None = None
        glfw.set_char_callback(window, self._on_character)
        glfw.set_key_callback(window, self._on_key)
        glfw.set_scroll_callback(window, self._on_scroll)
        glfw.set_cursor_pos_callback(window, self._on_cursor)
        glfw.set_cursor_enter_callback(window, self._on_enter)
        glfw.set_window_refresh_callback(window, self._on_refresh)

    def run(self) -> None:
        """Until the window is closed."""
        before = time.monotonic()
        try:
            while not glfw.window_should_close(self._window):
                was_playing = self._subject.is_playing
                if was_playing:
                    glfw.poll_events()
                else:
                    glfw.wait_events_timeout(0.02 if self._subject.runs else _IDLE)
                now = time.monotonic()
                if was_playing and self._subject.is_playing:
                    self._subject.advance(1.0 / _FRAME_RATE if self._video else now - before)
                before = now
                self._follow_size(now)
                if 0 not in self._size:
                    self._step(now)
        finally:
            self._end_video()

    def _follow_size(self, now: float) -> None:
        size = glfw.get_framebuffer_size(self._window)
        if size != self._size:
            self._size, self._resized_at, self._exposed = size, now, True
        if now - self._resized_at >= _SETTLE and 0 not in size:
            self._settled_size = size

    def _step(self, now: float) -> None:
        """Bring the image up to date, and draw where anything changed."""
        problem = self._subject.update(self._settled_size)
        if problem is not None:
            self._say(problem)
        if self.message and now - self._said_at > _MESSAGE_TIME:
            self.message = ""
        if self._look == self._shown and not self._exposed:
            return
        self._draw()
        interval = now - self._shown_at
        playing = self._subject.is_playing and 0.0 < interval < 1.0
        caption = self._subject.caption(1.0 / interval if playing else None)
        if self._video is not None:
            caption += " | recording"
        glfw.set_window_title(self._window, caption)
        self._shown, self._shown_at, self._exposed = self._look, now, False

    @property
    def _look(self) -> tuple[object, ...]:
        """Another value, another look of the window."""
        return self._subject.number, self._words, self._subject.error, self._style

    @property
    def _words(self) -> Words:
        lines = (*self._subject.help, *HELP_OF_WINDOW) if self._help_is_open else ()
        return Words(message=self.message, help=lines, pixel=self._pixel, text=self._has_text)

    @property
    def _style(self) -> BoxStyle:
        return BoxStyle(content_scale=glfw.get_window_content_scale(self._window)[0])

    @property
    def _pixel(self) -> tuple[int, int] | None:
        if self._cursor is None:
            return None
        # The cursor's place is told in units of the desktop, which may be several pixels.
        width, height = glfw.get_window_size(self._window)
        if 0 in (width, height):
            return None
        x, y = self._cursor
        place = x * self._size[0] / width, y * self._size[1] / height
        return pixel_at(self._subject.panels(), self._size, place)

    def _draw(self) -> None:
        self._painter.draw(self._subject, self._words, self._style, self._target, self._size)
        if self._video is not None:
            self._add_to_video()
        glfw.swap_buffers(self._window)

    def screenshot(self, path: Path) -> None:
        """Draw the images without text, and write the window's framebuffer as PNG."""
        self._has_text = False
        self._subject.update(self._size)
        self._save_window(path)

    def _save_window(self, path: Path) -> None:
        self._painter.draw(self._subject, self._words, self._style, self._target, self._size)
        # Read before the buffers are swapped: afterwards the back buffer is undefined.
        image = read_window(self._target, self._size)
        glfw.swap_buffers(self._window)
        with complete_file(path) as temporary:
            temporary.write_bytes(png_bytes(image))

    def _say(self, message: str) -> None:
        self.message, self._said_at = message, time.monotonic()

    def _press(self, key: str) -> None:
        if key == "escape" and self._help_is_open:
            key = "h"
        if key in ("q", "escape"):
            glfw.set_window_should_close(self._window, True)
        elif key == "h":
            self._help_is_open, self._has_text = not self._help_is_open, True
        elif key == "o":
            self._has_text = not self._has_text
        elif key == "s":
            self._save()
        elif key == "r":
            self._toggle_video()
        else:
            said = self._subject.press(key)
            if said is not None:
                self._say(said)

    def _save(self) -> None:
        """The window and its data under the first free name in the working directory."""
        folder = Path()
        name = free_name(folder)
        try:
            self._save_window(folder / f"{name}.png")
            data = self._subject.save_data(folder, name)
        except OutputError as error:
            self._say(str(error))
        else:
            for path in (folder / f"{name}.png", *data):
                print(path, flush=True)
            self._say(f"saved {name}.png" + (f" and {len(data)} files of data" if data else ""))

    def _toggle_video(self) -> None:
        if self._video is not None:
            self._end_video()
            return
        path = Path(f"{free_name(Path())}.mp4")
        with ExitStack() as opened:
            try:
                add = opened.enter_context(mp4_file(path, _FRAME_RATE))
            except OutputError as error:
                self._say(str(error))
                return
            self._video = opened.pop_all(), add, path, self._size
        self._say(f"records {path}; r ends it")

    def _add_to_video(self) -> None:
        assert self._video is not None
        _, add, _, size = self._video
        if size == self._size:
            add(read_window(self._target, self._size))
        else:
            self._end_video("the window has another size")

    def _end_video(self, why: str = "") -> None:
        if self._video is None:
            return
        opened, _, path, _ = self._video
        self._video = None
        try:
            opened.close()
        except OutputError as error:
            self._say(str(error))
        else:
            print(path, flush=True)
            self._say(f"saved {path}" + (f": {why}" if why else ""))

    def _on_character(self, _window: Any, codepoint: int) -> None:
        character = chr(codepoint).lower()
        self._press("space" if character == " " else character)

    def _on_key(self, _window: Any, key: int, _scancode: int, action: int, _mods: int) -> None:
        if key in _NAMED_KEYS and action in (glfw.PRESS, glfw.REPEAT):
            self._press(_NAMED_KEYS[key])

    def _on_scroll(self, _window: Any, _right: float, up: float) -> None:
        self._subject.scroll(up)

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        before, self._cursor = self._cursor, (x, y)
        pressed = glfw.get_mouse_button(window, glfw.MOUSE_BUTTON_LEFT) == glfw.PRESS
        if pressed and before is not None:
            # Across the window's height is half a turn.
            angle = math.pi / glfw.get_window_size(window)[1]
            self._subject.drag(angle * (x - before[0]), angle * (y - before[1]))

    def _on_enter(self, _window: Any, entered: int) -> None:
        if not entered:
            self._cursor = None

    def _on_refresh(self, _window: Any) -> None:
        self._exposed = True
