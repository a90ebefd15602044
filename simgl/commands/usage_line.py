"""What is wrong with the words of a command line, in one line.

Typer would draw a box of several lines around its own text. Later versions of it carry a copy of
Click, whose errors no public name reaches; what they hold is the same, and is read here.
"""

from __future__ import annotations

from typing import Any


def usage_line(error: Exception) -> str | None:
    """The line for an error of Typer; empty where help was printed, None for other errors.

    It names the option, what is allowed and what was given, as far as Typer knows them.
    """
    format_message = getattr(error, "format_message", None)
    if format_message is None:
        return None
    parameter, message = getattr(error, "param", None), str(getattr(error, "message", ""))
    if parameter is not None and message:
        return f"command line: {_of_value(error, parameter)}"
    problem, hint = _sentence(format_message()), _hint(error)
    if hint:
        # A text that ends with a suggestion is a question.
        hint = f" See {hint}" if problem.endswith("?") else f"; see {hint}"
    return f"command line: {problem}{hint}" if problem else ""


def _of_value(error: Any, parameter: Any) -> str:
    """What is wrong with the value of an option or argument."""
    name = parameter.opts[-1]
    name = name if name.startswith("-") else name.upper()
    problem = _sentence(error.message.removeprefix("Value error, "))
    problem = problem.replace("input should be", "must be", 1)
    details = getattr(error.__cause__, "errors", None)
    if details is None:
        # Of older versions of Typer, whose texts have value and range.
        return f"{name} {problem}"
    given, allowed = details()[0]["input"], _allowed_range(parameter)
    if allowed:
        return f"{name} must {allowed}, got {given}"
    return f"{name} {problem}" if repr(given) in problem else f'{name} {problem}, got "{given}"'


def _allowed_range(parameter: Any) -> str:
    """What may be given for a number; empty without limits."""
    low, high = getattr(parameter, "min", None), getattr(parameter, "max", None)
    if low is not None and high is not None:
        return f"lie in {low}..{high}"
    if low is not None:
        return f"be at least {low}"
    return f"be at most {high}" if high is not None else ""


def _sentence(text: str) -> str:
    """A text as part of a longer line."""
    text = text.strip().removesuffix(".")
    return text[:1].lower() + text[1:]


def _hint(error: Any) -> str:
    """Where more is said."""
    context = getattr(error, "ctx", None)
    return f"{context.command_path} --help" if context is not None else ""
