"""Why a session ends before the browser goes."""

CLOSE_BAD = 1007
CLOSE_NOT_ALLOWED = 1008
CLOSE_TOO_BIG = 1009
CLOSE_TOO_SLOW = 1013
CLOSE_INTERNAL = 1011


class Closing(Exception):
    """The session ends now, with this close code of the WebSocket protocol (RFC 6455, 7.4)."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason
