"""A process that looks on: it works only where nobody else wants the processor."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

# The least share of a processor, where the system knows no idle class.
_NICENESS = 19
# Of a session: a tenth of a processor that another one wants too, so that it never stands still.
_NICENESS_OF_SESSION = 10


def run_when_idle(*, owns_session: bool = False) -> None:
    """Let this process work only where nobody else wants the processor.

    owns_session : whether it leads a session, whose priority is then lowered too. Linux shares a
        processor between sessions first and only then among the processes of one (sched(7), the
        autogroup feature): an idle process in a session of its own would take half of a processor.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    except (AttributeError, OSError):
        os.nice(_NICENESS)
    if owns_session:
        # Missing where a kernel has no such groups.
        with suppress(OSError):
            Path("/proc/self/autogroup").write_text(str(_NICENESS_OF_SESSION))
