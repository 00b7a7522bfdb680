"""Operators as data: a value with the operator's spelling, bounds, kernel form and an example."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir import Apply, Graph, Length, Period, Window
from missionc.ir.kernel.nodes import Node


class Bounds(Enum):
    """Kind of bounds that an operator takes, in brackets or for a recurrence before the colon; the value is its name in
    messages."""

    NONE = "no bounds"
    TIME = "a time window"
    PAST = "a time window that ends, and reaches back"
    LENGTH = "a route length"
    PERIOD = "a time"


class Fixity(Enum):
    PREFIX = "before its operand"
    INFIX = "between its operands"


class Use(Record):
    """One use of an operator, with everything that its kernel form may depend on.

    ``arguments`` are the kernel nodes of the operands. Only ``count`` uses ``comparison`` and ``number``.
    """

    arguments: tuple[Node, ...]
    bounds: Window | Length | Period | None
    span: Span
    comparison: str = ""
    number: int = 0
    room: int = 1_000_000
    """Maximum number of kernel nodes that the use may expand to."""

    @property
    def window(self) -> Window:
        assert isinstance(self.bounds, Window)
        return self.bounds

    @property
    def back(self) -> tuple[int, int]:
        """Window of a past operator in steps ahead, both at most 0: the earliest step first."""
        low, high = self.window.low, self.window.high
        assert high is not None
        return -high, -low

    @property
    def period(self) -> int:
        assert isinstance(self.bounds, Period)
        return self.bounds.steps

    @property
    def length(self) -> Length:
        assert isinstance(self.bounds, Length)
        return self.bounds

    @property
    def graph(self) -> Graph:
        return self.length.graph


class TooLarge(Record):
    """Result of an expansion that would need more kernel nodes than the allowed ``room``; ``nodes`` is a lower
    bound."""

    nodes: int


def no_traps(use: Apply) -> tuple[str, ...]:
    """Empty list of conventions, for operators that mean the same in all tools."""
    return ()


class Operator(Record):
    """Definition of an operator of the mission language.

    Args:
        expand: function from a use to its kernel form.
        letter: symbol in logic (``G``, ``->``), if there is one.
        bounds: kind of bounds.
        says: meaning in a few words.
        reads: sentence with placeholders. ``{body}``, or ``{left}`` and ``{right}``, or ``{parts}`` of a chain, are the
            operands. ``{each}``, ``{some}``, ``{before}`` and ``{earlier}`` stand for the window. ``{period}`` and
            ``{start}`` are the length of the periods and the start of the first period. ``{route}``, ``{far}``,
            ``{graph}``, ``{here}``, ``{perhaps}``, ``{included}`` and ``{number}`` belong to spatial operators, whose
            operands are verbs: ``that {right}``, or with a noun ``{left:agent on it}``, "every agent on it is …".
        traps: names (in ``explain.convention_examples``) of the conventions that affect a use and differ in other
            tools.

    ``spatial`` operators follow a graph: their operands and the result are about one agent. Other operators preserve
    the subject of their operands.
    """

    name: str
    expand: Callable[[Use], Node | TooLarge]
    says: str
    reads: str
    example: str
    letter: str = ""
    fixity: Fixity = Fixity.PREFIX
    bounds: Bounds = Bounds.NONE
    traps: Callable[[Apply], tuple[str, ...]] = no_traps

    @property
    def spatial(self) -> bool:
        """True if the operator follows the links of a graph."""
        return self.bounds is Bounds.LENGTH

    @property
    def arity(self) -> int:
        return 2 if self.fixity is Fixity.INFIX else 1
