"""TOML that others wrote: whether it is simple enough to be parsed, told in one pass over it.

A parser of TOML takes time that grows with the square of a key's parts, and a call of itself for
each bracket within a bracket. A set needs three of either.
Source: TOML 1.0.0, sections Keys, String and Comment.
"""

import re

from app.errors import Invalid

MAX_LINE = 128 * 1024
"""Characters."""
MAX_DEPTH = 32
"""Brackets within brackets."""
MAX_PARTS = 8
"""Parts of a dotted key."""

_TOKEN = re.compile(
    r"""
      "{3} (?: [^"\\] | \\. | "(?!"") )*+ "{3,5}
    | '{3} (?: [^'] | '(?!'') )*+ '{3,5}
    | (?P<open> "{3} | '{3} )
    | " (?: [^"\\\n] | \\. )*+ "
    | ' [^'\n]*+ '
    | \# [^\n]*+
    | (?P<sign> [\[\]{}=,.\n] )
    | (?P<quote> ["'] )
    """,
    re.VERBOSE | re.DOTALL,
)


def check_simple(text: str) -> None:
    """Do nothing if ``text`` is simple enough. Takes time in proportion to its length.

    Raises:
        Invalid: a line is too long, a key has too many parts, brackets are nested too deep, or a
            string does not end.
    """
    longest = max(map(len, text.split("\n")))
    if longest > MAX_LINE:
        raise Invalid(f"has a line of {longest} characters; at most {MAX_LINE} are read")
    depth, parts = 0, 1
    for token in _TOKEN.finditer(text):
        if token["open"] or token["quote"]:
            line = text.count("\n", 0, token.start()) + 1
            raise Invalid(f"has a string without an end in line {line}")
        match token["sign"]:
            case None:
                continue
            case ".":
                parts += 1
                if parts > MAX_PARTS:
                    line = text.count("\n", 0, token.start()) + 1
                    raise Invalid(
                        f"has a key of more than {MAX_PARTS} parts in line {line}; a set has none"
                    )
                continue
            case "[" | "{":
                depth += 1
                if depth > MAX_DEPTH:
                    line = text.count("\n", 0, token.start()) + 1
                    raise Invalid(f"has brackets nested deeper than {MAX_DEPTH} in line {line}")
            case "]" | "}":
                depth -= 1
        parts = 1
