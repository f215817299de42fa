"""Zip files made to do harm: refused by name of what is wrong, before anything is unpacked."""

import io
import struct
import tracemalloc
import zipfile

import pytest

from app.errors import Invalid
from app.gestures import archive as module
from app.gestures.archive import Archive
from app.gestures.setfile import read_zip

TOML = b"format = 1\n"


def packed(method: int = zipfile.ZIP_DEFLATED, **files: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as file:
        for name, data in files.items():
            file.writestr(name, data)
    return out.getvalue()


def refusal(data: bytes) -> str:
    with pytest.raises(Invalid) as caught:
        read_zip(data)
    return caught.value.message


@pytest.mark.parametrize(
    ("method", "name"), [(zipfile.ZIP_BZIP2, "bzip2"), (zipfile.ZIP_LZMA, "LZMA")]
)
def test_what_unpacks_without_bounds_is_refused_by_name(method: int, name: str) -> None:
    data = packed(method, **{"gestures.toml": bytes(100 << 20)})
    assert len(data) < 50_000
    tracemalloc.start()
    try:
        said = refusal(data)
        assert tracemalloc.get_traced_memory()[1] < 10 << 20
    finally:
        tracemalloc.stop()
    assert f"gestures.toml is packed with {name}; pack the set with deflate" in said


def test_a_method_of_no_known_name_is_refused_by_its_number() -> None:
    data = bytearray(packed(**{"gestures.toml": TOML}))
    at = data.find(b"PK\x01\x02") + 10
    data[at : at + 2] = struct.pack("<H", 77)
    assert "is packed with method 77" in refusal(bytes(data))


def test_deflate_and_what_is_only_stored_are_read() -> None:
    for method in (zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED):
        assert Archive(packed(method, **{"gestures.toml": TOML})).read("gestures.toml", 99) == TOML


def test_what_an_entry_says_of_its_size_is_not_believed() -> None:
    data = bytearray(packed(x=bytes(1 << 20)))
    for mark, place in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        at = data.find(mark) + place
        data[at : at + 4] = struct.pack("<I", 5)
    # Five bytes come out of what says so, and then its checksum is wrong.
    with pytest.raises((Invalid, zipfile.BadZipFile)):
        Archive(bytes(data)).read("x", 100)
    with pytest.raises(Invalid, match="is larger than 100 bytes"):
        Archive(packed(x=bytes(1 << 20))).read("x", 100)


def test_all_that_is_read_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    archive = Archive(packed(x=bytes(600)))
    monkeypatch.setattr(module, "ZIP_MAX_BYTES", 1000)
    archive.read("x", 600)
    with pytest.raises(Invalid, match="makes the set larger"):
        archive.read("x", 600)
    with pytest.raises(Invalid, match="the zip file is larger"):
        Archive(bytes(1001))


def test_entries_are_counted_before_anything_is_made_of_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = packed(a=b"", b=b"", c=b"", d=b"")
    monkeypatch.setattr(module, "MAX_ENTRIES", 3)
    monkeypatch.setattr(zipfile, "ZipFile", None)  # not even opened
    with pytest.raises(Invalid, match="more than 3 entries"):
        Archive(data)


def test_a_name_that_is_too_long_is_refused() -> None:
    assert "a name of 300 bytes; at most 255" in refusal(packed(**{"x" * 300: b""}))


@pytest.mark.parametrize("name", ["../x", "a/../../x", "/etc/passwd", "C:x", "a\\b"])
def test_a_name_that_leads_elsewhere_is_refused(name: str) -> None:
    assert "no plain path" in refusal(packed(**{"gestures.toml": TOML, name: b""}))


def test_a_name_with_a_nul_is_refused() -> None:
    data = packed(gesturesXtoml=TOML).replace(b"gesturesXtoml", b"gestures\0toml")
    assert "no plain path" in refusal(data)


def test_a_name_that_comes_twice_is_refused() -> None:
    data = packed(gesture1=TOML, gesture2=TOML).replace(b"gesture2", b"gesture1")
    assert "holds 'gesture1' twice" in refusal(data)


def test_entries_that_share_their_bytes_are_refused() -> None:
    data = bytearray(packed(a=b"a" * 50, b=b"b" * 50))
    second = data.rfind(b"PK\x01\x02")
    data[second + 42 : second + 46] = struct.pack("<I", 0)
    assert "overlaps another one" in refusal(bytes(data))


def test_the_extension_for_large_files_is_refused() -> None:
    data = bytearray(packed(a=b""))
    data[-10:-6] = b"\xff" * 4
    assert "uses Zip64" in refusal(bytes(data))


@pytest.mark.parametrize("size", [0, 10, 22, 100])
def test_what_is_no_zip_file_is_refused(size: int) -> None:
    assert "neither a readable folder nor a readable zip file" in refusal(bytes(size))
