"""Frames of a campaign as a data set of PyTorch; imported only where PyTorch is installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from os import PathLike
from typing import Any

from simgl.campaign.stream import Sample, stream
from simgl.errors import ConfigError
from simgl.simulator import Product

try:
    from torch.utils.data import IterableDataset, get_worker_info
except ImportError:
    raise ConfigError("CampaignDataset", "", "needs PyTorch: pip install torch") from None


class CampaignDataset(IterableDataset[Any]):  # type: ignore[misc, unused-ignore]
    """An ``IterableDataset`` of the samples of a campaign; parameters are those of ``stream``.

    transform : of each sample, at the worker; without it ``DataLoader`` needs ``batch_size=None``

    Of n workers of a ``DataLoader`` the k-th renders every n-th sample from the k-th on, with one
    OpenGL context each. Start them by ``multiprocessing_context="spawn"``: a context does not
    outlive a fork.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        frames: Sequence[int],
        *,
        products: Set[Product] = frozenset(),
        transform: Callable[[Sample], Any] | None = None,
    ) -> None:
        self._path, self._frames = path, frames
        self._products, self._transform = frozenset(products), transform

    def __iter__(self) -> Iterator[Any]:
        info = get_worker_info()
        share = self._frames if info is None else self._frames[info.id :: info.num_workers]
        samples = stream(self._path, share, products=self._products)
        return samples if self._transform is None else map(self._transform, samples)
