"""Registries of extensions: named values of one kind, built-in or from other installed packages.

A package registers an extension as an entry point of the group of its kind (``missionc.backends``, …). The metadata of
installed packages is read once, for the first name that is not built in; a package is imported for its first extension.
"""

from __future__ import annotations

import os
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
from missionc.base.late_dataclass import Record
from missionc.base.memory import exhausted
from missionc.base.signals import reraise_stop

Value = TypeVar("Value")

INTERFACE = 1
"""Version of the interface between the compiler and extensions; a package declares its own in ``INTERFACE``."""

NAME = re.compile(r"[a-z][a-z0-9_]*")
"""Pattern of an extension's name."""


INSTALL = "; or install the package that provides it"
"""End of the help line about an unknown name that an extension package may provide."""


class Kind(Enum):
    """Kinds of extensions; the value is the last part of the name of the entry point group, ``missionc.<value>``."""

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


class Extension(Record):
    """Extension that an installed package registers as an entry point.

    Args:
        home: location of the extension's value, ``module:attribute``.
        package: name of the distribution; ``version`` is the version of the distribution.
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
        """Top-level Python module of the extension's code."""
        return self.module.partition(".")[0]

    def __str__(self) -> str:
        return f"`{self.package}` {self.version}"


class ExtensionError(Exception):
    """Error for an extension that cannot be used or that failed: message, one remedy, and notes."""

    def __init__(self, code: Code, message: str, help: str, notes: tuple[str, ...] = ()) -> None:
        super().__init__(code, message, help, notes)
        self.code, self.message, self.help, self.notes = code, message, help, notes

    def __str__(self) -> str:
        notes = "".join(f"\n  = {note}" for note in self.notes)
        return f"{self.code.name}: {self.message}{notes}\n  help: {self.help}"


class Unfit(ValueError):
    """Error for an extension's value of the wrong form; its text is the reason, in words for users."""


@cache
def installed() -> tuple[Extension, ...]:
    """All extensions of installed packages, sorted by kind, name and package."""
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


@contextmanager
def guard(kind: Kind, name: str, *passed: type[Exception]) -> Iterator[None]:
    """Context that converts each error in the code of an extension, ``sys.exit`` included, to an error about the
    extension.

    Args:
        kind: kind of the extension; ``name`` is its name. Errors of built-in values are unchanged.
        passed: further types of errors that leave the context unchanged.

    Raises:
        ExtensionError: the code raised an error of another type.
    """
    try:
        yield
    except (Exception, SystemExit) as error:
        reraise_stop()
        if isinstance(error, (ExtensionError, *passed)) or exhausted(error):
            raise
        if kind in REGISTRIES and name in REGISTRIES[kind].built_in:
            raise
        raise failed(kind, name, error) from error


def failed(kind: Kind, name: str, error: BaseException) -> ExtensionError:
    """Error for an exception that the code of an extension raised."""
    fault = rejected(kind, name, f"failed: {_reported(error)}")
    return ExtensionError(fault.code, fault.message, f"{fault.help}; {TRACEBACK}", _text(error))


def rejected(kind: Kind, name: str, says: str) -> ExtensionError:
    """Error for a value that an extension returned and that cannot be used; ``says`` is the message without its
    subject."""
    found = next((each for each in installed() if (each.kind, each.name) == (kind, name)), None)
    help_ = f"report it to the authors of `{found.package}`" if found else f"correct the code of `{name}`"
    return ExtensionError(EXTENSION_FAILED, f"{_which(kind, name, found)} {says}", help_)


def _which(kind: Kind, name: str, extension: Extension | None) -> str:
    return f"the {kind.noun} `{name}`" + (f" of {extension}" if extension else "")


REGISTRIES: dict[Kind, Registry[Any]] = {}
"""Registries created so far, by kind of extension."""


class Registry(Generic[Value]):
    """Values of one kind by name: built-in values, then values of installed packages.

    Args:
        built_in: built-in values by name, or their locations ``module:attribute``.
        read: function from a name and the object at its entry point to the value; it raises ``Unfit`` for objects that
            have the wrong form.
    """

    def __init__(self, kind: Kind, built_in: Mapping[str, Value | str], read: Callable[[str, object], Value]) -> None:
        self.kind, self._read = kind, read
        self._values: dict[str, Value | str] = dict(built_in)
        self.built_in = tuple(built_in)
        """Names of the built-in values, in their order."""
        self._loaded: dict[Extension, Value] = {}
        REGISTRIES[kind] = self

    def __getitem__(self, name: str) -> Value:
        """Return the value with this name.

        Raises:
            KeyError: there is no value with this name.
            ExtensionError: the extension with this name cannot be used.
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
            ExtensionError: the extension with this name cannot be used.
        """
        return self[name] if name in self else None  # noqa: SIM401

    def usable(self, name: str) -> Value | None:
        """Value with this name; None if there is no such value or its extension cannot be used."""
        try:
            return self.get(name)
        except ExtensionError:
            return None

    def __contains__(self, name: object) -> bool:
        return name in self._values or any(each.name == name for each in self.extensions())

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of all values, built-in names first; this reads the metadata of installed packages."""
        return iter(dict.fromkeys((*self.built_in, *(each.name for each in self.extensions()))))

    def extensions(self) -> tuple[Extension, ...]:
        """Extensions of this registry's kind in installed packages."""
        return tuple(each for each in installed() if each.kind is self.kind)

    def package(self, name: str) -> str:
        """Name of the package that provides a value; empty for a built-in value."""
        return next((each.package for each in self.extensions() if each.name == name), "")

    def items_built_in(self) -> tuple[tuple[str, Value], ...]:
        """Pairs of name and value for each built-in value."""
        return tuple((name, self[name]) for name in self.built_in)

    @contextmanager
    def lent(self, name: str, value: Value, same: Callable[[Value], bool]) -> Iterator[None]:
        """Context in which the registry has a further value under ``name``.

        Args:
            same: predicate; true if an installed value of this name may be replaced.

        Raises:
            ExtensionError: the name is taken by another value.
        """
        if name in self._values or (name in self and not same(self[name])):
            found = next((each for each in self.extensions() if each.name == name), None)
            message = f"the name `{name}` of the {self.kind.noun} is taken" + (f" by {found}" if found else "")
            help_ = f"give it another name, or uninstall `{found.package}`" if found else "give it another name"
            raise ExtensionError(EXTENSION_CLASH, message, help_)
        self._values[name] = value
        try:
            yield
        finally:
            del self._values[name]

    def forget(self) -> None:
        """Discard the loaded extensions, so that each is loaded again at its next use."""
        self._loaded.clear()

    def state(self, extension: Extension) -> ExtensionError | None:
        """Error because of which an extension of this registry cannot be used; None if the extension is usable."""
        try:
            raise_clash(extension)
            load(extension, self._read)
        except ExtensionError as error:
            return error
        return None


