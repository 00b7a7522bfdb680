"""Registries of extensions: named values of one kind, built-in or from other installed packages.

A package registers an extension as an entry point of the group of its kind (``missionc.backends``, …). The metadata of
installed packages is read once, for the first name that is not built in; a package is imported for its first extension.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from functools import cache, reduce
from importlib import import_module
from typing import Any, Generic, TypeVar

from missionc.base.diagnostics.code import (
    EXTENSION_CLASH,
    EXTENSION_FAILED,
    EXTENSION_INTERFACE,
    EXTENSION_UNLOADABLE,
    Code,
)
from missionc.base.late_dataclass import dataclass

Value = TypeVar("Value")

INTERFACE = 1
"""Version of the interface between the compiler and extensions; a package declares its own in ``INTERFACE``."""

NAME = re.compile(r"[a-z][a-z0-9_]*")
"""Pattern of an extension's name."""


class Kind(Enum):
    """Kinds of extensions; the value is the last word of the entry point group."""

    BACKEND = "backends"
    PREDICATE = "predicates"
    DYNAMICS = "dynamics"
    EXPORT = "exports"
    SIMULATOR = "simulators"
    COMMAND = "commands"

    @property
    def group(self) -> str:
        return f"missionc.{self.value}"

    @property
    def noun(self) -> str:
        word: str = self.value
        return word if self is Kind.DYNAMICS else word.removesuffix("s")


@dataclass(frozen=True, slots=True)
class Extension:
    """Entry point of an installed package.

    Args:
        home: place of its value, ``module:attribute``.
        package: name of the distribution, with its ``version``.
    """

    kind: Kind
    name: str
    home: str
    package: str
    version: str

    @property
    def module(self) -> str:
        return self.home.partition(":")[0]

    @property
    def root(self) -> str:
        """Top-level module of its code."""
        return self.module.partition(".")[0]

    def __str__(self) -> str:
        return f"`{self.package}` {self.version}"


class ExtensionError(Exception):
    """Error for an extension that cannot be used: the reason in words, and one remedy."""

    def __init__(self, code: Code, message: str, help: str) -> None:
        super().__init__(message)
        self.code, self.message, self.help = code, message, help


class Unfit(ValueError):
    """Error for a value of an extension that is unsuitable; the text is the reason, in words for users."""


@cache
def installed() -> tuple[Extension, ...]:
    """All extensions of installed packages, by kind, name and package."""
    from importlib.metadata import distributions  # takes 50 ms, so not for missions with built-in names only

    groups = {kind.group: kind for kind in Kind}
    packages: dict[str, list[Extension]] = {}
    for package in distributions():
        entries = [each for each in package.entry_points if each.group in groups]
        if entries and package.name not in packages:  # the first on the path, as for imports
            packages[package.name] = [
                Extension(groups[each.group], each.name, each.value, package.name, package.version) for each in entries
            ]
    order = {kind: place for place, kind in enumerate(Kind)}
    found = [each for extensions in packages.values() for each in extensions]
    return tuple(sorted(found, key=lambda each: (order[each.kind], each.name, each.package)))


def attributed(error: BaseException) -> ExtensionError | None:
    """Attribute an error to an extension if its code was running when it was raised; None otherwise.

    A command of an extension runs the compiler, so an error of a command is not attributed to its package.
    """
    if isinstance(error, ExtensionError):
        return error
    known = installed() if installed.cache_info().currsize else ()
    commands = {each.module for each in known if each.kind is Kind.COMMAND}
    roots = {each.root: each for each in known}
    found, place = None, error.__traceback__
    while place:
        module = place.tb_frame.f_globals.get("__name__", "")
        if module not in commands:
            found = roots.get(module.partition(".")[0], found)
        place = place.tb_next
    if found is None:
        return None
    message = f"the package {found} failed: {failure(error)}"
    return ExtensionError(EXTENSION_FAILED, message, f"report it to the authors of `{found.package}`")


REGISTRIES: dict[Kind, Registry[Any]] = {}
"""Registries that are loaded."""


