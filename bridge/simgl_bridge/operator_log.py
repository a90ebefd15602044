"""What a server tells its operator on stderr: bounded, whatever its clients send."""

from __future__ import annotations

import logging
import sys
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from simgl_bridge.framing import one_line
from simgl_bridge.server import print_line

# Different lines printed of one kind; further ones are counted.
LINES_PER_KIND = 10
LONGEST_LINE = 300
# Of a traceback; the innermost calls come last.
_MAX_CALLS = 20
# Lines left out of one kind after which their number is first printed; then ten times as many.
_FIRST_COUNT = 1000


class OperatorLog:
    """Prints a line once, and of one kind the first different lines; further ones are counted.

    The count of a kind is printed at 1000, 10,000, ... lines, and by ``close``: what is printed
    grows with the logarithm of what arrives.
    """

    def __init__(self, sender: str = "simgl") -> None:
        self._sender = sender
        self._printed: dict[str, set[str]] = {}
        self._left_out: Counter[str] = Counter()
        self._printed_counts: Counter[str] = Counter()

    def __call__(self, line: str, kind: str = "warnings") -> None:
        """Print a line that may hold anything; it is cut to one line of printable characters.

        kind : one of a few, named in the count of lines left out
        """
        shown = one_line(line, LONGEST_LINE)
        self._print_once(kind, shown, shown)

    def failure(self) -> None:
        """Print the traceback of the exception being handled."""
        error = sys.exception()
        assert error is not None
        calls = traceback.extract_tb(error.__traceback__)[-_MAX_CALLS:]
        cause = one_line(f"{type(error).__name__}: {error}", LONGEST_LINE)
        text = f"a request failed\n{''.join(traceback.format_list(calls))}{cause}"
        self._print_once("failures", f"{type(error).__name__} {calls[-1:]}", text)

    def _print_once(self, kind: str, key: str, text: str) -> None:
        printed = self._printed.setdefault(kind, set())
        if key not in printed and len(printed) < LINES_PER_KIND:
            printed.add(key)
            print_line(f"{self._sender}: {text}")
            return
        self._left_out[kind] += 1
        if self._left_out[kind] >= max(_FIRST_COUNT, 10 * self._printed_counts[kind]):
            self._print_count(kind)

    def _print_count(self, kind: str) -> None:
        self._printed_counts[kind] = self._left_out[kind]
        print_line(f"{self._sender}: {kind}: {self._left_out[kind]} more, like those above")

    def close(self) -> None:
        """Print how many lines were left out since the last count."""
        for kind, count in self._left_out.items():
            if count > self._printed_counts[kind]:
                self._print_count(kind)

    @contextmanager
    def library_warnings(self) -> Iterator[None]:
        """Print here what simgl and other packages log as a warning, too."""
        handler = _Handler(self)
        logging.getLogger().addHandler(handler)
        try:
            yield
        finally:
            logging.getLogger().removeHandler(handler)


class _Handler(logging.Handler):
    def __init__(self, log: OperatorLog) -> None:
        super().__init__(logging.WARNING)
        self._log = log

    def emit(self, record: logging.LogRecord) -> None:
        self._log(record.getMessage(), record.name)
