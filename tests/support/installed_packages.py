"""Temporarily installed packages of extensions: a module, and the metadata from pip."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from missionc.base.extensions import REGISTRIES, installed

EntryPoints = Mapping[str, Mapping[str, str]]
"""Place of each extension's value, by group and name."""


@contextmanager
def package(
    folder: Path, name: str, entries: EntryPoints, code: str | None = None, version: str = "1.0"
) -> Iterator[None]:
    """Context with a package in a folder, or one with the given code.

    Args:
        code: code of its module, which has the package's name.
    """
    metadata = folder / f"{name}-{version}.dist-info"
    metadata.mkdir(parents=True, exist_ok=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n", encoding="utf-8")
    groups = [
        f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in own.items()) for group, own in entries.items()
    ]
    (metadata / "entry_points.txt").write_text("\n".join(groups), encoding="utf-8")
    if code is not None:
        (folder / f"{name}.py").write_text(code, encoding="utf-8")
    before = set(sys.modules)
    try:
        with on_path(folder):
            yield
    finally:
        for module in set(sys.modules) - before:
            if module.partition(".")[0] == name:
                del sys.modules[module]


@contextmanager
def source_package(source: Path, folder: Path) -> Iterator[None]:
    """Context with a package as in `pip install --editable`: sources in place, metadata in a folder."""
    project = tomllib.loads((source / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    with on_path(source), package(folder, project["name"], project["entry-points"], version=project["version"]):
        yield


@contextmanager
def on_path(folder: Path) -> Iterator[None]:
    sys.path.insert(0, str(folder))
    forget_installed()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        forget_installed()


def forget_installed() -> None:
    """Read the metadata of installed packages again at next use."""
    installed.cache_clear()
    for registry in REGISTRIES.values():
        registry.forget()
