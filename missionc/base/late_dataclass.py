"""Lazily built data classes: as ``dataclasses.dataclass``, with methods generated at first use instead of at import.

The standard library generates and compiles code for each method of each class. A check of a mission loads two hundred
data classes, most with few instances or none, and the generation took half of its time. Here the standard library
generates ``__init__`` and the table of fields at first access, or after a few instances. All classes share the
functions for comparison, hashing, printing and immutability. For a type checker the decorator *is*
``dataclasses.dataclass``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from inspect import get_annotations
from operator import attrgetter
from reprlib import recursive_repr
from types import MethodType
from typing import TYPE_CHECKING, Any, TypeVar, dataclass_transform

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(*, frozen=False, slots, eq=True, match_args=True, weakref_slot=False):
        """Data class decorator as in the standard library, for classes with slots; inherited fields have no
        defaults.
        """
        return lambda cls: _made(cls, frozen, eq, match_args, ("__weakref__",) if weakref_slot else ())


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
class RecordType(type):
    """Metaclass of ``Record``: converts each subclass without its own ``__slots__`` to a data class."""

    def __new__(
        cls, name: str, bases: tuple[type, ...], parts: dict[str, Any], *, eq: bool = True, weakref_slot: bool = False
    ) -> RecordType:
        written = super().__new__(cls, name, bases, parts)
        if "__slots__" in parts:
            return written
        return _made(written, True, eq, True, ("__weakref__",) if weakref_slot else ())


class Record(metaclass=RecordType):
    """Base class of values: each subclass becomes a frozen data class with slots, without a decorator.

    Inherited fields have no defaults. Instances of a subclass declared with ``eq=False`` are compared by identity.
    """

    __slots__ = ()


LATE = ("__init__", "__dataclass_fields__", "__dataclass_params__")
"""Attributes that the standard library generates at the first use of any of them."""

T = TypeVar("T", bound=type)

FEW = 25
"""Number of instances of a class that are filled field by field, before the standard library generates ``__init__``."""

KEPT = ("__annotations__", "__module__", "__post_init__")
"""Attributes of the written class, besides field defaults, that the standard library needs to generate ``__init__``."""


class _Late:
    """Placeholder in a class for an attribute that is generated at first access."""

    def __init__(self, name: str, make: Callable[[], None]) -> None:
        self.name, self.make = name, make

    def __get__(self, instance: object, owner: type) -> Any:
        self.make()
        return getattr(owner if instance is None else instance, self.name)


class _Init(_Late):
    """Placeholder for ``__init__`` until it is accessed or the class has more than a few instances."""

    def __init__(self, make: Callable[[], None], names: tuple[str, ...], defaults: dict[str, Any]) -> None:
        super().__init__("__init__", make)
        self.names, self.defaults, self.left = names, defaults, FEW

    def __get__(self, instance: object, owner: type) -> Any:
        if isinstance(instance, type):  # as ``inspect.signature`` of Python 3.13 binds it
            return MethodType(super().__get__(None, instance), instance)
        if instance is None or not self.left:
            return super().__get__(instance, owner)
        self.left -= 1
        return partial(self.fill, instance)

    def fill(self, instance: object, /, *given: object, **named: object) -> None:
        """Set all fields of an instance; if the arguments do not match the fields, the standard library raises the
        error."""
        if len(given) == len(self.names) and not named:
            for name, value in zip(self.names, given, strict=True):
                object.__setattr__(instance, name, value)
            return
        values = {**dict(zip(self.names, given, strict=False)), **named}
        lacking = [name for name in self.names if name not in values]
        regular = len(values) == len(given) + len(named) and len(values) + len(lacking) == len(self.names)
        if not regular or not all(name in self.defaults for name in lacking):
            super().__get__(instance, type(instance))(*given, **named)
            return
        for name in lacking:
            values[name] = _default(self.defaults[name])
        for name, value in values.items():
            object.__setattr__(instance, name, value)


def _default(written: Any) -> object:
    if not _is_field(written):
        return written
    return written.default_factory() if written.default is dataclasses.MISSING else written.default


def _made(written: T, frozen: bool, eq: bool, match_args: bool, more_slots: tuple[str, ...]) -> T:
    """Copy of a written class with slots and data class methods.

    Args:
        more_slots: slots besides the fields.
    """
    kinds, inherited = get_annotations(written), tuple(getattr(written, "__match_args__", ()))
    own = tuple(name for name, kind in kinds.items() if "ClassVar" not in str(kind).partition("[")[0])
    names = inherited + own
    defaults = {name: written.__dict__[name] for name in own if name in written.__dict__}
    cls = _with_slots(written, own, more_slots)

    def make() -> None:
        parts = {name: written.__dict__[name] for name in KEPT if name in written.__dict__}
        above = {name: kind for each in written.__mro__[1:] for name, kind in get_annotations(each).items()}
        parts["__annotations__"] = {name: above[name] for name in inherited} | kinds
        parts |= {"__qualname__": cls.__qualname__, "__doc__": "With a text, none is made.", **defaults}
        twin: type = dataclasses.dataclass(frozen=frozen, eq=False, repr=False, slots=True)(
            type(cls.__name__, (), parts)
        )
        for name in LATE:
            setattr(cls, name, twin.__dict__[name])

    def those(which: str) -> tuple[str, ...]:
        """Names of the fields that take part in ``which`` (``compare``, ``repr``, …)."""
        return tuple(name for name in names if not _is_field(defaults.get(name)) or getattr(defaults[name], which))

    methods: dict[str, Any] = {name: _Late(name, make) for name in LATE}
    if those("init") == names and not hasattr(cls, "__post_init__"):
        methods["__init__"] = _Init(make, names, {name: each for name, each in defaults.items() if _has_default(each)})
    if match_args:
        methods["__match_args__"] = those("init")
    methods["__repr__"] = _shown(those("repr"))
    if eq:
        values = _values(those("compare"))
        methods |= {"__eq__": _equal(values), "__hash__": _hashed(values) if frozen else None}
    if frozen:
        methods |= {"__setattr__": _unchanged, "__delattr__": _undeleted}
        methods |= {"__getstate__": _state(names), "__setstate__": _from_state(names)}
    for name, method in methods.items():
        if cls.__dict__.get(name) is None:
            setattr(cls, name, method)
    return cls


def _is_field(default: object) -> bool:
    return isinstance(default, dataclasses.Field)


def _has_default(written: Any) -> bool:
    given = (written.default, written.default_factory) if _is_field(written) else (written,)
    return any(each is not dataclasses.MISSING for each in given)


def _with_slots(cls: T, names: tuple[str, ...], more: tuple[str, ...]) -> T:
    without = {*names, "__dict__", "__weakref__"}
    held = {name: value for name, value in cls.__dict__.items() if name not in without}
    return type(cls)(cls.__name__, cls.__bases__, {**held, "__slots__": names + more, "__qualname__": cls.__qualname__})


def _values(names: tuple[str, ...]) -> Callable[[object], tuple[object, ...]]:
    """Function from an instance to the tuple of values of these fields."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda instance: tuple(getattr(instance, name) for name in names)


def _equal(values: Callable[[object], tuple[object, ...]]) -> Callable[[object, object], Any]:
    def equal(self: object, other: object) -> Any:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return equal


def _hashed(values: Callable[[object], tuple[object, ...]]) -> Callable[[object], int]:
    def hashed(self: object) -> int:
        return hash(values(self))

    return hashed


def _shown(names: tuple[str, ...]) -> Callable[[object], str]:
    @recursive_repr()
    def shown(self: object) -> str:
        return f"{self.__class__.__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return shown


def _state(names: tuple[str, ...]) -> Callable[[object], list[object]]:
    def state(self: object) -> list[object]:
        return [getattr(self, name) for name in names]

    return state


def _from_state(names: tuple[str, ...]) -> Callable[[object, Sequence[object]], None]:
    def restored(self: object, state: Sequence[object]) -> None:
        for name, value in zip(names, state, strict=True):
            object.__setattr__(self, name, value)

    return restored


def _unchanged(self: object, name: str, value: object) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _undeleted(self: object, name: str) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
