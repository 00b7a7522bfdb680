"""A disk of a few kilobytes, for this process and its children only.

in   a folder; later a size
out  a file system of that size is mounted on the folder, in a namespace of the process; or the reason why that is
impossible
"""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

NEW_NAMESPACES = 0x00020000 | 0x10000000
"""CLONE_NEWNS and CLONE_NEWUSER of Linux: mounts of its own, and the right to mount there."""
PRIVATE, AGAIN = 0x40000 | 0x4000, 0x20
"""MS_PRIVATE and MS_REC: nobody else sees what is mounted; MS_REMOUNT."""
ROOMY = 64 << 20
"""Initial size of a disk, bytes."""


def mount(folder: Path) -> str:
    """Mount a large enough disk on a folder; returns an error or an empty text.

    The process must have one thread.
    """
    user, group = os.getuid(), os.getgid()
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(NEW_NAMESPACES):
        return f"no namespace: {os.strerror(ctypes.get_errno())}"
    try:
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"0 {user} 1")
        Path("/proc/self/gid_map").write_text(f"0 {group} 1")
    except OSError as error:
        return f"no user namespace: {error}"
    if libc.mount(None, b"/", None, PRIVATE, None):
        return f"no private mounts: {os.strerror(ctypes.get_errno())}"
    return resize(folder, ROOMY, 0)


def resize(folder: Path, size: int, how: int = AGAIN) -> str:
    """Resize the disk mounted on a folder, at least to its contents; returns an error or an empty text."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mount(b"none", os.fsencode(folder), b"tmpfs", how, f"size={size}".encode()):
        return f"no small disk: {os.strerror(ctypes.get_errno())}"
    return ""
