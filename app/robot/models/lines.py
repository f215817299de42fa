"""Where in a TOML file a key stands: tomllib tells lines only of what is not TOML at all."""

import re
import tomllib

Path = tuple[str | int, ...]
"""Keys and, in arrays of tables, numbers from 0, as pydantic's ``loc``."""

_HEADER = re.compile(r"^\s*\[(\[)?\s*(?P<name>[^\[\]]+?)\s*\]")
_KEY = re.compile(r"""^\s*(?P<name>(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')"""
                  r"""(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""")  # fmt: skip
_WORD = re.compile(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""")
_ENDS = {'"""': re.compile(r'(?<!\\)"""'), "'''": re.compile("'''")}
_TEXT = re.compile(r'"""|\'\'\'|"(?:[^"\\]|\\.)*"|\'[^\']*\'|#.*|[\[\]{}]')


def key_lines(text: str) -> dict[Path, int]:
    """The line (from 1) of each key and table header of a TOML file that tomllib accepts.

    Keys inside inline tables have no entry of their own; :func:`line_of` takes the key before them.
    """
    found: dict[Path, int] = {(): 1}
    counts: dict[Path, int] = {}
    table: Path = ()
    depth, inside = 0, ""
    for number, line in enumerate(text.splitlines(), start=1):
        rest = line
        if inside:
            end = _ENDS[inside].search(rest)
            if end is None:
                continue
            rest, inside = rest[end.end() :], ""
        elif depth == 0:
            header, key = _HEADER.match(line), _KEY.match(line)
            if header:
                table = _enter(header["name"], bool(header[1]), counts)
                found.setdefault(table, number)
                continue
            if key:
                path = table
                for word in _words(key["name"]):
                    path = (*path, word)
                    found.setdefault(path, number)
                rest = line[key.end() :]
        depth, inside = _scan(rest, depth)
    return found


def line_of(lines: dict[Path, int], path: Path) -> int:
    """The line of ``path``, or of the nearest key or table that holds it."""
    while path not in lines:
        path = path[:-1]
    return lines[path]


def syntax_line(error: tomllib.TOMLDecodeError) -> int:
    """The line that tomllib speaks of."""
    told = re.search(r"line (\d+)", str(error))
    return int(told[1]) if told else 1


def _words(name: str) -> list[str]:
    return [word.strip("\"'") for word in _WORD.findall(name)]


def _enter(name: str, array: bool, counts: dict[Path, int]) -> Path:
    """The path of the table that a header opens."""
    path: Path = ()
    words = _words(name)
    for place, word in enumerate(words):
        path = (*path, word)
        if array and place == len(words) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _scan(text: str, depth: int) -> tuple[int, str]:
    """How deep in brackets, and in which long string, the text ends."""
    at = 0
    while (part := _TEXT.search(text, at)) is not None:
        at, word = part.end(), part[0]
        if word in _ENDS:
            end = _ENDS[word].search(text, at)
            if end is None:
                return depth, word
            at = end.end()
        elif word in "[{":
            depth += 1
        elif word in "]}":
            depth -= 1
    return depth, ""
