"""The operators of the language, each in a file of its own. This tuple is the only registration."""

from __future__ import annotations

from types import MappingProxyType

from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import (
    always,
    and_,
    arrives,
    count,
    escape,
    eventually,
    every,
    everywhere,
    historically,
    iff,
    implies,
    leaves,
    next_,
    not_,
    once,
    or_,
    reach,
    release,
    since,
    somewhere,
    surround,
    until,
)

OPERATORS: tuple[Operator, ...] = (
    always.OPERATOR,
    eventually.OPERATOR,
    every.OPERATOR,
    until.OPERATOR,
    release.OPERATOR,
    once.OPERATOR,
    historically.OPERATOR,
    since.OPERATOR,
    next_.OPERATOR,
    arrives.OPERATOR,
    leaves.OPERATOR,
    not_.OPERATOR,
    and_.OPERATOR,
    or_.OPERATOR,
    implies.OPERATOR,
    iff.OPERATOR,
    reach.OPERATOR,
    escape.OPERATOR,
    somewhere.OPERATOR,
    everywhere.OPERATOR,
    surround.OPERATOR,
    count.OPERATOR,
)

by_name: MappingProxyType[str, Operator] = MappingProxyType({operator.name: operator for operator in OPERATORS})
"""Each operator under its word."""