class Registry(Generic[Value]):
    """Values of one kind by name: built-in ones, then those of installed packages.

    Args:
        built_in: values, or their places ``module:attribute``.
        read: function from a name and the object at its entry point to its value.

    Raises:
        Unfit: raised by ``read`` if the object is not such a value.
    """

    def __init__(self, kind: Kind, built_in: Mapping[str, Value | str], read: Callable[[str, object], Value]) -> None:
        self.kind, self._read = kind, read
        self._values: dict[str, Value | str] = dict(built_in)
        self.built_in = tuple(built_in)
        """The names of those built in, in their order."""
        self._loaded: dict[Extension, Value] = {}
        REGISTRIES[kind] = self

    def __getitem__(self, name: str) -> Value:
        """Return the value with this name.

        Raises:
            KeyError: there is no such value.
            ExtensionError: the extension cannot be used.
        """
        if name in self._values:
            value = self._values[name]
            if isinstance(value, str):
                self._values[name] = value = resolved(value)
            return value
        provided = [each for each in self.extensions() if each.name == name]
        if not provided:
            raise KeyError(name)
        raise_clash(provided[0])
        if provided[0] not in self._loaded:
            self._loaded[provided[0]] = load(provided[0], self._read)
        return self._loaded[provided[0]]

    def get(self, name: str) -> Value | None:
        """Return the value with this name, or None if there is none.

        Raises:
            ExtensionError: the extension cannot be used.
        """
        return self[name] if name in self else None  # noqa: SIM401

    def usable(self, name: str) -> Value | None:
        """Value with this name; None if there is none or it cannot be used, for tools without error reports."""
        try:
            return self.get(name)
        except ExtensionError:
            return None

    def __contains__(self, name: object) -> bool:
        return name in self._values or any(each.name == name for each in self.extensions())

    def __iter__(self) -> Iterator[str]:
        """Iterate over all names; reads the metadata of installed packages."""
        return iter(dict.fromkeys((*self.built_in, *(each.name for each in self.extensions()))))

    def extensions(self) -> tuple[Extension, ...]:
        """Extensions of installed packages."""
        return tuple(each for each in installed() if each.kind is self.kind)

    def package(self, name: str) -> str:
        """Package that provides a name; empty for a built-in one."""
        return next((each.package for each in self.extensions() if each.name == name), "")

    def items_built_in(self) -> tuple[tuple[str, Value], ...]:
        """Built-in names, each with its value."""
        return tuple((name, self[name]) for name in self.built_in)

    @contextmanager
    def lent(self, name: str, value: Value) -> Iterator[None]:
        """Add a value for the duration of the context.

        Raises:
            ExtensionError: the name is taken.
        """
        if name in self:
            message = f"the name `{name}` of the {self.kind.noun} is taken"
            raise ExtensionError(EXTENSION_CLASH, message, "choose another name")
        self._values[name] = value
        try:
            yield
        finally:
            del self._values[name]

    def forget(self) -> None:
        """Reload extensions at their next use."""
        self._loaded.clear()

    def state(self, extension: Extension) -> ExtensionError | None:
        """Reason why one of its extensions cannot be used; None if it can."""
        try:
            raise_clash(extension)
            load(extension, self._read)
        except ExtensionError as error:
            return error
        return None


def raise_taken() -> None:
    """Raise if an extension has the name of a built-in value, so that words of missions are ambiguous.

    Raises:
        ExtensionError: an extension has such a name.
    """
    for each in installed():
        if each.kind in REGISTRIES and each.name in REGISTRIES[each.kind].built_in:
            raise_clash(each)


def raise_clash(extension: Extension) -> None:
    """Raise if the name of an extension is built in or also provided by another package.

    Raises:
        ExtensionError: the name is not unique.
    """
    which = f"the {extension.kind.noun} `{extension.name}`"
    if extension.name in REGISTRIES[extension.kind].built_in:
        message = f"{which} of {extension} has the same name as a built-in"
        raise ExtensionError(EXTENSION_CLASH, message, f"uninstall `{extension.package}`")
    same = [each for each in installed() if (each.kind, each.name) == (extension.kind, extension.name)]
    if len(same) > 1:
        message = f"{which} is provided by {' and by '.join(map(str, same))}"
        raise ExtensionError(EXTENSION_CLASH, message, f"uninstall `{same[1].package}` or `{same[0].package}`")


def load(extension: Extension, read: Callable[[str, object], Value]) -> Value:
    """Load the value of an extension.

    Raises:
        ExtensionError: the import fails, or the interface or the value is wrong.
    """
    of = f"the {extension.kind.noun} `{extension.name}` of {extension}"
    update = f"update or uninstall `{extension.package}`"
    try:
        interface = getattr(import_module(extension.root), "INTERFACE", None)
        if interface != INTERFACE:
            declares = f"declares interface {interface}" if isinstance(interface, int) else "declares no `INTERFACE`"
            message = f"{of}: its module `{extension.root}` {declares}; this compiler has interface {INTERFACE}"
            raise ExtensionError(EXTENSION_INTERFACE, message, update)
        if not NAME.fullmatch(extension.name):
            raise Unfit("its name must begin with a letter and have only lower-case letters, digits and `_`")
        return read(extension.name, resolved(extension.home))
    except ExtensionError:
        raise
    except ModuleNotFoundError as error:
        why = f"the module `{error.name}` is missing"
    except Unfit as error:
        why = str(error)
    except Exception as error:
        why = failure(error)
    raise ExtensionError(EXTENSION_UNLOADABLE, f"{of} cannot be loaded: {why}", update)


def resolved(home: str) -> Any:
    """Value at ``module:attribute``."""
    module, _, attributes = home.partition(":")
    return reduce(getattr, filter(None, attributes.split(".")), import_module(module))


def failure(error: BaseException) -> str:
    """Kind of an error and the line that raised it: ``ZeroDivisionError at check_world.py:42``."""
    place = error.__traceback__
    while place and place.tb_next:
        place = place.tb_next
    file = place.tb_frame.f_code.co_filename.replace("\\", "/").rpartition("/")[2] if place else ""
    return (
        f"{type(error).__name__} at {file}:{place.tb_lineno}"
        if place
        else f"{type(error).__name__} at an unknown place"
    )
