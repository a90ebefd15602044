"""One thread for numpy's linear algebra in the processes of simgl.

Frames have no product that a second thread would make faster. Once woken, such a thread waits for
the next product in a loop and keeps a core busy. At real-time priority it may even keep the thread
that it waits for from running: a frame then takes minutes.
"""

from __future__ import annotations

import os

# What OpenBLAS and MKL read when numpy is imported.
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def use_one_thread() -> None:
    """Set the variables for this process and those that it starts, before numpy is imported.

    A variable that is set already stays.
    """
    for name, number in ONE_THREAD.items():
        os.environ.setdefault(name, number)
