"""Doors of processes: their children, the ports that they listen on, what others may open."""

import os
import sys
from pathlib import Path

import pytest

LISTENING = "0A"

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="Windows lists no sockets in /proc")


def find_family(pid):
    """Return a process and all that descend from it."""
    found = [pid]
    for one in found:
        for task in Path(f"/proc/{one}/task").glob("*/children"):
            try:
                found += map(int, task.read_text().split())
            except OSError:  # it has ended
                continue
    return found


def find_doors(pids):
    """Return the TCP ports and the Unix sockets that processes listen on."""
    owned = set()
    for pid in pids:
        for link in Path(f"/proc/{pid}/fd").glob("*"):
            try:
                owned.add(str(link.readlink()))
            except OSError:  # it has closed it
                continue
    doors = []
    for table in ("tcp", "tcp6"):
        rows = [row.split() for row in Path(f"/proc/net/{table}").read_text().splitlines()[1:]]
        doors += [
            int(row[1].rpartition(":")[2], 16)
            for row in rows
            if row[3] == LISTENING and f"socket:[{row[9]}]" in owned
        ]
    rows = [row.split() for row in Path("/proc/net/unix").read_text().splitlines()[1:]]
    accepts = 0x10000
    doors += [
        row[7] if len(row) > 7 else "unnamed"
        for row in rows
        if int(row[3], 16) & accepts and f"socket:[{row[6]}]" in owned
    ]
    return doors


def run_as_nobody(work):
    """
    Call a function in a forked child as another user; return the lines that it gives.

    Without the rights to become somebody else the test skips.
    """
    if os.geteuid() != 0:
        pytest.skip("Windows, or not root: nobody else can be tried")
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.setgroups([])
            os.setgid(65534)
            os.setuid(65534)
            os.write(write, "\n".join(map(str, work())).encode())
            status = 0
        finally:
            os._exit(status)
    os.close(write)
    with os.fdopen(read) as answers:
        said = answers.read()
    assert os.waitpid(child, 0)[1] == 0
    return said.splitlines()
