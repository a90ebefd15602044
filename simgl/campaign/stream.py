"""Frames of a campaign without files, for a training loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from simgl.campaign.campaign_file import Campaign, load_campaign
from simgl.campaign.frame_scene import frame_scene
from simgl.campaign.frame_task import captured, frame_row
from simgl.campaign.labels import SpacecraftLabel, spacecraft_labels
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Value
from simgl.simulator import Capture, Product, Simulator
from simgl.workers.executors import select_executor
from simgl.workers.frame_job import Execute

# Of which each sample is made.
_NEEDED = frozenset({Product.DN, Product.TRUTH})


@dataclass(frozen=True, kw_only=True, eq=False)
class Sample:
    """A frame of a campaign and its labels.

    frame : its number, on which alone it depends
    capture : the images; ``capture.digital.dn`` (height, width) uint16 in any case
    spacecraft : pose, box, mask and keypoints of each one in view
    row : the columns of the campaign's table, such as ``range_m``
    """

    frame: int
    capture: Capture
    spacecraft: tuple[SpacecraftLabel, ...]
    row: Mapping[str, Value]


@dataclass(frozen=True, kw_only=True)
class _SampleJob:
    """The samples of a campaign as a job for workers."""

    campaign: Campaign
    products: frozenset[Product]

    @property
    def scenario(self) -> Scenario:
        return self.campaign.scenario

    def render(self, simulator: Simulator, frame: int) -> Sample:
        scene = frame_scene(self.campaign, frame)
        capture = captured(simulator, self.campaign, scene, self.products)
        assert capture.truth is not None
        return Sample(
            frame=frame,
            capture=capture,
            spacecraft=spacecraft_labels(capture.truth, scene.state),
            row=frame_row(self.campaign, scene, capture),
        )


def stream(
    path: str | PathLike[str],
    frames: Sequence[int] | None = None,
    *,
    products: Set[Product] = frozenset(),
    workers: int = 1,
) -> Iterator[Sample]:
    """The samples of a campaign file, in the order of ``frames``.

    frames : numbers from 0, also beyond the file's own ``frames``, which None takes; of n loaders
        the k-th takes ``range(k, count, n)``
    products : further than DN and truth, such as RADIANCE or NORMALS
    workers : processes on this machine; more than one need Dask

    A sample depends on the campaign and its number alone: not on workers, order, or how many are
    taken. Raises ConfigError or AssetError as ``simgl campaign`` does.

    >>> for sample in stream("examples/campaign/approach.toml", range(2)):
    ...     dn, pose = sample.capture.digital.dn, sample.spacecraft[0].position_camera_m
    """
    campaign = load_campaign(Path(path))
    job = _SampleJob(campaign=campaign, products=_NEEDED | products)
    wanted = range(campaign.frames) if frames is None else frames
    with (
        Simulator(campaign.scenario) as simulator,
        select_executor(job, simulator, workers, None) as execute,
    ):
        yield from _in_order(execute, wanted)


def _in_order(execute: Execute[Sample], frames: Sequence[int]) -> Iterator[Sample]:
    """Samples as they were asked for; those that are ready before their turn wait."""
    ready: dict[int, Sample] = {}
    arriving = execute(frames)
    for frame in frames:
        while frame not in ready:
            sample = next(arriving)
            ready[sample.frame] = sample
        yield ready.pop(frame)
