"""Samples without files: those of the campaign's run, whoever takes them in whatever order."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from simgl.arrays import AnyArray
from simgl.campaign.campaign_file import load_campaign
from simgl.campaign.frame_task import CampaignJob
from simgl.campaign.stream import Sample, stream
from simgl.errors import ConfigError
from simgl.simulator import Product, Simulator
from tests.campaign.small import written


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("stream"))


def dn(sample: Sample) -> AnyArray:
    assert sample.capture.digital is not None
    return sample.capture.digital.dn


@pytest.fixture(scope="module")
def samples(path: Path) -> list[Sample]:
    return list(stream(path, range(4)))


def test_samples_are_the_frames_of_the_run(path: Path, samples: list[Sample]) -> None:
    job = CampaignJob(campaign=load_campaign(path))
    with Simulator(job.scenario) as simulator:
        for sample in samples[:2]:
            rendered = job.render(simulator, sample.frame)
            assert rendered.row == sample.row
            # Of the digital numbers themselves.
            assert rendered.row["dn_sha256"] == sample.row["dn_sha256"]
    assert [s.spacecraft[0].name for s in samples] == ["target"] * 4


def test_a_sample_depends_on_its_number_alone(path: Path, samples: list[Sample]) -> None:
    others = list(stream(path, (3, 1), products={Product.RADIANCE, Product.NORMALS}))
    assert [sample.frame for sample in others] == [3, 1]
    for sample in others:
        np.testing.assert_array_equal(dn(sample), dn(samples[sample.frame]))
        assert sample.capture.radiance is not None
        assert sample.capture.normals is not None


def test_two_workers_give_the_same_in_the_same_order(path: Path, samples: list[Sample]) -> None:
    taken = list(stream(path, range(4), workers=2))
    assert [sample.frame for sample in taken] == [0, 1, 2, 3]
    for one, other in zip(samples, taken, strict=True):
        np.testing.assert_array_equal(dn(one), dn(other))
        assert one.spacecraft == other.spacecraft


def test_a_stream_may_go_on_beyond_the_files_frames_and_be_left(path: Path) -> None:
    (first,) = islice(stream(path, range(1_000_000, 10**9)), 1)
    assert first.frame == 1_000_000
    assert sum(1 for _ in islice(stream(path), 13)) == 12


def test_a_file_that_is_wrong_is_one_line(tmp_path: Path) -> None:
    path = written(tmp_path, "range_m = -1.0\n")
    with pytest.raises(ConfigError, match=r"campaign.toml \[draw\]: range_m"):
        next(stream(path))


def test_pytorch_loads_the_same_samples_by_workers(path: Path, samples: list[Sample]) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed")
    from torch.utils.data import DataLoader

    from simgl.campaign.torch_dataset import CampaignDataset

    frames = CampaignDataset(path, range(4))
    loader = DataLoader(
        frames, batch_size=None, num_workers=2, multiprocessing_context="spawn", timeout=120
    )
    taken = {sample.frame: sample for sample in loader}
    assert sorted(taken) == [0, 1, 2, 3]
    for sample in samples:
        np.testing.assert_array_equal(dn(sample), dn(taken[sample.frame]))
