"""Refusals of agents by themselves: requirements for which a roadmap holds no way of one agent."""

from __future__ import annotations

from collections.abc import Iterable

from missionc.backends.smt.prioritized.requirement_parts import own_formulas
from missionc.backends.smt.prioritized.single_agent_search import SingleAgentSearch
from missionc.kernel.nodes import Kernel


def smallest_conflict(kernel: Kernel, search: SingleAgentSearch, agent: int) -> tuple[str, ...]:
    """The names of requirements of which the agent finds no way, less those that are not needed for that.

    Raises:
        TooComplex: they ask for more than the search can look for.
    """
    own = {goal.name: own_formulas(goal.formula, agent) for goal in kernel.requirements}
    for name in list(own):
        less = [formula for other, asked in own.items() if other != name for formula in asked]
        if own[name] and search.alone(agent, less) is not None:
            continue
        del own[name]
    return tuple(own)


def names_about(kernel: Kernel, agents: Iterable[int]) -> tuple[str, ...]:
    """The requirements that ask something of these agents by themselves."""
    goals = kernel.requirements
    return tuple(goal.name for goal in goals if any(own_formulas(goal.formula, agent) for agent in agents))
