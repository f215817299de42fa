"""What browsers say of whose page a request is (W3C Fetch Metadata).

No page can set or leave out these headers. Programs can, and say nothing by them: so a request that
another site's page caused is refused or asked about *before* a secret in it is looked at, and is
never let off being counted after that.
"""

from starlette.datastructures import Headers


def is_foreign(headers: Headers) -> bool:
    """Whether another site's page caused a request, or a page on another port of this host."""
    return headers.get("sec-fetch-site", "") in ("cross-site", "same-site")


def is_part_of_a_page(headers: Headers) -> bool:
    """Whether a request is for a picture, a frame, a script of some page, and not for a page."""
    mode, destination = headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")
    return mode not in (None, "navigate") or destination not in (None, "document")
