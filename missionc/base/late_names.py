"""Lazy imports: public names of a package that are loaded from their modules at first use."""

from __future__ import annotations

from collections.abc import Callable


def late_names(package: str, homes: dict[str, tuple[str, ...]]) -> Callable[[str], object]:
    """Function for the ``__getattr__`` of a package that loads each public name from its module at first use.

    Args:
        package: name of the package, for error messages.
        homes: public names by the module that defines them.
    """

    def find(name: str) -> object:
        from importlib import import_module

        for home, names in homes.items():
            if name in names:
                return getattr(import_module(home), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find
