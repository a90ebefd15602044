"""From radiance to the window: the display step and the painter, without a window."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import Array32, Image8
from simgl.display_images import display_from_radiance
from simgl.passes.display import DisplayPass
from simgl.scenario.scenario import Scenario
from simgl.viewer.overlay_boxes import BoxStyle
from simgl.viewer.view_settings import ViewSettings
from simgl.viewer.viewport import Viewport
from simgl.viewer.window_painter import WindowPainter, Words, read_window
from tests.viewer.harness import assert_shows, press


def shown_by_gpu(
    gl: moderngl.Context,
    radiance: Array32,
    size: tuple[int, int],
    rectangle: tuple[int, int, int, int],
    exposure_value: float = 0.0,
) -> Image8:
    """(height, width, 3) of a window of a size that holds a picture in a rectangle."""
    texture = gl.texture(radiance.shape[1::-1], 4, radiance.tobytes(), dtype="f4")
    window = gl.framebuffer([gl.renderbuffer(size, 4)])
    display = DisplayPass(gl)
    window.clear(0.0, 0.0, 0.0, 1.0)
    display.draw(texture, window, rectangle, exposure_value)
    picture = read_window(window, size)
    # moderngl keeps a released framebuffer bound, and then stumbles over it.
    gl.detect_framebuffer(0).use()
    display.release()
    window.color_attachments[0].release()
    window.release()
    texture.release()
    return picture


def random_radiance(height: int, width: int) -> Array32:
    """From deep black to four times white, every decade as often."""
    rng = np.random.default_rng(11)
    return (10.0 ** rng.uniform(-4.0, np.log10(220.0), (height, width, 4))).astype(np.float32)


def code_difference(a: Image8, b: Image8) -> int:
    assert a.shape == b.shape
    return int(np.abs(a.astype(int) - b.astype(int)).max())


def test_the_window_shows_what_display_from_radiance_gives(gl: moderngl.Context) -> None:
    radiance = random_radiance(48, 80)
    picture = shown_by_gpu(gl, radiance, (80, 48), (0, 0, 80, 48))
    # Both round to 8 bits; a value on the edge may fall to either side.
    assert code_difference(picture, display_from_radiance(radiance)) <= 1
    assert {0, 255} <= set(picture.ravel().tolist())


def test_one_exposure_value_doubles_the_light(gl: moderngl.Context) -> None:
    radiance = random_radiance(16, 16)
    picture = shown_by_gpu(gl, radiance, (16, 16), (0, 0, 16, 16), 1.0)
    assert code_difference(picture, display_from_radiance(2.0 * radiance)) <= 1


def test_a_smaller_picture_is_enlarged_upright_into_its_rectangle(gl: moderngl.Context) -> None:
    radiance = random_radiance(4, 4)
    picture = shown_by_gpu(gl, radiance, (20, 10), (6, 1, 8, 8))
    expected = np.zeros((10, 20, 3), np.uint8)
    expected[1:9, 6:14] = display_from_radiance(radiance).repeat(2, axis=0).repeat(2, axis=1)
    assert code_difference(picture, expected) <= 1


def test_the_painter_shows_the_captures_radiance_and_leaves_nothing(
    gl: moderngl.Context, scenario: Scenario, look: ViewSettings
) -> None:
    window = gl.framebuffer([gl.renderbuffer((96, 64), 4)])
    brighter = press(look, scenario, "up")
    with Viewport(gl, scenario, look) as viewport, WindowPainter(gl) as painter:
        viewport.update((96, 64))
        viewport.press("up")
        viewport.update((96, 64))
        painter.draw(viewport, Words(text=False), BoxStyle(), window, (96, 64))
        picture = read_window(window, (96, 64))
        # Boxes leave nothing either.
        painter.draw(viewport, Words(message="brighter"), BoxStyle(), window, (96, 64))
    gl.detect_framebuffer(0).use()
    window.color_attachments[0].release()
    window.release()
    assert_shows(picture, gl, scenario, brighter)
