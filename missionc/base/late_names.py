"""Lazy names: public names of a package, loaded from their modules at first use."""

from __future__ import annotations

from collections.abc import Callable


def late_names(package: str, homes: dict[str, tuple[str, ...]]) -> Callable[[str], object]:
    """Build the ``__getattr__`` of a package: each name is loaded from its module at first use."""

    def find(name: str) -> object:
        from importlib import import_module

        for home, names in homes.items():
            if name in names:
                return getattr(import_module(home), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find
