"""Template rendering for exports: names from missions enter a text only as literals of its language.

The template environment is a sandbox, and its ``finalize`` rejects values that did not pass a quoting filter: a
template that omits the filter does not render.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2.sandbox import SandboxedEnvironment

FOLDER = "templates"


class Quoted(str):
    """Text that is already quoted for the language of the template."""

    __slots__ = ()


def python(value: object) -> Quoted:
    """Python literal in ASCII for a string, a number, or a tuple of them."""
    assert _plain(value), value
    return Quoted(ascii(value))


def yaml(value: object) -> Quoted:
    """YAML scalar or flow sequence in ASCII.

    PyYAML reads ``1e-05`` as a word, so floats have a decimal point.

    Raises:
        TypeError: the value is of another type than a string, a number, a truth value or a tuple of these.
    """
    match value:
        case str():
            return Quoted('"' + "".join(map(_escaped, value)) + '"')
        case bool():
            return Quoted("true" if value else "false")
        case float():
            mantissa, mark, exponent = repr(value).partition("e")
            return Quoted(mantissa + (".0" if mark and "." not in mantissa else "") + mark + exponent)
        case int():
            return Quoted(value)
        case tuple():
            return Quoted("[" + ", ".join(map(yaml, value)) + "]")
        case _:
            raise TypeError(type(value).__name__)


def code(value: object) -> Quoted:
    """Word or number as Markdown code in backticks, whatever characters it contains."""
    text = "".join(letter if letter.isprintable() and letter != "`" else "?" for letter in str(value))
    return Quoted(f"`{text}`")


def render(template: str, /, **given: object) -> bytes:
    """Text of a template in this package, filled with the given values, as UTF-8."""
    return _environment().get_template(template).render(given).encode()


def _source(template: str) -> str:
    return (files("missionc.output.export") / FOLDER / template).read_text(encoding="utf-8")


@cache
def _environment() -> SandboxedEnvironment:
    from jinja2 import FunctionLoader, StrictUndefined
    from jinja2.sandbox import SandboxedEnvironment

    # These are not HTML: every language has its own filter, and `finalize` requires one.
    environment = SandboxedEnvironment(
        loader=FunctionLoader(_source),
        autoescape=False,
        undefined=StrictUndefined,
        finalize=_finalize,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(python=python, yaml=yaml, code=code)
    return environment


def _finalize(value: object) -> Quoted:
    if not isinstance(value, Quoted):
        raise TypeError("a value in a template is not quoted")
    return value


def _plain(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_plain, value))
    return type(value) in (str, int, float, bool)


def _escaped(letter: str) -> str:
    number = ord(letter)
    if letter in '"\\':
        return "\\" + letter
    if 0x20 <= number < 0x7F:
        return letter
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"
