"""What was worked out lately, for whoever looks at one version of a text after the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")

MOST = 16_384
"""More than a mission has of anything that is kept."""


@dataclass(slots=True, eq=False)
class Recent(Generic[K, V]):
    """Values by what they are of: the ones that were asked for last."""

    values: dict[K, V] = field(default_factory=dict)

    def of(self, key: K, make: Callable[[], V]) -> V:
        value = self.values.pop(key) if key in self.values else make()
        self.values[key] = value
        if len(self.values) > MOST:
            del self.values[next(iter(self.values))]
        return value
