"""Resource folders of the compiler, in the installed package or in the source tree."""

from __future__ import annotations

from pathlib import Path


def folder(name: str) -> Path:
    """Path of a resource folder: ``grammars``, ``missions`` or ``docs/errors``.

    Raises:
        FileNotFoundError: the installation lacks the folder.
    """
    package = Path(__file__).resolve().parents[1]
    for root in (package, package.parent):
        if (root / name).is_dir():
            return root / name
    raise FileNotFoundError(name)
