"""Text for logs: whatever a request, a name or a file brings stays inside its own line.

A line feed in a path would begin a line that looks like one of ours, and an escape sequence would
speak to the terminal that shows the log. So control characters are written as escapes, once, where
lines are made; who logs need not think of it.
"""

import logging
import unicodedata

_KEPT = {"\t"}
_UNSEEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode's categories: control, format (among them those that turn the direction of writing),
half of a surrogate pair, line and paragraph separators."""


def printable(text: str) -> str:
    r"""``text`` in one line; what cannot be seen, or would act on a terminal, as ``\x1b``."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        character.encode("unicode_escape").decode()
        if character not in _KEPT and unicodedata.category(character) in _UNSEEN
        else character
        for character in text
    )


def indented(text: str) -> str:
    """The same of several lines, each set in, so that none looks like the beginning of an entry."""
    return "\n".join(f"  {printable(line)}" for line in text.split("\n"))


class LineFormatter(logging.Formatter):
    """One line an entry; tracebacks below it, set in."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        """The entry's line."""
        return printable(super().formatMessage(record))

    def formatException(self, ei: object) -> str:
        """A traceback, in which the text of an error may be anybody's."""
        return indented(super().formatException(ei))  # type: ignore[arg-type]

    def formatStack(self, stack_info: str) -> str:
        """The stack of a call."""
        return indented(super().formatStack(stack_info))
