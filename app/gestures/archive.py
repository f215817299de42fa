"""Zip files that others made: what they hold is checked before anything is unpacked.

A zip file of a few hundred bytes can unpack to gigabytes, hold a hundred thousand names, or be made
of entries that share their bytes (D. Fifield, "A better zip bomb", WOOT 2019). What an entry says
of its own size is never believed: :meth:`Archive.read` counts what comes out.
Source: APPNOTE.TXT 6.3.10 (PKWARE), sections 4.3 and 4.4.
"""

import io
import struct
import zipfile
from pathlib import PurePosixPath

from app.errors import Invalid

ZIP_MAX_BYTES = 64 << 20
"""Of a zip file, and of everything that is unpacked from it."""
MAX_ENTRIES = 65_535
"""What a zip file holds at most without the extension Zip64, which no set needs."""
MAX_NAME = 255
"""Bytes of an entry's name."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_REFUSED = {9: "Deflate64", 12: "bzip2", 14: "LZMA", 93: "Zstandard", 95: "XZ", 98: "PPMd"}
"""Of these a few bytes may become gigabytes at once, whatever is asked for."""
_ENCRYPTED = 0x1
_END, _ENTRY = b"PK\x05\x06", b"PK\x01\x02"
_END_BYTES, _ENTRY_BYTES, _LOCAL_BYTES = 22, 46, 30
_LARGEST_COMMENT = (1 << 16) - 1


class Archive:
    """A zip file in memory.

    Args:
        data: The whole file.

    Raises:
        Invalid: it is too large, or holds what no set needs; says what.
        zipfile.BadZipFile: it is damaged.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) > ZIP_MAX_BYTES:
            raise Invalid(f"the zip file is larger than {ZIP_MAX_BYTES >> 20} MiB")
        directory_at = _check_directory(data)
        self._file = zipfile.ZipFile(io.BytesIO(data))
        entries = self._file.infolist()
        _check_names(entries)
        _check_places(entries, directory_at)
        self.names = self._file.namelist()
        self._read = 0

    def read(self, name: str, limit: int) -> bytes:
        """An entry's bytes; more than ``limit`` are never unpacked.

        Raises:
            Invalid: it is larger, packed in a way that is not read, or makes all too large.
            KeyError: there is none of that name.
        """
        entry = self._file.getinfo(name)
        if entry.flag_bits & _ENCRYPTED:
            raise Invalid("is encrypted; pack the set without a password")
        if entry.compress_type not in _METHODS:
            number = entry.compress_type
            method = _REFUSED.get(number, f"method {number}")
            raise Invalid(f"is packed with {method}; pack the set with deflate, or store it")
        with self._file.open(entry) as stream:
            data = stream.read(limit + 1)
        if len(data) > limit:
            raise Invalid(f"is larger than {limit} bytes")
        self._read += len(data)
        if self._read > ZIP_MAX_BYTES:
            raise Invalid(f"makes the set larger than {ZIP_MAX_BYTES >> 20} MiB")
        return data


def _check_directory(data: bytes) -> int:
    """Count the entries before anything is made of them; gives where the directory begins."""
    end = len(data) - _END_BYTES
    if not (data[end : end + 4] == _END and data.endswith(b"\0\0")):
        end = data.rfind(_END, max(0, end - _LARGEST_COMMENT))
    if end < 0 or end + _END_BYTES > len(data):
        raise zipfile.BadZipFile("File is not a zip file")
    size: int
    offset: int
    size, offset = struct.unpack_from("<II", data, end + 12)
    if 0xFFFFFFFF in (size, offset) or data[end - 20 : end - 16] == b"PK\x06\x07":
        raise Invalid("the zip file uses Zip64, which a set of gestures never needs")
    begin = at = end - size
    count = 0
    while at < end:
        if at < 0 or data[at : at + 4] != _ENTRY or at + _ENTRY_BYTES > end:
            raise zipfile.BadZipFile("Bad magic number for central directory")
        name, extra, comment = struct.unpack_from("<HHH", data, at + 28)
        if name > MAX_NAME:
            raise Invalid(f"the zip file holds a name of {name} bytes; at most {MAX_NAME} are read")
        at += _ENTRY_BYTES + name + extra + comment
        count += 1
        if count > MAX_ENTRIES:
            raise Invalid(f"the zip file holds more than {MAX_ENTRIES} entries")
    return begin


def _check_names(entries: list[zipfile.ZipInfo]) -> None:
    taken: set[str] = set()
    for entry in entries:
        name = entry.filename
        parts = PurePosixPath(name).parts
        # zipfile cuts a name off at a NUL.
        plain = name and "\0" not in entry.orig_filename and "\\" not in name
        if not plain or name.startswith("/") or ".." in parts or ":" in name:
            raise Invalid(f"the zip file holds a name that is no plain path: {name[:60]!r}")
        if name in taken:
            raise Invalid(f"the zip file holds {name[:60]!r} twice")
        taken.add(name)


def _check_places(entries: list[zipfile.ZipInfo], directory_at: int) -> None:
    """Refuse entries that share bytes, with one another or with the directory."""
    begun = sorted(entries, key=lambda entry: entry.header_offset)
    ends = [entry.header_offset for entry in begun[1:]] + [directory_at]
    for entry, end in zip(begun, ends, strict=False):
        name = len(entry.orig_filename.encode("utf-8", "surrogateescape"))
        least = _LOCAL_BYTES + min(name, 1) + entry.compress_size
        if entry.header_offset < 0 or entry.header_offset + least > end:
            raise Invalid(f"the zip file's entry {entry.filename[:60]!r} overlaps another one")
