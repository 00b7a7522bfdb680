"""Lines of samples as they come: on standard input, or in datagrams on a port."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator

import click

LONGEST = 1 << 20
"""Bytes of a line; a longer one is cut, and then no JSON."""

LOOPBACK = "127.0.0.1"


def of_standard_input() -> Iterator[str]:
    """The lines of standard input, each as soon as it is there."""
    while line := sys.stdin.buffer.readline(LONGEST):
        yield line.decode(errors="replace")


def of_socket(listening: socket.socket) -> Iterator[str]:
    """The lines of the datagrams that come; there is no end to them."""
    with listening:
        while True:
            data = listening.recv(1 << 16)
            yield from data.decode(errors="replace").splitlines() or [""]


def listen(host: str, port: int) -> socket.socket:
    """A socket for datagrams.

    Raises:
        OSError: the system has no such place, or another program listens there.
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
    """``[HOST:]PORT``; this machine's own where no host is named."""
    host, _, port = value.rpartition(":")
    if not (port.isascii() and port.isdigit() and int(port) < 1 << 16):
        raise click.UsageError(f"`{value}` is not of the form [HOST:]PORT, with a port up to 65535")
    return host.strip("[]") or LOOPBACK, int(port)
