"""The page's server: bounded, quiet, and its address in nobody else's sight."""

import os
import re
import socket
import stat
import struct
import subprocess
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest
from support.chromium import find_chromium

from umbra.web import server as page_server
from umbra.web.server import PageServer

PAGE = "<!doctype html><title>umbra</title>" + "x" * 5_000_000


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A home without a browser."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


@pytest.fixture
def serve(home):
    """Serve the page in a thread; return its server."""
    begun = []

    def start():
        server = PageServer(PAGE)
        thread = threading.Thread(target=server.run, args=(lambda _: None,), daemon=True)
        thread.start()
        begun.append((server, thread))
        return server

    yield start
    for server, thread in begun:
        server._server.shutdown()
        thread.join(10)
        assert not thread.is_alive()


def connect(server):
    return socket.create_connection(("127.0.0.1", urlsplit(server.url).port), timeout=60)


def ask(server):
    with urlopen(server.url, timeout=60) as answer:
        return answer.read()


def test_many_connections_neither_grow_nor_keep_the_browser_out(serve):
    server = serve()
    before = threading.active_count()
    silent = [connect(server) for _ in range(200)]
    try:
        assert ask(server) == PAGE.encode()
        # The oldest were closed; 31 and the browser's were held at most.
        assert silent[0].recv(1) == b""
        until = time.monotonic() + 60
        while threading.active_count() - before > 32 and time.monotonic() < until:
            time.sleep(0.05)
        assert threading.active_count() - before <= 32
        silent[-1].sendall(b"GET / HTTP/1.0\r\n\r\n")
        assert b" 404 " in silent[-1].recv(100)
    finally:
        for one in silent:
            one.close()


def test_a_connection_that_speaks_slowly_ends(serve, monkeypatch):
    monkeypatch.setattr(page_server, "_LONGEST", 1.0)

    def speak():
        for _ in range(600):
            slow.sendall(b"x")
            time.sleep(0.05)

    with connect(serve()) as slow, pytest.raises(OSError, match=r"reset|[Bb]roken|abort"):
        speak()


def test_clients_that_close_early_print_nothing(serve, capfd):
    server = serve()
    path = urlsplit(server.url).path
    for said in (b"", b"GET / HT", f"GET {path} HTTP/1.0\r\nHost: x\r\n".encode(), None):
        for _ in range(5):
            with connect(server) as client:
                host = f"127.0.0.1:{urlsplit(server.url).port}"
                whole = f"GET {path} HTTP/1.0\r\nHost: {host}\r\n\r\n".encode()
                client.sendall(whole if said is None else said)
                if said is None:
                    assert client.recv(20)  # in the midst of the page
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    assert ask(server) == PAGE.encode()
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(os.name == "nt", reason="Windows shows no other user's arguments")
def test_the_browser_is_given_a_file_and_no_address(serve, home, monkeypatch):
    told = home / "told"
    browser = home / "browser"
    browser.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {told}.part\nmv {told}.part {told}\n')
    browser.chmod(0o700)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    server = serve()
    until = time.monotonic() + 60
    while not told.exists() and time.monotonic() < until:
        time.sleep(0.02)
    (argument,) = told.read_text().split()
    token = urlsplit(server.url).path.strip("/")
    assert len(token) == 32
    assert token not in argument
    assert argument.startswith("file:///")
    opener = Path(urlsplit(argument).path)
    assert stat.S_IMODE(opener.stat().st_mode) == 0o600
    assert not opener.name.startswith(".")
    assert set(re.findall(r'(?:url=|href=")([^"]+)"', opener.read_text())) == {server.url}
    ask(server)
    while opener.exists() and time.monotonic() < until:
        time.sleep(0.02)
    assert not opener.exists()


@pytest.mark.skipif(os.name == "nt", reason="Windows shows no other user's arguments")
def test_a_browser_follows_the_file_to_the_page(serve, home, monkeypatch):
    chromium = find_chromium()
    if chromium is None:
        pytest.skip("there is no Chromium on this machine")
    served = []
    monkeypatch.setattr(PageServer, "_drop_opener", lambda _: served.append(1))
    opener = page_server._write_opener(serve().url)
    profile = home / "profile"
    words = [chromium, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}"]
    with subprocess.Popen(
        [*words, opener.as_uri()], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as browser:
        until = time.monotonic() + 60
        while not served and time.monotonic() < until:
            time.sleep(0.05)
        browser.terminate()
    assert served
