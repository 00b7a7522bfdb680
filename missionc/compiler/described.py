"""Described parameters: options of a function from one table, for its signature, help and checks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from inspect import Parameter, signature
from numbers import Real
from typing import Any, NamedTuple, TypeVar

from missionc.backends.options import DESCRIBED, Described, Kind, OneOf, Options, Switch, Whole
from missionc.backends.options import Real as RealNumber
from missionc.base.diagnostics.suggest import nearest

Function = TypeVar("Function", bound=Callable[..., Any])


class Entry(NamedTuple):
    """One keyword parameter of a function: its name, its default and its help text."""

    name: str
    default: object
    help: str


def described(entries: Iterable[Entry]) -> Callable[[Function], Function]:
    """Decorator that replaces a function's ``**`` parameter, in signature and docstring, by the listed parameters."""
    listed = tuple(entries)

    def decorate(function: Function) -> Function:
        own = signature(function)
        kept = [each for each in own.parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
        kept += [Parameter(each.name, Parameter.KEYWORD_ONLY, default=each.default) for each in listed]
        function.__signature__ = own.replace(parameters=kept)  # type: ignore[attr-defined]
        lines = "".join(f"\n        {each.name}: {each.help}" for each in listed)
        function.__doc__ = f"{function.__doc__}\n    Options:{lines}\n    "
        return function

    return decorate


def known(function: str, given: Mapping[str, object], names: Iterable[str]) -> None:
    """Check that a function has all given parameters.

    Raises:
        TypeError: a parameter is unknown.
    """
    listed = list(names)
    for name in given:
        if name not in listed:
            near = nearest(name, listed)
            hint = f"did you mean `{near}`?" if isinstance(near, str) else f"it has {', '.join(listed)}"
            raise TypeError(f"`{function}` has no parameter `{name}`; {hint}")


def _entry(option: Described) -> Entry:
    return Entry(
        option.name, option.default, f"{option.help} {_values(option.kind)[0].upper()}{_values(option.kind)[1:]}."
    )


def _values(kind: Kind) -> str:
    match kind:
        case OneOf(words):
            return f"one of {', '.join(map(repr, words))}"
        case Whole(least, most):
            return f"a whole number from {least} to {most}"
        case RealNumber(least, most):
            return f"a number from {least:g} to {most:g}"
        case Switch():
            return "True or False"


PLANNER_OPTIONS = tuple(map(_entry, DESCRIBED.values()))


def planner_options(function: str, given: Mapping[str, Any], others: Options | None) -> Options:
    """Planner options from keyword arguments by their names in ``backends.options``.

    Options that are not given have their values in ``others``.

    Raises:
        TypeError: an option is unknown.
        ValueError: an option has an invalid value.
    """
    known(function, given, DESCRIBED)
    chosen: dict[str, Any] = {}
    for name, value in given.items():
        option = DESCRIBED[name]
        number = isinstance(option.kind, RealNumber) and isinstance(value, Real) and not isinstance(value, bool)
        chosen[name] = float(value) if number else value
        text = value if isinstance(value, str) else repr(chosen[name])
        if chosen[name] is not option.default and not option.kind.admits(text):
            raise ValueError(f"`{name}` is {_values(option.kind)}, not {value!r}")
    return replace(others or Options(), **chosen)