def raise_taken() -> None:
    """Check that no installed extension has the name of a built-in value, which would make words of missions ambiguous.

    Raises:
        ExtensionError: an extension has the name of a built-in value.
    """
    for each in installed():
        if each.kind in REGISTRIES and each.name in REGISTRIES[each.kind].built_in:
            raise_clash(each)


def raise_clash(extension: Extension) -> None:
    """Check that the name of an extension is neither built in nor provided by another package.

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
    """Import an extension and convert its object to a value with ``read``.

    Raises:
        ExtensionError: the import fails, or the package's interface version or the object is wrong.
    """
    of = _which(extension.kind, extension.name, extension)
    update = f"update or uninstall `{extension.package}`"
    notes: tuple[str, ...] = ()
    try:
        interface = getattr(import_module(extension.root), "INTERFACE", None)
        if interface != INTERFACE:
            declares = f"declares interface {interface}" if isinstance(interface, int) else "declares no `INTERFACE`"
            message = f"{of}: its module `{extension.root}` {declares}; this compiler has interface {INTERFACE}"
            raise ExtensionError(EXTENSION_INTERFACE, message, update)
        raise_misnamed(extension.name)
        return read(extension.name, resolved(extension.home))
    except ExtensionError:
        raise
    except ModuleNotFoundError as error:
        why = f"the module `{error.name}` is missing"
    except Unfit as error:
        why = str(error)
    except (Exception, SystemExit) as error:
        reraise_stop()
        why, notes, update = _reported(error), _text(error), f"{update}; {TRACEBACK}"
    raise ExtensionError(EXTENSION_UNLOADABLE, f"{of} cannot be loaded: {why}", update, notes)


def raise_misnamed(name: object) -> None:
    """Check that a name has the form of an extension name: lower-case letters, digits and ``_``, a letter first.

    Raises:
        Unfit: the name has another form.
    """
    if not (isinstance(name, str) and NAME.fullmatch(name)):
        raise Unfit("its name needs lower-case letters, digits and `_`, a letter first")


def resolved(home: str) -> Any:
    """Object at the location ``module:attribute``, imported if necessary."""
    module, _, attributes = home.partition(":")
    return reduce(getattr, filter(None, attributes.split(".")), import_module(module))


TRACEBACK = "MISSIONC_TRACEBACK=1 shows the traceback"


def _text(error: BaseException) -> tuple[str, ...]:
    """Message of an error as a tuple of one note (at most 200 characters), or empty."""
    text = " ".join(str(error).split())[:200]
    return (text,) if text else ()


def _reported(error: BaseException) -> str:
    """Type of an error, and the innermost line of extension code or user code that raised it."""
    import sysconfig  # for failures alone
    import traceback

    if os.environ.get("MISSIONC_TRACEBACK"):
        traceback.print_exception(error)
    roots = {each.root for each in installed()}
    libraries = tuple(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))

    def counts(module: str, file: str) -> bool:
        root = module.partition(".")[0]
        return root in roots or (root != "missionc" and not file.startswith(libraries))

    return failure(error, counts)


def failure(error: BaseException, counts: Callable[[str, str], bool] = lambda module, file: True) -> str:
    """Type of an error and the line that raised it, as text: ``ZeroDivisionError at check_world.py:42``.

    Args:
        counts: predicate of a module name and a file name; the reported line is the innermost for which it is true.
    """
    found, place = "", error.__traceback__
    while place:
        file = place.tb_frame.f_code.co_filename
        if not file.startswith("<") and counts(place.tb_frame.f_globals.get("__name__", ""), file):
            found = f" at {os.path.basename(file)}:{place.tb_lineno}"
        place = place.tb_next
    if isinstance(error, SyntaxError) and error.filename:
        found = f" at {os.path.basename(error.filename)}:{error.lineno}"
    return f"{type(error).__name__}{found}"
