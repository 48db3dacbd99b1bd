"""A page served to this machine alone, under an address that nobody can guess."""

import hmac
import os
import secrets
import sys
import threading
import webbrowser
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

__all__ = ["PageServer"]

_LOCAL = "127.0.0.1"
_TIMEOUT = 30  # of a silent connection [s]
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
        self._server = ThreadingHTTPServer((_LOCAL, 0), _make_handler(page.encode(), f"/{token}/"))
        self._server.daemon_threads = True
        port = self._server.server_port
        self.url = f"http://{_LOCAL}:{port}/{token}/"

    def run(self, tell: Callable[[str], object]) -> None:
        """Open the page in the user's browser, if there is one, and serve until Ctrl-C."""
        if _has_browser():
            # Some browsers return only when they are closed.
            threading.Thread(target=webbrowser.open, args=(self.url,), daemon=True).start()
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


def _make_handler(page: bytes, path: str) -> type[BaseHTTPRequestHandler]:
    """Return a handler that answers one path with the page, and all else with 404."""

    class PageHandler(BaseHTTPRequestHandler):
        server_version, sys_version = "umbra", ""
        timeout = _TIMEOUT

        def do_GET(self) -> None:
            self._answer(has_body=True)

        def do_HEAD(self) -> None:
            self._answer(has_body=False)

        def _answer(self, *, has_body: bool) -> None:
            port = self.connection.getsockname()[1]
            is_here = self.headers.get("Host", "") in {f"{_LOCAL}:{port}", f"localhost:{port}"}
            asked = self.path.partition("?")[0].encode("utf-8", "replace")
            if not is_here or not hmac.compare_digest(asked, path.encode()):
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            self.send_response(HTTPStatus.OK)
            for name, value in _HEADERS.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(page)))
            self.end_headers()
            if has_body:
                self.wfile.write(page)

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
