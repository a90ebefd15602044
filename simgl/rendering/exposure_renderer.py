"""The ordered passes from the views of a moving scene to what its camera sees over an exposure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import moderngl
import numpy as np

from simgl.camera.camera import Camera
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget, TargetStore
from simgl.gpu.timers import PassTimer
from simgl.passes.average import AveragePass
from simgl.passes.motion_sweep import Span, Sweep, SweepPass
from simgl.passes.resolve import DistortedView, ResolvePass
from simgl.passes.shading_points import ShadingPoints
from simgl.view.exposure_views import Layer, MovingViews, SweptBackground
from simgl.view.frame_view import FrameView
from simgl.view.image_paths import Box, ImagePaths
from simgl.view.raster_tiles import RasterTile

_BANDS = (Format("f4", 4),)
# Radiance, and the share of each pixel that is covered, by band.
_COVERED = (Format("f4", 4), Format("f4", 4))

LitTiles = Iterator[tuple[RasterTile, ShadingPoints, tuple[moderngl.Texture, ...]]]


@dataclass(frozen=True)
class Drawing:
    """How a renderer draws snapshots: spacecraft, what is behind them, what a lens does to them."""

    lit_tiles: Callable[[FrameView, Iterable[RasterTile]], LitTiles]
    background: Callable[[FrameView, ImageTarget], None]
    lens: Callable[[FrameView], DistortedView | None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Laid:
    """Layers that are laid over an image, for all of an exposure or in a part of it.

    depth : of theirs among others
    span : of their exposure, in which they are swept
    drawn : by use, which layers the snapshots hold already
    """

    layers: list[Layer]
    depth: int = 0
    span: Span | None = None
    drawn: dict[str, Layer] = field(default_factory=dict)

    def swept(self, sweep: Sweep) -> Sweep:
        """A sweep of one of them, as it is seen in this part."""
        if self.span is None:
            return sweep
        return replace(sweep, span=self.span, share=1.0 / (self.span.last - self.span.first))


class ExposureRenderer:
    """Sweeps snapshots of spacecraft, and of what is behind them, over their ways in the image.

    The radiance of spacecraft and the share of each pixel that they cover are swept alike: what is
    behind is seen as long as nothing stands before it.
    """

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        timer: PassTimer,
        resolve: ResolvePass,
    ) -> None:
        self._timer, self._resolve = timer, resolve
        self._sweep = SweepPass(ctx)
        self._average = AveragePass(ctx)
        self._targets = TargetStore(ctx)
        self._ctx = ctx

    def draw(self, views: MovingViews, target: ImageTarget, by: Drawing) -> None:
        """Fill a target of the image's size with the mean radiance that each row sees."""
        snapshots = [list(one.snapshots()) for one in views.by_depth]
        all_layers = [
            [one.layers(snapshot) for snapshot in seen]
            for one, seen in zip(views.by_depth, snapshots, strict=True)
        ]
        behind = list(views.behind(snapshots[0][0][0][1]))
        if _is_black(behind) and len(all_layers) == 1 and all(map(_are_one, all_layers[0])):
            self._draw_before_nothing(by, views, all_layers[0], target)
        elif len(views.scene.spans) == 1:
            farthest_first = [layer for (layers,) in all_layers for layer in layers]
            layers = self._draw_behind(by, views, behind, farthest_first, target)
            self._lay(by, views, Laid(layers=layers), target)
        else:
            self._draw_in_turn(by, views, behind, all_layers, target)

    def _draw_before_nothing(
        self, by: Drawing, views: MovingViews, all_layers: list[list[Layer]], target: ImageTarget
    ) -> None:
        """Before a black background the covered share of pixels does not count."""
        target.blacken()
        spare = partial(self._spare, views.scene.drawn, _BANDS)
        for (layer,) in filter(None, all_layers):
            assert layer.paths is not None
            sweep = replace(_of_layer(views, layer, layer.paths), share=1.0 / len(all_layers))
            snapshots = self._snapshots(views.scene.drawn, _BANDS, sweep)
            _clear(snapshots, sweep)
            self._draw_tiles(by, layer, snapshots, ResolvePass.lays)
            with self._timer.measure("sweep"):
                self._sweep.add(sweep, snapshots, target.framebuffer, spare)

    def _draw_in_turn(
        self,
        by: Drawing,
        views: MovingViews,
        behind: list[SweptBackground],
        all_layers: list[list[list[Layer]]],
        target: ImageTarget,
    ) -> None:
        """The mean of what is seen in parts of the exposure, each before the same background.

        all_layers : of the spacecraft at each depth, of each of their snapshots
        """
        still = self._target("behind", views.camera)
        one = self._target("one snapshot", views.camera)
        self._draw_behind(by, views, behind, [], still)
        # Elsewhere all snapshots show what is behind.
        every = [layer for seen in all_layers for layers in seen for layer in layers]
        box = _box_of([self._area(views, layer) for layer in every])
        self._average.copy(still.textures[0], target.framebuffer, (0, 0, *target.size))
        if box is None:
            return
        target.framebuffer.clear(viewport=box)
        drawn: dict[str, Layer] = {}
        for first, last in views.scene.spans:
            self._average.copy(still.textures[0], one.framebuffer, box)
            for depth, seen in enumerate(all_layers):
                number = int(first * len(seen))
                start, end = (float(edge * len(seen) - number) - 0.5 for edge in (first, last))
                span = Span(first=start, last=end)
                laid = Laid(layers=seen[number], depth=depth, span=span, drawn=drawn)
                self._lay(by, views, laid, one)
            with self._timer.measure("sweep"):
                share = float(last - first)
                self._average.add(one.textures[0], share, target.framebuffer, box)

    @staticmethod
    def _area(views: MovingViews, layer: Layer) -> Box:
        """Of the image, which a layer may touch."""
        return layer.filled if layer.paths is None else _of_layer(views, layer, layer.paths).area

    def _draw_behind(
        self,
        by: Drawing,
        views: MovingViews,
        behind: list[SweptBackground],
        layers: list[Layer],
        target: ImageTarget,
    ) -> list[Layer]:
        """Fill a target with what is behind spacecraft and with those that go along with it.

        returns : the other layers
        """
        if _is_black(behind):
            target.blacken()
            return layers
        single = len(behind) == 1 and not views.scene.rows
        for number, one in enumerate(behind):
            if one.part is None or one.paths is None:
                by.background(one.view, target)
                return layers
            drawn = self._target("swept background", views.scene.drawn_behind)
            by.background(one.view, drawn)
            # What stands before a background that moves as it does hides the same of it always.
            while single and layers and layers[0].goes_with(one.paths):
                self._draw_tiles(by, layers.pop(0), [drawn], ResolvePass.lays)
            with self._timer.measure("sweep"):
                if number == 0 and len(behind) > 1:
                    target.blacken()
                draw = self._sweep.fill if len(behind) == 1 else self._sweep.add
                spare = partial(self._spare, views.scene.drawn_behind, _BANDS)
                draw(_of_background(views, one), [drawn], target.framebuffer, spare)
        return layers

    def _lay(self, by: Drawing, views: MovingViews, laid: Laid, target: ImageTarget) -> None:
        """Lay swept layers over what a target holds, the farthest first."""
        for number, layer in enumerate(laid.layers):
            if layer.paths is None:
                self._draw_tiles(by, layer, [target], ResolvePass.lays)
                continue
            sweep = _of_layer(views, layer, layer.paths)
            use = f"{laid.depth} {number}"
            snapshots = self._snapshots(views.scene.drawn, _COVERED, sweep, use)
            if laid.drawn.get(use) is not layer:
                _clear(snapshots, sweep)
                self._draw_tiles(by, layer, snapshots, ResolvePass.adds)
                laid.drawn[use] = layer
            with self._timer.measure("sweep"):
                spare = partial(self._spare, views.scene.drawn, _COVERED)
                self._sweep.lay_over(laid.swept(sweep), snapshots, target.framebuffer, spare)

    def _draw_tiles(
        self, by: Drawing, layer: Layer, targets: Sequence[ImageTarget], how: State
    ) -> None:
        """In each part of its light into a target, with a state of ``ResolvePass``."""
        for one in layer.tiles:
            lens = by.lens(one.view)
            for tile, points, lights in by.lit_tiles(one.view, [one.tile]):
                with self._timer.measure("resolve"):
                    for radiance, target in zip(lights, targets, strict=True):
                        self._resolve.draw(
                            tile,
                            points,
                            radiance,
                            target.framebuffer,
                            lens,
                            one.view.ramps,
                            one.rows,
                            how,
                        )

    def _snapshots(
        self, drawn: Camera, formats: tuple[Format, ...], sweep: Sweep, use: str = ""
    ) -> list[ImageTarget]:
        """Targets for the snapshots of a sweep."""
        return [
            self._target(f"snapshot {len(formats)} {use} {light}", drawn, formats)
            for light in range(sweep.lights)
        ]

    def _spare(self, drawn: Camera, formats: tuple[Format, ...], number: int) -> ImageTarget:
        return self._target(f"swept {len(formats)} {number}", drawn, formats)

    def _target(
        self, use: str, camera: Camera, formats: tuple[Format, ...] = _BANDS
    ) -> ImageTarget:
        return self._targets.of(use, _size(camera), formats)

    def release(self) -> None:
        """Free what is its own."""
        release_all(self._ctx, self._targets, self._sweep, self._average)


