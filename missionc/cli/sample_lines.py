"""Sources of sample lines during a flight: standard input, UDP datagrams, or a growing recording."""

from __future__ import annotations

import os
import socket
import stat
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from missionc.verification.monitoring.live.mcap_poses import McapPoses

LONGEST = 1 << 20
"""Maximum length of a line, bytes; a longer one is cut, and then not valid JSON."""

PIECE, PAUSE = 1 << 20, 0.05
"""Maximum number of bytes of a recording that are read at once, and seconds between two attempts."""

LOOPBACK = "127.0.0.1"


def of_standard_input() -> Iterator[str]:
    """Yield the lines of standard input, each as soon as it arrives."""
    while line := sys.stdin.buffer.readline(LONGEST):
        yield line.decode(errors="replace")


def of_socket(listening: socket.socket) -> Iterator[str]:
    """Yield the lines of incoming datagrams, without end."""
    with listening:
        while True:
            data = listening.recv(1 << 16)
            yield from data.decode(errors="replace").splitlines() or [""]


def of_recording(file: Path, poses: McapPoses) -> Iterator[str]:
    """Yield the poses in a recording as lines of samples until it is closed; waits for data that is not written yet.

    Args:
        file: path of the recording.
        poses: reader of the recording's poses.

    Raises:
        BrokenRecordingError: the file is not MCAP, or has been truncated.
        OSError: the file cannot be read.
    """
    from missionc.verification.monitoring.live.mcap_poses import BrokenRecordingError

    with open(os.open(file, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb") as recording:
        if not stat.S_ISREG(os.fstat(recording.fileno()).st_mode):
            raise BrokenRecordingError("it is not a regular file")
        while not poses.over:
            if data := recording.read(PIECE):
                yield from poses.feed(data)
            elif os.fstat(recording.fileno()).st_size < recording.tell():
                raise BrokenRecordingError("the recording became shorter during reading")
            else:
                time.sleep(PAUSE)


def listen(host: str, port: int) -> socket.socket:
    """Open a UDP socket that receives datagrams.

    Raises:
        OSError: the address does not exist, or is in use.
    """
    family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    listening = socket.socket(family, kind, protocol)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        listening.bind(place)
    except OSError:
        listening.close()
        raise
    return listening


def port_of(value: str) -> tuple[str, int]:
    """Parse ``[HOST:]PORT``; the default host is this machine's loopback address.

    Raises:
        click.UsageError: the text has another form.
    """
    host, _, port = value.rpartition(":")
    if not (port.isascii() and port.isdigit() and int(port) < 1 << 16):
        raise click.UsageError(f"`{value}` is not a UDP address; write [HOST:]PORT with a port up to 65535")
    return host.strip("[]") or LOOPBACK, int(port)
