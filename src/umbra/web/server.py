"""A page served to this machine alone, under an address that nobody can guess."""

import hmac
import html
import os
import secrets
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

__all__ = ["PageServer"]

_LOCAL = "127.0.0.1"
_SILENT = 10.0  # after which a silent connection is closed [s]
_LONGEST = 60.0  # of a connection, however slowly it speaks [s]
_MOST = 32  # connections at a time
_OPENER = """<!doctype html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={url}">
<title>umbra view</title>
<p><a href="{url}">Open the model</a></p>
"""
_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class PageServer:
    """
    Serve one page on the loopback interface, at a free port.

    Parameters
    ----------
    page : str
        HTML.

    Attributes
    ----------
    url : str
        The only address that is answered; it holds a random token. Requests with the name of
        another host are refused, so that no other site can read the page (DNS rebinding).
    """

    def __init__(self, page: str) -> None:
        token = secrets.token_urlsafe(24)
        handler = _make_handler(page.encode(), f"/{token}/", self._drop_opener)
        self._server = _BoundedServer((_LOCAL, 0), handler)
        self._opener: Path | None = None
        port = self._server.server_port
        self.url = f"http://{_LOCAL}:{port}/{token}/"

    def run(self, tell: Callable[[str], object]) -> None:
        """Open the page in the user's browser, if there is one, and serve until Ctrl-C."""
        if _has_browser():
            # All users see the arguments of a program: the browser gets a file's name, and the
            # file, which only this user may read, leads on to the address.
            self._opener = _write_opener(self.url)
            # Some browsers return only when they are closed.
            address = self.url if self._opener is None else self._opener.as_uri()
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        else:
            tell("no browser was found here; open the address in one on this machine")
        try:
            self._server.serve_forever()
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def close(self) -> None:
        """Free the port."""
        self._server.server_close()
        self._drop_opener()

    def _drop_opener(self) -> None:
        """Remove the file that leads to the page, once it has."""
        opener, self._opener = self._opener, None
        if opener is not None:
            with suppress(OSError):
                opener.unlink()


class _BoundedServer(ThreadingHTTPServer):
    """
    A server of bounded work: a further connection closes the oldest, and each has an end.

    A user's browser, which asks once, is served while another program holds connections open.
    """

    daemon_threads = True
    request_queue_size = 128  # not yet accepted: one that is dropped asks again after seconds

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._begun: dict[Any, float] = {}  # by connection, oldest first
        self._guard = threading.Lock()

    def process_request(self, request: Any, client_address: Any) -> None:
        with self._guard:
            self._begun[request] = time.monotonic()
            self._end(list(self._begun)[:-_MOST])
        super().process_request(request, client_address)

    def service_actions(self) -> None:
        """End connections that are too old; called twice a second."""
        with self._guard:
            late = time.monotonic() - _LONGEST
            self._end([connection for connection, begun in self._begun.items() if begun < late])

    def _end(self, connections: list[Any]) -> None:
        for connection in connections:
            del self._begun[connection]
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)  # its thread sees the end, and closes it

    def shutdown_request(self, request: Any) -> None:
        with self._guard:
            self._begun.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exc_info()[1], OSError):  # who asked has gone
            super().handle_error(request, client_address)


def _write_opener(url: str) -> Path | None:
    """
    Write a page for this user's eyes alone that leads to an address; None if it cannot be.

    On Linux it lies in the home folder: browsers in packages (snap) see neither /tmp nor folders
    whose names begin with a dot.
    """
    homes = [Path.home()] if sys.platform.startswith("linux") and "HOME" in os.environ else []
    for folder in (*homes, Path(tempfile.gettempdir())):
        with suppress(OSError, ValueError):
            handle, name = tempfile.mkstemp(".html", "umbra-view-", folder)  # mode 600
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(_OPENER.format(url=html.escape(url)))
            return Path(name).absolute()
    return None


def _make_handler(
    page: bytes, path: str, served: Callable[[], object]
) -> type[BaseHTTPRequestHandler]:
    """
    Return a handler that answers one path with the page, and all else with 404.

    ``served`` is called once the page has gone.
    """

    class PageHandler(BaseHTTPRequestHandler):
        server_version, sys_version = "umbra", ""
        timeout = _SILENT

        def do_GET(self) -> None:
            self._answer(has_body=True)

        def do_HEAD(self) -> None:
            self._answer(has_body=False)

        def _answer(self, *, has_body: bool) -> None:
            port = self.connection.getsockname()[1]
            is_here = self.headers.get("Host", "") in {f"{_LOCAL}:{port}", f"localhost:{port}"}
            requested = self.path.partition("?")[0].encode("utf-8", "replace")
            if not is_here or not hmac.compare_digest(requested, path.encode()):
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            self.send_response(HTTPStatus.OK)
            for name, value in _HEADERS.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(page)))
            self.end_headers()
            if has_body:
                self.wfile.write(page)
                served()

        def log_message(self, *_: object) -> None:
            """Log nothing."""

    return PageHandler


def _has_browser() -> bool:
    """Return whether a browser with a window can open here."""
    if os.environ.get("BROWSER"):
        return True
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True
