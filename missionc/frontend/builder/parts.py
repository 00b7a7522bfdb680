"""Parts of a mission as Python objects: formulas, quantities, shapes and agents, with the operators of Python.

A part contains a node of the syntax tree, whose span is the Python expression that built it. The operators of the
language are methods of ``Formula``, generated from ``language.operators``. Instead of a part, every function also
accepts its text in the mission language: ``"2 m"``, ``"every drone: base"``.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from inspect import Parameter, Signature
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, TypeVar, cast

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import DEEPEST, Limits
from missionc.base.source import Source, Span
from missionc.base.units import Metric
from missionc.frontend.builder.call_site import call_site
from missionc.frontend.syntax import ast, show_tree
from missionc.frontend.syntax.parse import passages, read_passage
from missionc.frontend.syntax.tokens import nameable
from missionc.ir.language.operator import Bounds, Fixity, Operator
from missionc.ir.language.operators import OPERATORS

LARGEST = Limits().formula_nodes
"""Maximum number of operators in a part, with repeated subformulas counted repeatedly."""

Node = TypeVar("Node")
FormulaLike: TypeAlias = "Formula | bool | str"
QuantityLike: TypeAlias = "Quantity | float | str"
ShapeLike: TypeAlias = "Shape | str"
AgentsLike: TypeAlias = "Agents | str"
NamedLike: TypeAlias = "Part | str"
PointLike: TypeAlias = "Sequence[QuantityLike] | str"
Range: TypeAlias = "tuple[QuantityLike, QuantityLike]"
"""Range of integers, both ends included."""


Made = TypeVar("Made", bound="Part")


def _both_ways(join: Callable[[Any, Any], Made]) -> tuple[Callable[[Any, Any], Made], Callable[[Any, Any], Made]]:
    """Two methods of a binary operator: with the part on its left, and with the part on its right."""
    return lambda self, other: join(self, other), lambda self, other: join(other, self)


class Part:
    """Part of a mission: a node of its syntax tree, with Python operators."""

    __slots__ = ("depth", "node", "size")
    __array_ufunc__ = None  # numpy delegates `array_scalar <= part` to the part
    template: ClassVar[str] = "group _ = {}"
    """Declaration into which the text of a part is inserted for parsing."""
    show: ClassVar[Any] = staticmethod(show_tree.agents)
    """Function that prints the node."""

    def __init__(self, node: object, *parts: Part, chained: Part | None = None) -> None:
        """Create a part from its node.

        Args:
            parts: operands of the part.
            chained: part that this one extends, as in ``a & b & c``.
        """
        self.node: Any = node
        self.depth: int = 1 + max((part.depth for part in parts), default=0)
        self.size: int = 1 + sum(part.size for part in parts)
        if chained is not None:
            self.depth, self.size = max(self.depth, chained.depth), self.size + chained.size
        if self.depth > DEEPEST or self.size > LARGEST:
            much = f"{self.depth} operators deep" if self.depth > DEEPEST else f"of {self.size} operators"
            raise ValueError(f"a part {much}; name its inner parts with `Mission.let` or `Mission.param`")

    def __str__(self) -> str:
        return str(type(self).show(self.node))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self}>"

    def __bool__(self) -> bool:
        raise TypeError(
            "parts of a mission have no truth value in Python: write `&` for `and`, `|` for `or`, `~` for `not`, "
            "`>>` for `implies`, and `(a <= x) & (x <= b)` for `a <= x <= b`"
        )

    def __eq__(self, other: object) -> bool:
        raise TypeError(
            "parts of a mission are not compared with `==`: write `.iff(…)` between formulas, `<=` or `>=` between "
            "quantities"
        )

    __hash__ = object.__hash__
    __iter__ = None  # otherwise iteration over indices would never end

    def __getitem__(self, indices: Any) -> Any:
        """Member of a family by its indices: ``lane[2]``, ``rack[0, 1]``."""
        return type(self)(_member_of_family(self.node, indices))


class Formula(Part):
    """Formula about the team or one agent; its methods are the operators of the language.

    ``f & g``, ``f | g``, ``~f`` and ``f >> g`` are ``and``, ``or``, ``not`` and ``implies``. Times are seconds or texts
    such as ``"5 steps"``; the last bound of a window may be ``"end"``.
    """

    __slots__ = ()
    template = "let _ = {}"
    show: ClassVar[Any] = staticmethod(show_tree.formula)
    if TYPE_CHECKING:

        def __getattr__(self, operator: str) -> Callable[..., Any]: ...

    __and__, __rand__ = _both_ways(lambda left, right: _chain("and", left, right))
    __or__, __ror__ = _both_ways(lambda left, right: _chain("or", left, right))

    __rshift__, __rrshift__ = _both_ways(lambda left, right: _applied("implies", (formula(left), formula(right))))

    def __invert__(self) -> Formula:
        return _applied("not", (self,))

    def for_each(self, **ranges: Range) -> Formula:
        """Conjunction over every integer in a range: ``f.for_each(i=(0, 9))`` is ``for i in 0..9: f``."""
        return self._for("every", ranges)

    def for_some(self, **ranges: Range) -> Formula:
        """Disjunction over every integer in a range: ``f.for_some(i=(0, 9))`` is ``for some i in 0..9: f``."""
        return self._for("some", ranges)

    def _for(self, kind: str, ranges: Mapping[str, Range]) -> Formula:
        span = call_site()
        if not ranges:
            raise TypeError("name an index and its range: `i=(0, 9)`")
        indices = tuple(
            ast.Index(span, declared_name(index), quantity(low).node, quantity(high).node)
            for index, (low, high) in ranges.items()
        )
        return Formula(ast.ForEach(span, kind, span, indices, self.node), self)


class Measure(Part):
    """Part that can be compared with a quantity."""

    __slots__ = ()

    def __le__(self, other: QuantityLike) -> Formula:
        return self.compared("<=", other)

    def __lt__(self, other: QuantityLike) -> Formula:
        return self.compared("<", other)

    def __ge__(self, other: QuantityLike) -> Formula:
        return self.compared(">=", other)

    def __gt__(self, other: QuantityLike) -> Formula:
        return self.compared(">", other)

    def compared(self, operator: str, other: QuantityLike) -> Formula:
        right = quantity(other)
        return Formula(ast.Compare(call_site(), operator, self.node, right.node), self, right)


class Quantity(Measure):
    """Number with its unit, parameter, resource, state, distance, or arithmetic expression."""

    __slots__ = ()
    template = "param _ = {}"
    show: ClassVar[Any] = staticmethod(show_tree.loose)

    __add__, __radd__ = _both_ways(lambda left, right: _arithmetic("+", left, right))
    __sub__, __rsub__ = _both_ways(lambda left, right: _arithmetic("-", left, right))
    __mul__, __rmul__ = _both_ways(lambda left, right: _arithmetic("*", left, right))
    __truediv__, __rtruediv__ = _both_ways(lambda left, right: _arithmetic("/", left, right))

    def __neg__(self) -> Quantity:
        return Quantity(ast.Negative(call_site(), self.node), self)


class Count(Measure):
    """Number of agents that ``count`` finds, for comparisons: ``f.count(hops=1) >= 2``, or ``== 2``."""

    __slots__ = ()

    def __str__(self) -> str:
        return show_tree.formula(self.node).removesuffix(" >= 0")

    def compared(self, operator: str, other: QuantityLike) -> Formula:
        number = quantity(other)
        return Formula(replace(self.node, span=call_site(), comparison=operator, number=number.node), self, number)

    def __eq__(self, other: object) -> Formula:  # type: ignore[override]
        return self.compared("=", cast(QuantityLike, other))

    __hash__ = object.__hash__


class Shape(Part):
    """Set of points; ``a + b`` is the union, ``a * b`` the intersection, ``a - b`` the difference."""

    __slots__ = ()
    template = "region _ = {}"
    show: ClassVar[Any] = staticmethod(show_tree.shape_text)

    __add__, __radd__ = _both_ways(lambda left, right: _combined("+", left, right))
    __mul__, __rmul__ = _both_ways(lambda left, right: _combined("*", left, right))
    __sub__, __rsub__ = _both_ways(lambda left, right: _combined("-", left, right))


class Region(Formula, Shape):
    """Named region: as a formula, true of an agent whose centre is inside; as a shape, its set of points."""

    __slots__ = ()
    template = "region _ = {}"


class Agents(Formula):
    """Team, group, single agent, or members of a team; as a formula, true of the agents in it.

    ``drone[0]`` is an agent, ``drone[0:3]`` the first three: as in Python, the end is excluded.
    """

    __slots__ = ()
    template = "group _ = {}"

    def __getitem__(self, index: QuantityLike | slice | tuple[QuantityLike, ...]) -> Agents:
        span = call_site()
        match self.node, index:
            case ast.Name(), tuple():
                return Agents(_member_of_family(self.node, index))
            case ast.Member(_, ast.Name() as name, low, None), _ if not isinstance(name, ast.Indexed):
                team: ast.Name = ast.Indexed(span, name.text, (low,), span)
            case ast.Name() as name, _:
                team = name
            case _:
                raise TypeError(f"`{self}` has no members of its own")
        if not isinstance(index, slice):
            return Agents(ast.Member(span, team, quantity(cast(QuantityLike, index)).node))
        if index.stop is None or index.step is not None:
            raise TypeError(f"write both ends, and no step: `{self}[0:3]`")
        last = quantity(index.stop - 1)
        return Agents(ast.Member(span, team, quantity(0 if index.start is None else index.start).node, last.node))

    def every(self, body: FormulaLike) -> Formula:  # type: ignore[override, unused-ignore]
        """Formula that is true if ``body`` is true for each of these agents: ``every drone: f``."""
        return self._quantified("every", None, body)

    def some(self, body: FormulaLike) -> Formula:
        """Formula that is true if ``body`` is true for at least one of these agents: ``some drone: f``."""
        return self._quantified("some", None, body)

    def at_least(self, number: QuantityLike, body: FormulaLike) -> Formula:
        """Formula that is true if ``body`` is true for ``number`` or more of these agents: ``at least 2 drone: f``."""
        return self._quantified("at least", number, body)

    def without_any(self, number: QuantityLike, body: FormulaLike) -> Formula:
        """Formula that is true if ``body``, about the team, stays true after the loss of any ``number`` of these
        agents.
        """
        return self._quantified("without any", number, body)

    def _quantified(self, kind: str, number: QuantityLike | None, body: FormulaLike) -> Formula:
        inner = formula(body)
        least = None if number is None else quantity(number).node
        return Formula(ast.Quantified(call_site(), kind, least, self.node, inner.node), inner)

    def satisfies(self, body: FormulaLike) -> Formula:
        """Formula that is true if ``body`` is true for this single agent: ``drone[0]: f``."""
        inner = formula(body)
        return Formula(ast.OneAgent(call_site(), self.node, inner.node), inner)


# ---------------------------------------------------------------- conversions


def formula(value: FormulaLike) -> Formula:
    """Convert a Python value to a formula: a part, True or False, or a text such as ``"every drone: base"``.

    Raises:
        TypeError: the value is not a formula.
        ValueError: the text is not a formula.
    """
    if isinstance(value, bool):
        return Formula(ast.Truth(call_site(), value))
    return _part(Formula, value, "a formula, such as `base & ~fire`")


def quantity(value: QuantityLike) -> Quantity:
    """Convert a Python value to a quantity: a part, a number in SI units, or a text such as ``"2 m"``.

    Numbers are rounded to 15 digits.

    Raises:
        TypeError: the value is not a quantity.
        ValueError: the text is not a quantity, or the number is not finite.
    """
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(f"{float(value):.{Limits().digits}g}")
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ValueError(f"expected a finite number, found {value}")
        node = ast.Number(call_site(), abs(number))
        return Quantity(ast.Negative(node.span, node) if number < 0 else node)
    return _part(Quantity, value, "a number, or a text such as `2 m`")


def tight(value: QuantityLike) -> str:
    """Text of a quantity, with arithmetic in brackets."""
    return show_tree.tight(quantity(value).node)


def shape(value: ShapeLike) -> Shape:
    """Convert a part, or a text such as ``"box (0, 0) to (2, 1)"``, to a shape.

    Raises:
        TypeError: the value is not a shape.
        ValueError: the text is not a shape.
    """
    return _part(Shape, value, "a shape, such as `box((0, 0), (2, 1))`")


def agents(value: AgentsLike) -> Agents:
    """Convert a part, or a text such as ``"drone[0..2]"``, to agents.

    Raises:
        TypeError: the value is not a team, group or agent.
        ValueError: the text is not a set of agents.
    """
    return _part(Agents, value, "a team, a group or an agent")


def point(value: PointLike) -> ast.Point:
    """Convert two or three quantities to a point, metres.

    Raises:
        TypeError: the value is not a sequence of coordinates.
    """
    if isinstance(value, str):
        return cast(ast.Beacon, read_text("beacon _ = {}", value)).position
    if isinstance(value, Part) or not isinstance(value, Iterable):
        raise TypeError(f"expected a point such as `(1, 2)`, found {value!r}")
    coordinates: list[QuantityLike] = list(value)
    return ast.Point(call_site(), tuple(quantity(each).node for each in coordinates))


def points(value: PointLike | Iterable[PointLike]) -> tuple[ast.Point, ...]:
    """Convert a list of points, or a single point, to points."""
    if isinstance(value, str):
        return (point(value),)
    listed: list[Any] = list(value)
    alone = bool(listed) and isinstance(listed[0], Real | Quantity | str)
    return (point(cast(PointLike, listed)),) if alone else tuple(map(point, listed))


def name_of(value: NamedLike) -> ast.Name:
    """Name of a region, a graph or a beacon, given as the declared part or as text.

    Raises:
        TypeError: the value has no name.
    """
    if isinstance(value, str):
        value = region(value)
    if not isinstance(value, Part) or not isinstance(value.node, ast.Name):
        raise TypeError(f"expected a declared part or its name, found {value!r}")
    return value.node


def region(name: str) -> Region:
    """Reference to a region by its name as written in a mission; a member of a family may have indices."""
    return _part(Region, name, "a name")


def declared_name(text: str) -> ast.Name:
    """Parse the name in a declaration; ``lane[i in 0..2]`` declares a family.

    Raises:
        TypeError: the name is not a text.
        ValueError: the text is not a name.
    """
    if not isinstance(text, str):
        raise TypeError(f"expected a name, found {text!r}")
    if not nameable(text.partition("[")[0].strip()):
        raise ValueError(f"invalid name `{text}`: use letters a to z, digits and `_`, without a digit first")
    return cast(ast.Param, read_text("param {} = 0", text)).name


Kind = TypeVar("Kind", bound=Part)


def _part(kind: type[Kind], value: object, expected: str) -> Kind:
    if isinstance(value, kind):
        return value
    if not isinstance(value, str):
        raise TypeError(f"expected {expected}, found {value!r}")
    match read_text(kind.template, value):
        case ast.Let(body=node) | ast.Param(value=node) | ast.Region(shape=node) | ast.Group(members=(node,)):
            return kind(node)
        case _:
            raise ValueError(f"expected {expected}, found `{value}`")


def read_text(template: str, *texts: str) -> ast.Declaration:
    """Parse the single declaration that a template and texts give; its span is the call site.

    Raises:
        ValueError: the texts do not give exactly one declaration.
    """
    declarations, wrong = read_alone(Source("text", template.format(*texts)), Limits())
    shown = " ".join(texts)
    if wrong:
        raise ValueError(f"`{shown}`: {wrong[0].code.name}: {wrong[0].message}; {wrong[0].help}")
    if len(declarations) != 1:
        raise ValueError(f"`{shown}` is more than one part of a mission")
    return with_span(declarations[0], call_site())


def read_alone(source: Source, limits: Limits) -> tuple[list[ast.Declaration], list[Diagnostic]]:
    """Declarations and all errors of a text, without the files that it includes."""
    read: list[ast.Declaration] = []
    wrong: list[Diagnostic] = []
    for passage in passages(source):
        outcomes, odd = read_passage(passage, limits)
        wrong += [*odd, *(each for each in outcomes if isinstance(each, Diagnostic))]
        read += [each for each in outcomes if not isinstance(each, Diagnostic)]
    return read, wrong


def with_span(node: Node, span: Span) -> Node:
    """Copy of a tree in which every node has the same span."""
    if isinstance(node, tuple):
        return cast(Node, tuple([with_span(part, span) for part in node]))
    if not is_dataclass(node) or isinstance(node, type | Source):
        return node
    changes: dict[str, object] = {}
    for field in fields(node):
        value = getattr(node, field.name)
        changes[field.name] = span if isinstance(value, Span) else with_span(value, span)
    return cast(Node, replace(node, **changes))


# ------------------------------------------------------------------ operators


def _chain(word: str, left: FormulaLike, right: FormulaLike) -> Formula:
    """Formula that joins two operands by ``word``; ``a & b & c`` becomes one operator with three operands."""
    first, last = formula(left), formula(right)
    match first.node:
        case ast.Apply(operator=own, operands=operands) if own == word:
            span = call_site()
            return Formula(ast.Apply(span, word, span, (*operands, last.node)), last, chained=first)
        case _:
            return _applied(word, (first, last))


def _applied(
    word: str, operands: tuple[Formula, ...], bounds: ast.Window | ast.Length | ast.Period | None = None
) -> Formula:
    span = call_site()
    return Formula(ast.Apply(span, word, span, tuple(each.node for each in operands), bounds), *operands)


def _arithmetic(operator: str, left: QuantityLike, right: QuantityLike) -> Quantity:
    first, last = quantity(left), quantity(right)
    return Quantity(ast.Arithmetic(call_site(), operator, first.node, last.node), first, last)


def _combined(operator: str, left: ShapeLike, right: ShapeLike) -> Shape:
    first, last = shape(left), shape(right)
    return Shape(ast.Combined(call_site(), operator, first.node, last.node), first, last)


def _member_of_family(node: object, indices: QuantityLike | tuple[QuantityLike, ...]) -> ast.Indexed:
    if not isinstance(node, ast.Name) or isinstance(node, ast.Indexed):
        raise TypeError("only a family has members")
    span, places = call_site(), indices if isinstance(indices, tuple) else (indices,)
    return ast.Indexed(span, node.text, tuple(quantity(each).node for each in places), span)


_BOUNDS: dict[Bounds, tuple[str, ...]] = {
    Bounds.NONE: (),
    Bounds.TIME: ("low", "high"),
    Bounds.PAST: ("low", "high"),
    Bounds.PERIOD: ("period",),
    Bounds.LENGTH: (),
}
"""Names of the parameters that bound an operator, for each kind of bounds except lengths."""


def _method(operator: Operator) -> Callable[..., Formula]:
    """Method of ``Formula`` for an operator of the language."""
    other = ("other",) if operator.fixity is Fixity.INFIX else ()
    parameters = [
        Parameter(each, Parameter.POSITIONAL_OR_KEYWORD) for each in ("self", *other, *_BOUNDS[operator.bounds])
    ]
    if operator.bounds is Bounds.LENGTH:
        parameters.append(Parameter("on", Parameter.KEYWORD_ONLY, default=None))
        parameters.append(Parameter("length", Parameter.VAR_KEYWORD))
    signature = Signature(parameters)

    def method(*values: Any, **named: Any) -> Formula:
        try:
            bound = signature.bind(*values, **named)
        except TypeError as error:
            raise TypeError(f"`{operator.name}{signature}`, {error}; in the language: `{operator.example}`") from None
        bound.apply_defaults()
        given = bound.arguments
        operands = tuple(formula(given[each]) for each in ("self", *other))
        made = _applied(operator.name, operands, _bounds(operator, given))
        if operator.name == "count":
            return cast(Formula, Count(replace(made.node, comparison=">=", number=quantity(0).node), *operands))
        return made

    method.__name__ = operator.name
    method.__doc__ = f"{operator.says[0].upper()}{operator.says[1:]}. In the language: ``{operator.example}``."
    method.__signature__ = signature  # type: ignore[attr-defined]
    return method


def _bounds(operator: Operator, given: Mapping[str, Any]) -> ast.Window | ast.Length | ast.Period | None:
    span = call_site()
    match operator.bounds:
        case Bounds.NONE:
            return None
        case Bounds.PERIOD:
            return ast.Period(span, quantity(given["period"]).node)
        case Bounds.TIME | Bounds.PAST:
            high = None if isinstance(given["high"], str) and given["high"] == "end" else quantity(given["high"]).node
            return ast.Window(span, quantity(given["low"]).node, high)
        case Bounds.LENGTH:
            return _length(operator, given["length"], given["on"])


def _length(operator: Operator, lengths: Mapping[str, Any], on: NamedLike | None) -> ast.Length:
    if len(lengths) != 1:
        raise TypeError(f"`{operator.name}` takes one length: `hops=(0, 2)`, `distance=5`, or a weight of the graph")
    ((word, value),) = lengths.items()
    low, high = value if isinstance(value, tuple) else (None, value)
    if low is None and high is None:
        raise ValueError(f"`{word}` is a largest length, or a pair of which one end may be None")
    metric = {each.value: each for each in (Metric.HOPS, Metric.METRES)}.get(word, Metric.WEIGHT)
    return ast.Length(
        call_site(),
        metric,
        None if low is None else quantity(low).node,
        None if high is None else quantity(high).node,
        None if on is None else name_of(on),
        declared_name(word) if metric is Metric.WEIGHT else None,
    )


for _operator in OPERATORS:
    if not keyword.iskeyword(_operator.name):
        setattr(Formula, _operator.name, _method(_operator))
