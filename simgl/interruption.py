"""How the program ends when a signal asks it to: at most one line, exit status 128 + its number.

It comes before anything slow, so it imports next to nothing. Only the command line and its workers
change what signals do; a program that imports simgl has its signals to itself.
"""

from __future__ import annotations

import faulthandler
import os
import sys
from _thread import start_new_thread
from time import sleep

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from signal import Signals
    from types import FrameType, TracebackType
    from typing import NoReturn

# What a first signal leaves the clean-up: threads at work, each to its next step [s].
_CLEAN_UP_TIME = 3.0

# Files that are being written under a temporary name; those still there at the end are removed.
unfinished_files: set[Path] = set()

# Folders that were made for results, outer ones first; removed where nothing has come into them.
new_folders: list[Path] = []


class _Ending:
    """The signal that ends this process, and what its line says."""

    received: Signals | None = None
    at_once = False
    result: Callable[[], str] | None = None
    reported = False


_ending = _Ending()


def end_by_signals() -> None:
    """From here on SIGINT, SIGTERM and SIGHUP end this process in one line, within some seconds.

    A signal that was ignored before stays so, such as SIGHUP under nohup. A fault of native code
    prints the stacks of all threads.
    """
    global _ending
    _ending = _Ending()
    sys.excepthook = _on_exception
    # It takes some milliseconds, in which the hook helps already.
    import signal

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _on_signal)
    sys.unraisablehook = _on_unraisable
    report_faults()


def report_faults() -> None:
    """A fault of native code prints the stacks of all threads to stderr, if there is one."""
    try:
        faulthandler.enable()
    except (AttributeError, OSError, RuntimeError, ValueError):
        return


def set_result_so_far(describe: Callable[[], str]) -> None:
    """The line of a signal that comes from now on also says what the work leaves behind.

    describe : called when the process ends
    """
    _ending.result = describe


def exit_at_once() -> None:
    """A signal that comes from now on ends this process without any clean-up.

    For work whose clean-up takes longer than its loss costs, such as that of worker processes that
    end with this one.
    """
    _ending.at_once = True


def block_interrupts() -> None:
    """Keep Ctrl-C from this thread, and from the threads and processes that it starts.

    A terminal sends it to child processes, too, where those that end with this one need it not.
    """
    from multiprocessing import resource_tracker
    from signal import SIG_BLOCK, SIGINT, pthread_sigmask

    # Python unblocks it when this helper of all its child processes starts.
    resource_tracker.ensure_running()
    pthread_sigmask(SIG_BLOCK, {SIGINT})


def receive(number: Signals) -> NoReturn:
    """Begin to end as if a signal had come."""
    _ending.received = number
    # Unlike threading's threads it takes no lock that the interrupted code may hold.
    start_new_thread(_end_clean_up, (number,))
    raise KeyboardInterrupt


def remove_unfinished() -> None:
    """After the work, however it has ended: files that are not complete, and folders for results
    that did not come."""
    for path in tuple(unfinished_files):
        try:
            path.unlink()
        except OSError:
            continue
    for folder in reversed(new_folders):
        try:
            folder.rmdir()
        except OSError:  # it holds results, or was never made
            continue


def exit_if_signalled() -> None:
    """After the work, however it has ended: exits with its line where a signal has come."""
    if _ending.received is not None:
        _report(_ending.received)
        sys.exit(128 + _ending.received)


def _on_signal(number: int, frame: FrameType | None) -> None:
    from signal import Signals

    if _ending.received is not None:
        _exit_at_once(_ending.received)
    signalled = Signals(number)
    if _ending.at_once or _is_importing(frame):
        # Who imports may turn any exception into another one, or do without the module.
        _exit_at_once(signalled)
    receive(signalled)


def _end_clean_up(number: Signals) -> None:
    """Threads of a pool are waited for, however much of their work is left: no longer than this."""
    sleep(_CLEAN_UP_TIME)
    _exit_at_once(number)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _on_exception(
    kind: type[BaseException], error: BaseException, traceback: TracebackType | None
) -> None:
    if issubclass(kind, KeyboardInterrupt):
        from signal import SIGINT

        _exit_at_once(_ending.received or SIGINT)
    sys.__excepthook__(kind, error, traceback)


def _on_unraisable(unraisable: sys.UnraisableHookArgs) -> None:
    """A signal that comes inside a destructor or a callback ends the program all the same."""
    if _ending.received is not None and isinstance(unraisable.exc_value, KeyboardInterrupt):
        _exit_at_once(_ending.received)
    sys.__unraisablehook__(unraisable)


def _exit_at_once(number: Signals) -> NoReturn:
    remove_unfinished()
    try:
        _report(number)
    finally:
        os._exit(128 + number)


def _report(number: Signals) -> None:
    """Print the line, past Python's buffers: the signal may have come in the middle of a print."""
    if _ending.reported or number.name == "SIGPIPE":
        return
    _ending.reported = True
    line = "simgl: interrupted" if number.name == "SIGINT" else f"simgl: ended by {number.name}"
    if _ending.result is not None:
        line += f"; {_ending.result()}"
    # A progress bar may have left its text, and hidden the cursor.
    clear = "\r\x1b[K\x1b[?25h" if os.isatty(2) else ""
    try:
        os.write(2, f"{clear}{line}\n".encode())
    except OSError:
        return
