"""Checkpoints of the tree search as plain arrays and a JSON text; ``run_state`` stores the rest of the run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from missionc.backends.clot.paper.planning_sequence import Offers
from missionc.backends.clot.paper.search_tree import Tree
from missionc.backends.clot.paper.tree_search import Expand, TreeSearch
from missionc.backends.clot.settings import SearchSettings
from missionc.base.trace import Array

BUDGET = ("expansions", "improvement")
COUNTERS = ("rounds", "expansions", "pruned", "first")


def to_arrays(search: TreeSearch) -> tuple[dict[str, Array], str]:
    """State of a search between two rounds, as arrays and a JSON text.

    Returns:
        ``parent``, ``agent``, ``cost``, ``earned``, ``visits``: values of each node, (nodes,); ``motion``: trajectory
            of each node but the root, (nodes - 1, steps + 1, dim), metres; ``tried``: (rows, 3), a node, an agent and a
            count. The JSON text contains the counters, the settings and the generator's state.

    Raises:
        ValueError: the generator is not numpy's default generator.

    Source:
        [clot] Algorithm 2, (V, →) with the scores of (11).
    """
    tree, state = search.tree, search.generator.bit_generator.state
    if state["bit_generator"] != "PCG64":
        raise ValueError(f"only the state of a PCG64 generator can be saved, not of a {state['bit_generator']}")
    tried = [(node, agent, tries) for node, by in enumerate(tree.tries) for agent, tries in by.items()]
    own = [motions[agent] for motions, agent in zip(tree.motions[1:], tree.agent[1:], strict=True)]
    arrays = {
        "parent": np.array(tree.parent, dtype=np.float64),
        "agent": np.array(tree.agent, dtype=np.float64),
        "cost": np.array(tree.cost),
        "earned": np.array(tree.earned),
        "visits": np.array(tree.visits, dtype=np.float64),
        "motion": np.array(own).reshape(len(own), *tree.shape),
        "tried": np.array(tried, dtype=np.float64).reshape(-1, 3),
    }
    counters = {name: getattr(search, name) for name in COUNTERS}
    return arrays, json.dumps({**counters, **_question(search), "generator": state})


def from_arrays(
    arrays: Mapping[str, Array], text: str, agents: int, offers: Offers, expand: Expand, settings: SearchSettings
) -> TreeSearch:
    """Search that ``to_arrays`` saved; it continues as if uninterrupted.

    Args:
        arrays: arrays in the shapes and units of ``to_arrays``, such as (nodes,) and metres.

    Raises:
        ValueError: the arrays are no such state, or belong to a search with other agents or settings (``expansions``
            and ``improvement`` may differ).

    Source:
        [clot] Algorithm 2.
    """
    try:
        fields = json.loads(text)
        search = TreeSearch(agents, offers, expand, settings, np.random.default_rng(0), _tree(arrays, agents))
        if any(fields[name] != value for name, value in _question(search).items()):
            raise ValueError("the saved search has other agents or settings")
        for name in COUNTERS:
            if not (isinstance(fields[name], int) or (name == "first" and fields[name] is None)):
                raise ValueError(f"{name} is no number")
            setattr(search, name, fields[name])
        search.generator.bit_generator.state = fields["generator"]
    except (KeyError, IndexError, TypeError) as wrong:
        raise ValueError(f"the checkpoint contains no saved search: {wrong}") from wrong
    return search


def _question(search: TreeSearch) -> dict[str, object]:
    """Values that a state and a search must have in common; the length of the search may differ."""
    settings = {name: value for name, value in asdict(search.settings).items() if name not in BUDGET}
    return {"agents": search.agents, "settings": settings}


def _tree(arrays: Mapping[str, Array], agents: int) -> Tree:
    tree = Tree()
    parent, agent = _whole(arrays["parent"]), _whole(arrays["agent"])
    if any(len(arrays[name]) != len(parent) for name in ("agent", "cost", "earned", "visits")):
        raise ValueError("the arrays of the search have different lengths")
    if not (np.isfinite(arrays["cost"]).all() and np.isfinite(arrays["earned"]).all()):
        raise ValueError("a cost or an outcome is not finite")
    if min(arrays["visits"], default=0.0) < 0:
        raise ValueError("a node has a negative number of visits")
    for index in range(1, len(parent)):
        if not (0 <= parent[index] < index and 0 <= agent[index] < agents):
            raise ValueError(f"node {index} has no parent before it, or no agent")
        tree.add(parent[index], agent[index], arrays["motion"][index - 1], 0.0)
    tree.cost, tree.earned = arrays["cost"].tolist(), arrays["earned"].tolist()
    tree.visits = _whole(arrays["visits"])
    for node, by, tries in zip(*map(_whole, arrays["tried"].T), strict=True):
        tree.tries[node][by] = tries
    return tree


def _whole(numbers: Array) -> list[int]:
    if not np.array_equal(numbers, np.round(numbers)):
        raise ValueError("a count is not a whole number")
    return [int(number) for number in numbers]
