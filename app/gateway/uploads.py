"""Reading an upload: the size is watched while it streams in, not after."""

from dataclasses import dataclass

from fastapi import Request
from starlette.datastructures import UploadFile
from starlette.types import Message

from app.config import GatewaySettings
from app.errors import Invalid, RequestError, TooLarge
from app.gateway.unicode_text import NotUnicode, check_unicode
from app.gestures.records import SHARED

MAX_IMAGES = 50
MAX_BURST = 120
"""Images of a burst."""
OVERHEAD = 64 * 1024
"""Bytes of multipart wrapping that do not count."""


class UnsupportedMedia(RequestError):
    """A body of a kind that this route does not read."""

    default_code = "unsupported_media_type"
    status = 415


@dataclass(frozen=True)
class Upload:
    """The parts of a multipart body."""

    fields: dict[str, str]
    images: list[bytes]

    @property
    def burst(self) -> bool:
        """Whether the images are the frames of one burst."""
        return self.flag("burst", False)

    @property
    def gallery(self) -> str:
        """Id of the gallery that is meant."""
        return self.fields.get("gallery", SHARED)

    def flag(self, name: str, default: bool) -> bool:
        """A field that is ``true`` or ``false``.

        Raises:
            Invalid: it is something else.
        """
        text = self.fields.get(name, str(default).lower())
        if text not in ("true", "false"):
            raise Invalid(f"{name} is true or false, not {text[:40]!r}", field=name)
        return text == "true"


def _too_large(limit: int) -> TooLarge:
    return TooLarge(f"an upload may have {limit} bytes in all", limit=limit)


def _limited(request: Request, limit: int) -> Request:
    """The request with a body that raises once it is over ``limit`` bytes."""
    declared = request.headers.get("content-length", "0")
    if declared.isdecimal() and int(declared) > limit + OVERHEAD:
        raise _too_large(limit)
    seen = 0
    inner = request.receive

    async def receive() -> Message:
        nonlocal seen
        message = await inner()
        if message["type"] == "http.request":
            seen += len(message.get("body", b""))
            if seen > limit + OVERHEAD:
                raise _too_large(limit)
        return message

    return Request(request.scope, receive)


async def read_enrolment(request: Request, settings: GatewaySettings, known: set[str]) -> Upload:
    """Read a multipart body with ``images``; with the field ``burst`` more and larger ones.

    Which fields there are shows only at the end of the body, so what is too much for anything but
    a burst is refused then.

    Args:
        request: The request, its body unread.
        settings: The limits.
        known: Names of the text fields that are allowed beside ``burst``.

    Raises:
        TooLarge, UnsupportedMedia: as :func:`read_upload`.
        Invalid: a field that is not known, or no image, or too many.
    """
    most = max(settings.max_burst_bytes, settings.max_upload_bytes)
    upload = await read_upload(request, most, "images", MAX_BURST)
    if unknown := upload.fields.keys() - known - {"burst"}:
        raise Invalid(f"the field {min(unknown)!r} is not known", field=min(unknown))
    if not upload.burst:
        if sum(map(len, upload.images)) > settings.max_upload_bytes:
            raise _too_large(settings.max_upload_bytes)
        if len(upload.images) > MAX_IMAGES:
            raise Invalid(
                f"{len(upload.images)} images given; at most {MAX_IMAGES} are allowed, and "
                f"{MAX_BURST} with burst=true",
                field="images",
            )
    return upload


async def read_upload(
    request: Request, limit: int, image_field: str, most_images: int = MAX_IMAGES
) -> Upload:
    """Read a multipart body with text fields and images.

    Args:
        request: The request, its body unread.
        limit: Bytes allowed in all.
        image_field: Name of the fields that hold images.
        most_images: Files allowed.

    Raises:
        TooLarge: over the limit; raised as soon as it is.
        UnsupportedMedia: not multipart/form-data.
        Invalid: a field twice, unknown or of the wrong kind.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "multipart/form-data":
        raise UnsupportedMedia(f"send multipart/form-data, not {kind or 'nothing'}", given=kind)
    fields: dict[str, str] = {}
    images: list[bytes] = []
    limited = _limited(request, limit)
    async with limited.form(max_files=most_images, max_fields=8) as form:
        for name, value in form.multi_items():
            _check_text(name, "the name of a field")
            if isinstance(value, UploadFile):
                if name != image_field:
                    raise Invalid(f"files belong in {image_field!r}, not in {name!r}", field=name)
                image = await value.read()
                if len(image) > limit:
                    raise _too_large(limit)
                images.append(image)
            elif name == image_field:
                raise Invalid(f"{image_field!r} must be files", field=name)
            elif name in fields:
                raise Invalid(f"the field {name!r} was given twice", field=name)
            else:
                _check_text(value, name)
                fields[name] = value
    if sum(map(len, images)) > limit:
        raise _too_large(limit)
    return Upload(fields, images)


def _check_text(text: str, what: str) -> None:
    """Some encodings that a part may name bring what is no character."""
    try:
        check_unicode(text)
    except NotUnicode as error:
        raise Invalid(f"{what}: {error}", field=what) from None


async def read_image(request: Request, limit: int) -> Upload:
    """Read one image: the whole body, or the field ``image`` of a multipart body.

    Raises:
        TooLarge, Invalid, UnsupportedMedia: as :func:`read_upload`.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind == "multipart/form-data":
        upload = await read_upload(request, limit, "image")
        if len(upload.images) != 1:
            raise Invalid(f"send one image, not {len(upload.images)}", field="image")
        return upload
    if not kind.startswith("image/") and kind not in ("", "application/octet-stream"):
        raise UnsupportedMedia(f"send an image or multipart/form-data, not {kind}", given=kind)
    return Upload({}, [await _whole(request, limit)])


async def read_file(request: Request, limit: int, kinds: tuple[str, ...]) -> bytes:
    """Read a body that is one file.

    Args:
        request: The request, its body unread.
        limit: Bytes allowed.
        kinds: Media types that it may be said to have, the best first.

    Raises:
        TooLarge: over the limit; raised as soon as it is.
        UnsupportedMedia: it is said to be something else.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in kinds:
        raise UnsupportedMedia(f"send {kinds[0]}, not {kind or 'nothing'}", given=kind)
    return await _whole(request, limit)


async def _whole(request: Request, limit: int) -> bytes:
    parts = []
    size = 0
    async for part in _limited(request, limit).stream():
        size += len(part)
        if size > limit:
            raise _too_large(limit)
        parts.append(part)
    return b"".join(parts)
