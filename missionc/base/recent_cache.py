"""A cache of recent results, for whoever looks at one version of a text after the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Generic, TypeVar

from missionc.base.late_dataclass import dataclass

K = TypeVar("K")
V = TypeVar("V")

MOST = 4_096
"""Values kept: a mission of a thousand lines has about as many of each."""


@dataclass(slots=True, eq=False)
class Recent(Generic[K, V]):
    """Values by what they are of: the ones that were worked out last."""

    values: dict[K, V] = field(default_factory=dict)

    def of(self, key: K, make: Callable[[], V]) -> V:
        try:
            return self.values[key]
        except KeyError:
            value = self.values[key] = make()
        if len(self.values) > MOST:
            del self.values[next(iter(self.values))]
        return value
