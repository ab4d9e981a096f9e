"""Answers to HTTP methods other than GET, which the library websockets leaves out."""

from __future__ import annotations

import re

from websockets.asyncio.server import ServerConnection

_REFUSED = (
    b"HTTP/1.1 405 Method Not Allowed\r\nAllow: GET, HEAD\r\nContent-Length: 0\r\n"
    b"Connection: close\r\nX-Content-Type-Options: nosniff\r\n\r\n"
)
_MOST = 16  # letters of a method


class Connection(ServerConnection):
    """A connection that takes HEAD for a GET, and refuses other methods with status 405.

    Attributes:
        head: Whether it was HEAD, so that the answer has no body.
    """

    head = False
    _begins: bytes | None = b""  # all that has arrived, until the method is known
    _refused = False

    def data_received(self, data: bytes) -> None:
        """Look at the method, and pass all on but what is refused."""
        if self._refused:
            return  # the rest of a body, so that the answer is read before the connection closes
        if self._begins is not None:
            data, self._begins = self._begins + data, None
            if re.fullmatch(rb"[A-Z]{1,%d}" % _MOST, data):
                self._begins = data
                return
            found = re.match(rb"([A-Z]{1,%d}) " % _MOST, data)
            if found and found[1] == b"HEAD":
                self.head, data = True, b"GET" + data[len(b"HEAD") :]
            elif found and found[1] != b"GET":
                self._refused = True
                self.transport.write(_REFUSED)
                self.transport.write_eof()
                return
        super().data_received(data)

    def eof_received(self) -> None:
        """Close what was refused."""
        if self._refused:
            self.transport.close()
        else:
            super().eof_received()
