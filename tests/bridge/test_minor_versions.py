"""A newer server of the same major version: clients skip what they do not know."""

from __future__ import annotations

import pytest
from simgl_bridge import Client, RemoteError

from simgl import Scenario
from tests.patience import limit


def test_the_python_client_skips_what_it_does_not_know(
    newer_address: str, client: Client, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with Client(newer_address, timeout_s=limit(10.0)) as later:
        image = later.render(now, "nav", products=("dn", "part_id"))
        same = client.render(now, "nav", products=("dn", "part_id"))
        assert image.dn.tobytes() == same.dn.tobytes()
        assert image.part_names == same.part_names
        with pytest.raises(RemoteError) as caught:
            later.render(now, "nva")
        assert (caught.value.code, caught.value.retryable) == ("FROM_LATER", True)
        assert later.ping() < limit(10.0)
