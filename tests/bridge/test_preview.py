"""What followers cost a loop: nothing where there is none, little where there is one."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import zmq
from simgl_bridge.access import Access
from simgl_bridge.preview import Monitor
from simgl_bridge.web_process import _SHARE, _rest

from tests.patience import limit, wait_until


def test_previews_are_wanted_while_somebody_follows() -> None:
    with zmq.Context() as context:
        monitor = Monitor(context, "tcp://127.0.0.1:*", Access())
        assert not monitor.is_due(1.0)
        followers = [context.socket(zmq.SUB) for _ in range(2)]
        for follower in followers:
            follower.connect(monitor.address)
            follower.subscribe(b"simgl/1")
            wait_until(lambda: monitor.is_due(1.0), "previews are wanted")
        followers[0].close(linger=0)
        time.sleep(0.1)
        assert monitor.is_due(1.0)
        followers[1].close(linger=0)
        wait_until(lambda: not monitor.is_due(1.0), "previews are not wanted any more")
        context.destroy(linger=0)


def test_the_view_waits_for_what_encoding_takes_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    """Encoding goes on after the last image was taken; its processor time counts too."""
    # All other work of this process counts as well, so that it can only wait longer.
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    used, asked = time.process_time(), time.monotonic()
    work = 0.02

    def encode() -> None:
        end = time.thread_time() + work
        while time.thread_time() < end:
            np.sqrt(np.arange(1000.0))

    thread = threading.Thread(target=encode)
    thread.start()
    _rest(asked, used)
    assert time.monotonic() - asked >= work / _SHARE
    thread.join()


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="no groups of sessions")
def test_a_view_in_a_session_of_its_own_steps_back_with_it() -> None:
    program = (
        "from simgl.viewer.idle_priority import run_when_idle\n"
        "run_when_idle(owns_session=True)\nprint(flush=True)\ninput()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    ) as view:
        assert view.stdout is not None
        view.stdout.readline()
        # Of the class, and of the session among all others.
        assert os.sched_getscheduler(view.pid) == os.SCHED_IDLE
        assert Path(f"/proc/{view.pid}/autogroup").read_text().split()[-1] == "10"
        view.communicate(b"\n", timeout=limit(10.0))