def _clear(snapshots: list[ImageTarget], sweep: Sweep) -> None:
    """Where a sweep reads them."""
    for one in snapshots:
        one.framebuffer.clear(viewport=sweep.read)


def _size(camera: Camera) -> tuple[int, int]:
    return camera.detector.width, camera.detector.height


def _box_of(boxes: list[Box]) -> Box | None:
    """x, y, width, height of what holds boxes; None where that is nothing."""
    boxes = [one for one in boxes if one[2] > 0 and one[3] > 0]
    if not boxes:
        return None
    x, y, width, height = np.array(boxes).T
    x0, y0 = int(x.min()), int(y.min())
    return x0, y0, int((x + width).max()) - x0, int((y + height).max()) - y0


def _is_black(behind: list[SweptBackground]) -> bool:
    return all(one.view.shows_nothing_behind for one in behind)


def _are_one(layers: list[Layer]) -> bool:
    """Whether they are one that is swept, or none."""
    return not layers or (len(layers) == 1 and layers[0].paths is not None)


def _of_layer(views: MovingViews, layer: Layer, paths: ImagePaths) -> Sweep:
    return Sweep(
        paths=paths,
        size=_size(views.scene.drawn),
        filled=layer.filled,
        margin=views.scene.margin_of(views.scene.drawn),
        target_size=_size(views.camera),
        lights=layer.light_parts,
        edges=not layer.small,
    )


def _of_background(views: MovingViews, behind: SweptBackground) -> Sweep:
    """What rows see of a background that is drawn for one moment for all of them."""
    assert behind.part is not None
    assert behind.paths is not None
    camera, part, drawn = views.camera, behind.part, views.scene.drawn_behind
    length = camera.exposure_time
    span = Span(
        first=(part.moment - part.half_span) / length,
        last=(part.moment + part.half_span) / length,
        moment=part.moment / length,
        row_rate=camera.detector.row_time / length,
        middle_row=0.5 * camera.detector.height,
    )
    return Sweep(
        paths=behind.paths,
        size=_size(drawn),
        filled=(0, 0, *_size(drawn)),
        margin=views.scene.margin_of(drawn),
        target_size=_size(camera),
        span=span,
    )
