"""The file in which a latched stop outlives its process: laid down once, overwritten in place.

Two blocks of :data:`BLOCK` bytes, each with a rising number, what is kept, and a checksum. A change
goes to the block that does not hold the newest, so that a write which was cut short spoils only
that one, and is seen. Overwriting needs no room: on a file system that does not copy on write a
stop can be kept on a full disk. Everything here may wait for a disk and belongs in a thread.
"""

import contextlib
import errno
import os
import stat
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

BLOCK = 4096
"""Bytes; what disks and file systems write at a time."""
_SIZE = 2 * BLOCK
_HEAD = struct.Struct("<8sQII")
_MAGIC = b"FHLATCH1"
_FLAGS = os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY
"""Opening a FIFO or a device must not wait for somebody at its other end."""


class Unreadable(Exception):
    """There is something, and it does not say whether a stop is kept."""


class _Block(NamedTuple):
    number: int
    kept: bytes


class LatchFile:
    """Keeps up to 4 KiB; nothing kept is ``b""``.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> bytes | None:
        """What is kept; None when there is no file.

        A file of before there were blocks held nothing but what was kept, as a JSON object.

        Raises:
            Unreadable: it is no regular file, damaged, or a write to it was cut short, so that
                nobody knows whether something should be kept.
            OSError: it cannot be read.
        """
        try:
            handle = os.open(self._path, os.O_RDONLY | _FLAGS)
        except FileNotFoundError:
            return None
        with _closing(handle):
            if not stat.S_ISREG(os.fstat(handle).st_mode):
                raise Unreadable("it is not a regular file")
            data = os.pread(handle, _SIZE + 1, 0)
        if data.startswith(b"{"):
            return data
        blocks = [block for block in _blocks(data) if block is not None]
        if len(data) != _SIZE or not blocks:
            raise Unreadable("it is damaged")
        newest = max(blocks)
        if len(blocks) < 2 and not newest.kept:
            raise Unreadable("a write to it was cut short")
        return newest.kept

    def keep(self, what: bytes) -> None:
        """Keep ``what`` in place of what was kept; it is on the disk, and was read back, after.

        Raises:
            OSError: it is not.
        """
        if len(what) > BLOCK - _HEAD.size:
            raise OSError(f"{len(what)} bytes are too many to keep")
        if not self._overwrite(what):
            self._lay_down(what)
        _flush(self._path.parent, os.O_RDONLY | os.O_DIRECTORY)
        try:
            same = self.load() == what
        except Unreadable as error:
            raise OSError(f"it reads back wrong: {error}") from error
        if not same:
            raise OSError("it reads back differently")

    def holds(self, what: bytes) -> bool:
        """Whether ``what`` is kept, in blocks that can be overwritten.

        Raises:
            OSError: the file cannot be read, or could not be written.
        """
        try:
            same = self.load() == what and self._path.lstat().st_size == _SIZE
        except Unreadable:
            return False
        if same and not os.access(self._path, os.W_OK):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        return same

    def _overwrite(self, what: bytes) -> bool:
        """Write into the older block; False when this is not a file of ours."""
        try:
            if not stat.S_ISREG(os.lstat(self._path).st_mode):
                return False
            handle = os.open(self._path, os.O_RDWR | os.O_NOFOLLOW | _FLAGS)
        except FileNotFoundError:
            return False
        with _closing(handle):
            if not stat.S_ISREG(os.fstat(handle).st_mode):
                return False
            data = os.pread(handle, _SIZE + 1, 0)
            first, second = _blocks(data)
            if len(data) != _SIZE or (first is None and second is None):
                return False
            at = 0 if first is None or (second is not None and second > first) else BLOCK
            newest = max(block for block in (first, second) if block is not None)
            _write(handle, _pack(newest.number + 1, what), at)
            os.fsync(handle)
        return True

    def _lay_down(self, what: bytes) -> None:
        """Make the file anew, whatever is in its place."""
        part = self._path.with_name(self._path.name + ".part")
        part.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | _FLAGS
        handle = os.open(part, flags, 0o600)
        with _closing(handle):
            _write(handle, _pack(1, what) + _pack(2, what), 0)
            os.fsync(handle)
        part.replace(self._path)


def _pack(number: int, what: bytes) -> bytes:
    body = struct.pack("<QI", number, len(what)) + what
    return (_HEAD.pack(_MAGIC, number, len(what), zlib.crc32(body)) + what).ljust(BLOCK, b"\0")


def _blocks(data: bytes) -> tuple[_Block | None, _Block | None]:
    return _unpack(data[:BLOCK]), _unpack(data[BLOCK:_SIZE])


def _unpack(block: bytes) -> _Block | None:
    if len(block) != BLOCK:
        return None
    magic, number, length, checksum = _HEAD.unpack_from(block)
    what = block[_HEAD.size : _HEAD.size + length]
    body = struct.pack("<QI", number, length) + what
    if magic != _MAGIC or len(what) != length or zlib.crc32(body) != checksum:
        return None
    return _Block(number, what)


def _write(handle: int, data: bytes, at: int) -> None:
    written = os.pwrite(handle, data, at)
    if written != len(data):
        raise OSError(f"only {written} of {len(data)} bytes were written")


def _flush(path: Path, flags: int) -> None:
    handle = os.open(path, flags | _FLAGS)
    with _closing(handle):
        os.fsync(handle)


@contextlib.contextmanager
def _closing(handle: int) -> Iterator[None]:
    try:
        yield
    finally:
        os.close(handle)
