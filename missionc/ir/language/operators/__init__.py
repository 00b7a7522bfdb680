"""Registry of the operators of the language; each family has its own file. The tuple is the only registration."""

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
"""Operators by their name in the language."""
