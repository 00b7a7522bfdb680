"""Operators over parts at one moment: *and*, *or* and *at least*, of whole formulas and of those at one agent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missionc.base.trace import Array
from missionc.kernel.nodes import All, Any, At, AtLeast, Node
from missionc.monitoring.live.columns import Columns


class Parts:
    """The parts of one operator; those that ask the same formula of several agents are taken together.

    Attributes:
        bodies: the formulas that agents are asked, and which; ``others`` are the parts that are not so.
    """

    def __init__(self, node: All | Any | AtLeast, columns: Mapping[Node, Columns]) -> None:
        self.node = node
        self.plain: list[Columns] = []
        self.at: dict[Columns, list[int]] = {}
        self.bodies: dict[Node, list[int]] = {}
        self.others = [part for part in node.parts if not isinstance(part, At) or part in columns]
        for part in node.parts:
            if isinstance(part, At) and part not in columns:
                self.at.setdefault(columns[part.body], []).append(part.agent)
                self.bodies.setdefault(part.body, []).append(part.agent)
            else:
                self.plain.append(columns[part])
        self.rows = max((each.rows for each in self.plain), default=1)

    def bounds(self, begin: int, count: int, cells: int) -> Array:
        """The bounds at ``count`` steps from ``begin`` on and in the cells to come: (4, rows, columns)."""
        taken = [
            (body.part(begin, count, cells), np.array(agents) if body.rows > 1 else None, len(agents))
            for body, agents in self.at.items()
        ]
        plain = [each.part(begin, count, cells) for each in self.plain]
        shape = (4, self.rows, max(count, 0) + cells)
        if isinstance(self.node, AtLeast):
            each = [part[:, agent : agent + 1] for part, agents, _ in taken if agents is not None for agent in agents]
            each += [part for part, agents, number in taken if agents is None for _ in range(number)]
            return self._at_least(self.node.count, [np.broadcast_to(part, shape) for part in (*each, *plain)], shape)
        choose, found = (np.minimum, np.inf) if self.node.every else (np.maximum, -np.inf)
        result = np.full(shape, found)
        for part in plain:
            choose(result, part, out=result)
        for part, agents, _ in taken:
            chosen = part if agents is None else np.asarray(choose.reduce(part[:, agents], axis=1, keepdims=True))
            choose(result, chosen, out=result)
        return result

    def _at_least(self, count: int, parts: list[Array], shape: tuple[int, ...]) -> Array:
        if count <= 0 or count > len(parts):
            return np.full(shape, np.inf if count <= 0 else -np.inf)
        return np.asarray(np.partition(np.stack(parts), -count, axis=0)[-count])
