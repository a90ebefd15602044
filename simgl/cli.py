"""Entry point of the command line. Bad input gives one clear line and exit status 2.

The commands are imported when signals are looked after: whoever presses Ctrl-C in the first second
gets one line, too.
"""

from __future__ import annotations

from simgl import blas_threads, interruption


def main() -> None:
    """Run ``simgl`` with the arguments of this process."""
    interruption.end_by_signals()
    blas_threads.use_one_thread()
    try:
        from simgl.commands.application import run

        run()
    finally:
        interruption.remove_unfinished()
        interruption.exit_if_signalled()


if __name__ == "__main__":
    main()
