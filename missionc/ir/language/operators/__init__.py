"""The operators of the language, each family in its own file. This tuple is the only registration."""

from __future__ import annotations

from types import MappingProxyType

from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import boolean, count, escape, past, reach, surround, temporal

OPERATORS: tuple[Operator, ...] = (
    *temporal.OPERATORS,
    *past.OPERATORS,
    *boolean.OPERATORS,
    reach.OPERATOR,
    escape.OPERATOR,
    reach.SOMEWHERE,
    reach.EVERYWHERE,
    surround.OPERATOR,
    count.OPERATOR,
)

by_name: MappingProxyType[str, Operator] = MappingProxyType({operator.name: operator for operator in OPERATORS})
"""Each operator under its word."""
