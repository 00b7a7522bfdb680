"""The hybrid search over sequences and motions, on puzzles whose local planner is a few lines."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations, pairwise, permutations, product

import numpy as np
import pytest

from missionc.backends.clot.paper.planning_sequence import Couplings, in_order, of_phases
from missionc.backends.clot.paper.search_checkpoint import from_arrays, to_arrays
from missionc.backends.clot.paper.search_tree import Node, Tree
from missionc.backends.clot.paper.tree_search import Candidate, Ending, Expand, TreeSearch
from missionc.backends.clot.run.presets import FSOT, PAPER
from missionc.backends.clot.settings import SearchSettings

Lanes = Sequence[set[int]]
"""Where each agent of a row fits; its motion stays in one lane, the number is its place in metres."""

DEFAULT = SearchSettings()


def row(agents: int) -> Couplings:
    return of_phases([(0, 2, list(pairwise(range(agents))))], agents)


def motion(lane: float) -> np.ndarray:
    return np.full((3, 1), float(lane))


def beside(node: Node, agent: int) -> list[float]:
    """The lanes of the planned neighbours in the row."""
    return [
        float(path[0, 0])
        for path, other in zip(node.trajectories, node.planned, strict=True)
        if abs(other - agent) == 1
    ]


def lanes(fits: Lanes, luck: float = 1.0) -> Expand:
    """Neighbours are at most one lane apart; low lanes are cheap. By ``luck`` below 1 a good motion is missed."""

    def expand(work: Sequence[tuple[Node, int]], samples: int, seed: int) -> list[list[Candidate]]:
        draw = np.random.default_rng(seed)
        return [
            [
                Candidate(motion(lane), lane / 4, all(abs(lane - other) <= 1 for other in beside(node, agent)))
                for lane in sorted(fits[agent])
                if draw.random() < luck
            ]
            for node, agent in work
        ]

    return expand


def following(fits: Lanes) -> Expand:
    """One motion each: the first agent takes its lowest lane, the others the lane of a neighbour, where they fit."""

    def expand(work: Sequence[tuple[Node, int]], samples: int, seed: int) -> list[list[Candidate]]:
        taken = [beside(node, agent) or [min(fits[agent])] for node, agent in work]
        return [
            [Candidate(motion(lane[0]), 0.1, lane[0] in fits[agent])]
            for (_, agent), lane in zip(work, taken, strict=True)
        ]

    return expand


def search(
    expand: Expand, agents: int, settings: SearchSettings = DEFAULT, seed: int = 0, order: Sequence[int] = ()
) -> TreeSearch:
    offers = in_order(order) if order else row(agents).next_agents
    return TreeSearch(agents, offers, expand, settings, np.random.default_rng(seed))


def answers(*candidates: tuple[float, float, bool]) -> Expand:
    """The same candidates for whoever is asked: place in metres, cost, feasible."""
    made = [Candidate(motion(place), cost, feasible) for place, cost, feasible in candidates]
    return lambda work, samples, seed: [made for _ in work]


def solves(joint: np.ndarray, fits: Lanes) -> bool:
    lane = joint[:, 0, 0]
    return bool(np.all(np.abs(np.diff(lane)) <= 1)) and all(lane[agent] in fits[agent] for agent in range(len(fits)))


EVERYWHERE = set(range(4))
DOOR = [EVERYWHERE, EVERYWHERE, EVERYWHERE, {3}]
"""The last agent of four has one lane, and the cheapest motions of the others leave it out of reach."""


def test_the_search_solves_what_the_greedy_sequence_does_not() -> None:
    greedy = search(lanes(DOOR), 4, FSOT, order=(0, 1, 2, 3)).run()
    assert (greedy.ending, greedy.solutions) == (Ending.EXHAUSTED, ())
    found = search(lanes(DOOR), 4).run()
    assert found.ending is Ending.IMPROVED
    assert solves(found.solutions[0].trajectories, DOOR)


def test_only_sequences_from_the_one_narrow_agent_solve_and_the_search_finds_one() -> None:
    narrow = [EVERYWHERE, EVERYWHERE, {2}, EVERYWHERE, EVERYWHERE]
    valid = [order for order in permutations(range(5)) if is_valid(order)]
    solved = {order for order in valid if search(following(narrow), 5, FSOT, order=order).run().solutions}
    assert solved == {order for order in valid if order[0] == 2}
    assert len(valid) > len(solved) > 0
    for seed in range(5):
        (solution,) = search(following(narrow), 5, seed=seed).run().solutions
        assert solution.sequence[0] == 2
        assert solves(solution.trajectories, narrow)


def is_valid(order: Sequence[int]) -> bool:
    return all(row(len(order)).may_follow(order[:place], agent) for place, agent in enumerate(order))


@pytest.mark.parametrize("place", [7, 4, 0])
def test_a_long_row_with_one_door_is_solved_from_any_seed(place: int) -> None:
    door = [{3} if agent == place else EVERYWHERE for agent in range(8)]
    for seed in range(5):
        found = search(lanes(door), 8, replace(DEFAULT, expansions=60), seed).run()
        assert solves(found.solutions[0].trajectories, door), seed


def test_feedback_finds_the_doors_with_fewer_expansions() -> None:
    doors = [{3} if agent in (2, 5) else EVERYWHERE for agent in range(8)]

    def effort(reward: float) -> int:
        runs = [search(lanes(doors), 8, replace(DEFAULT, expansions=60, reward=reward), seed) for seed in range(6)]
        assert all(run.run().solutions for run in runs)
        return sum(run.expansions for run in runs)

    assert effort(DEFAULT.reward) < effort(0.0)


def test_a_planner_that_misses_motions_is_asked_again() -> None:
    once, often = (replace(DEFAULT, children=1, wide=1, tries=tries) for tries in (1, 9))
    unlucky = lanes([{1}] * 3, luck=0.4)
    assert any(search(unlucky, 3, once, seed).run().ending is Ending.EXHAUSTED for seed in range(9))
    assert all(search(unlucky, 3, often, seed).run().solutions for seed in range(9))


def test_a_failure_lowers_the_value_of_the_node_and_of_its_ancestors_less_and_less() -> None:
    tree = Tree()
    tree.add(0, 0, motion(0), 0.0)
    tree.add(1, 1, motion(0), 0.0)
    tree.add(0, 1, motion(0), 0.0)
    assert tree.psi(0.5) == [0.5] * 4, "without any outcome all are worth the same"
    tree.back_propagate(2, -0.5, 0.8)
    root, first, failed, other = tree.psi(0.5)
    assert failed < first < root < 0.5
    assert other == root, "untried, it has its parent's"
    assert [tree.earned[index] for index in (2, 1, 0)] == pytest.approx([-0.4, -0.32, -0.256])
    assert (root, first, failed) == pytest.approx((0.244 / 2, (root - 0.32) / 2, (first - 0.4) / 2))


def test_an_expansion_that_fails_costs_its_node_what_a_success_earns() -> None:
    def expand(work: Sequence[tuple[Node, int]], samples: int, seed: int) -> list[list[Candidate]]:
        return [[Candidate(motion(0), 0.0, not node.planned)] for node, _ in work]

    run = search(expand, 3, replace(DEFAULT, wide=2, narrow=2))
    run.tree.add(0, 0, motion(1), 0.0)
    run.run(stop=after(1))
    reward, gamma = DEFAULT.reward, DEFAULT.gamma
    assert run.tree.parent == [-1, 0, 0], "the root has a new child, the node has none"
    assert run.tree.earned == pytest.approx([reward * (gamma - gamma**2), -reward * gamma, 0.0])
    root, failed, new = run.tree.psi(reward)
    assert failed < new == root


def test_of_the_agents_a_node_is_offered_the_least_tried_comes_first() -> None:
    run = search(answers((0, 0.5, True)), 4, replace(DEFAULT, wide=1, narrow=1))
    run.tree.tries[0] = {0: 2, 1: 1, 2: 2, 3: 1}
    assert {run.select()[0][1] for _ in range(20)} == {1, 3}
    run.settings = replace(run.settings, wide=9)
    assert sorted(agent for _, agent in run.select()[2:]) == [0, 2]


def test_as_printed_a_node_is_expanded_by_one_agent_in_a_round() -> None:
    run = search(answers((0, 0.5, True)), 4, replace(DEFAULT, wide=9, narrow=9, printed=True))
    assert {tuple(run.select()) for _ in range(40)} == {((0, agent),) for agent in range(4)}


def test_of_the_least_tried_agents_one_of_the_lowest_rank_comes_first() -> None:
    run = search(answers((0, 0.5, True)), 4, replace(DEFAULT, wide=1, narrow=1))
    run.ranks = (1, 0, 1, 2)
    run.tree.tries[0] = {1: 1}
    assert {run.select()[0][1] for _ in range(20)} == {0, 2}


def test_successes_do_not_raise_a_value_without_end() -> None:
    tree = Tree()
    tree.add(0, 0, motion(0), 0.0)
    for _ in range(100):
        tree.back_propagate(1, 0.5, 0.8)
    assert max(tree.psi(0.5)) < 0.5
    tree.back_propagate(1, -0.5, 0.8)
    assert min(tree.psi(0.5)) > 0.3


def test_the_value_weighs_progress_against_cost() -> None:
    run = search(answers((0, 0.5, True)), 4, replace(DEFAULT, eta=2.0, reward=0.0))
    run.tree.add(0, 0, motion(0), 0.25)
    run.tree.add(1, 1, motion(0), 0.5)
    assert run.values() == pytest.approx([0.0, (1 - 2 * 0.25) / 4, (2 - 2 * 0.75) / 4])


def test_the_value_as_printed_does_not_divide_the_cost() -> None:
    run = search(answers((0, 0.5, True)), 4, replace(DEFAULT, eta=2.0, reward=0.0, printed=True))
    run.tree.add(0, 0, motion(0), 0.25)
    run.tree.add(1, 1, motion(0), 0.5)
    assert run.values() == pytest.approx([0.0, 1 / 4 - 2 * 0.25, 2 / 4 - 2 * 0.75])


@pytest.mark.parametrize(("printed", "first"), [(False, 1.0), (True, 2.0)])
def test_solutions_as_printed_come_by_their_value_and_not_by_their_cost_alone(printed: bool, first: float) -> None:
    """The cheaper leaf follows a node below which an expansion failed."""
    run = search(answers((0, 0.5, True)), 2, replace(DEFAULT, eta=0.1, printed=printed))
    for place, cost in ((1.0, 0.2), (2.0, 0.3)):
        run.tree.add(run.tree.add(0, 0, motion(place), 0.0), 1, motion(place), cost)
    run.tree.back_propagate(1, -0.5, 0.8)
    assert [float(one.trajectories[0, 0, 0]) for one in run.solutions()] == [first, 3.0 - first]


def test_the_best_nodes_are_chosen_each_with_an_agent_it_is_offered() -> None:
    run = search(answers((0, 0.5, True)), 5, replace(DEFAULT, wide=3, narrow=3, eta=1.0))
    for cost in (0.9, 0.1, 0.5, 0.3):
        run.tree.add(0, 2, motion(cost), cost)
    chosen = run.select()
    assert [node for node, _ in chosen] == [2, 4, 3]
    assert {agent for _, agent in chosen} <= {1, 3}


def test_the_root_is_tried_with_everybody_and_breadth_narrows_with_progress() -> None:
    sizes: list[tuple[int, int, set[int]]] = []

    def expand(work: Sequence[tuple[Node, int]], samples: int, seed: int) -> list[list[Candidate]]:
        sizes.append((len(work), samples, {agent for _, agent in work}))
        return [[Candidate(motion(place), 0.1, True) for place in range(4)] for _ in work]

    settings = replace(DEFAULT, wide=5, narrow=1, few_samples=10, many_samples=50)
    search(expand, 5, settings).run()
    assert sizes[0] == (5, 10, {0, 1, 2, 3, 4})
    assert [size for size, _, _ in sizes] == [5, 4, 3, 2, 1]
    assert [samples for _, samples, _ in sizes] == [10, 20, 30, 40, 50]


def test_candidates_that_are_alike_or_infeasible_make_no_second_child() -> None:
    run = search(answers((0, 0.2, True), (0.05, 0.3, True), (1, 0.4, True), (2, 0.0, False)), 2)
    run.settings = replace(run.settings, expansions=1, wide=1)
    run.run()
    children = [index for index, parent in enumerate(run.tree.parent) if parent == 0]
    assert [float(run.tree.node(index).trajectories[0, 0, 0]) for index in children] == [0.0, 1.0]


def test_of_many_good_candidates_the_cheapest_become_children() -> None:
    settings = replace(DEFAULT, children=2, wide=1, narrow=1, expansions=1)
    run = search(answers((3, 0.3, True), (1, 0.1, True), (2, 0.2, True)), 1, settings)
    assert [solution.cost for solution in run.run().solutions] == [0.1, 0.2]


def test_what_failed_is_not_repeated_at_a_similar_node_with_the_same_agents() -> None:
    def expand(work: Sequence[tuple[Node, int]], samples: int, seed: int) -> list[list[Candidate]]:
        return [[] for _ in work]

    run = search(expand, 3, replace(DEFAULT, wide=1, narrow=1, delta=0.5), order=(0, 1, 2))
    for place in (0.0, 0.4, 2.0):
        run.tree.add(0, 0, motion(place), 0.0)
    run.settings = replace(run.settings, expansions=1, tries=1)
    run.run()
    assert run.pruned == 1
    assert run.tree.tries[1:] == [{1: 1}, {1: 1}, {1: 1}], (
        "the first failed, the second is like it, the third was tried"
    )
    assert run.expansions == 3, "the first node, the third, and the root"


def test_as_printed_a_node_like_one_that_failed_is_closed_to_every_agent() -> None:
    run = search(lambda work, samples, seed: [[] for _ in work], 3, replace(DEFAULT, delta=0.5, printed=True))
    for place in (0.0, 0.4, 2.0):
        run.tree.add(0, 1, motion(place), 0.0)
    run._expand([(1, 0)])
    assert run.pruned == 1
    assert run.tree.tries[1:] == [{0: 1}, dict.fromkeys(range(3), DEFAULT.tries), {}]
    assert 2 not in {node for node, _ in run.select()}


def test_similar_means_every_agent_at_every_step() -> None:
    tree = Tree()
    for agent, place in ((0, 0.0), (1, 5.0)):
        first = tree.add(0, agent, motion(place), 0.0)
        tree.add(first, 1 - agent, motion(5.0 - place), 0.0)
    assert tree.twins(2, 0.1) == [4], "planned in another order, and the same motions"
    bent = motion(5.0)
    bent[2] += 0.2
    assert tree.similar(1, 1, bent, 0.1) == []
    assert tree.similar(1, 1, bent, 0.3) == [2, 4]
    elsewhere = tree.add(0, 0, motion(3.0), 0.0)
    tree.add(elsewhere, 1, motion(5.0), 0.0)
    assert tree.twins(2, 0.1) == [4], "the last agent's motion is the same, the first one's is not"
    assert tree.twins(2, 0.0) == []
    assert tree.twins(0, 9.0) == []


def test_solutions_are_apart_and_the_cheapest_comes_first() -> None:
    found = search(lanes([EVERYWHERE] * 3), 3, replace(DEFAULT, improvement=60, expansions=100)).run()
    assert found.ending in (Ending.IMPROVED, Ending.EXHAUSTED)
    costs = [solution.cost for solution in found.solutions]
    assert len(costs) > 3
    assert costs == sorted(costs)
    assert costs[0] == 0.0
    for one, other in combinations(found.solutions, 2):
        assert np.abs(one.trajectories - other.trajectories).max() >= DEFAULT.delta


def test_a_cheaper_motion_of_the_same_kind_takes_the_place_of_a_solution() -> None:
    run = search(answers((0, 0.5, True)), 1, replace(DEFAULT, wide=1))
    run.run()
    run.expand = answers((0.01, 0.6, True), (0.02, 0.2, True), (3, 0.9, True))
    run.settings = replace(run.settings, improvement=1)
    found = run.run()
    assert [(float(one.trajectories[0, 0, 0]), one.cost) for one in found.solutions] == [(0.02, 0.2), (3.0, 0.9)]


def test_improvement_goes_on_after_the_first_solution_and_finds_a_cheaper_one() -> None:
    at_once = search(lanes(DOOR), 4, seed=1)
    first = at_once.run().solutions[0].cost
    later = search(lanes(DOOR), 4, replace(DEFAULT, improvement=200, expansions=200, eta=0.5), seed=1)
    best = later.run().solutions[0].cost
    assert best == pytest.approx(
        min(sum(joint) / 4 for joint in product(EVERYWHERE, repeat=4) if solves(lined_up(joint), DOOR))
    )
    assert best <= first
    assert later.expansions > at_once.expansions


def lined_up(joint: Sequence[float]) -> np.ndarray:
    return np.stack([motion(lane) for lane in joint])


def test_an_impossible_puzzle_ends_without_a_solution_and_says_why() -> None:
    torn: Lanes = [{0}, EVERYWHERE, {3}]
    spent = search(lanes(torn), 3, replace(DEFAULT, expansions=2)).run()
    assert (spent.ending, spent.solutions) == (Ending.BUDGET, ())
    over = search(lanes(torn), 3, replace(DEFAULT, expansions=10_000)).run()
    assert (over.ending, over.solutions) == (Ending.EXHAUSTED, ())
    assert search(lanes(torn), 3).run(deadline=-math.inf).ending is Ending.TIME
    assert search(lanes(torn), 3).run(stop=lambda: True).ending is Ending.STOPPED


def after(rounds: int) -> Callable[[], bool]:
    left = iter([False] * rounds)
    return lambda: next(left, True)


def same(one: TreeSearch, other: TreeSearch) -> bool:
    (arrays, text), (others, words) = to_arrays(one), to_arrays(other)
    return text == words and all(np.array_equal(arrays[name], others[name]) for name in arrays)


def test_the_same_seed_gives_the_same_search_and_another_seed_another() -> None:
    one, again, other = (search(lanes(DOOR, luck=0.7), 4, seed=seed) for seed in (3, 3, 4))
    for run in (one, again, other):
        run.run()
    assert same(one, again)
    assert not same(one, other)


@pytest.mark.parametrize("rounds", [0, 1, 3, 6])
def test_a_resumed_search_is_the_uninterrupted_one(rounds: int) -> None:
    settings = replace(DEFAULT, improvement=30, expansions=60)
    whole, begun = (search(lanes(DOOR, luck=0.6), 4, settings, seed=2) for _ in range(2))
    found = whole.run()
    assert begun.run(stop=after(rounds)).ending is Ending.STOPPED
    assert begun.rounds == rounds
    arrays, text = to_arrays(begun)
    assert all(array.dtype == np.float64 for array in arrays.values())
    resumed = from_arrays(arrays, text, 4, row(4).next_agents, lanes(DOOR, luck=0.6), settings)
    assert same(resumed, begun)
    last = resumed.run()
    assert same(resumed, whole)
    assert last.ending is found.ending
    assert [solution.cost for solution in last.solutions] == [solution.cost for solution in found.solutions]
    assert [solution.sequence for solution in last.solutions] == [solution.sequence for solution in found.solutions]


def test_a_resumed_search_may_go_on_for_longer() -> None:
    short = search(lanes(DOOR), 4, replace(DEFAULT, expansions=1))
    assert short.run().ending is Ending.BUDGET
    resumed = from_arrays(*to_arrays(short), 4, row(4).next_agents, lanes(DOOR), DEFAULT)
    assert resumed.run().solutions


def test_a_state_of_something_else_is_refused() -> None:
    run = search(lanes(DOOR), 4)
    run.run()
    arrays, text = to_arrays(run)

    def taken_up(
        arrays: dict[str, np.ndarray], text: str, agents: int, settings: SearchSettings = DEFAULT
    ) -> TreeSearch:
        return from_arrays(arrays, text, agents, row(agents).next_agents, lanes(DOOR), settings)

    assert same(taken_up(arrays, text, 4), run)
    with pytest.raises(ValueError, match="other agents or settings"):
        taken_up(arrays, text, 5)
    with pytest.raises(ValueError, match="other agents or settings"):
        taken_up(arrays, text, 4, replace(DEFAULT, gamma=0.5))
    with pytest.raises(ValueError, match="no agent"):
        taken_up(arrays, text, 3)
    with pytest.raises(ValueError, match="contains no saved search"):
        taken_up({}, text, 4)
    with pytest.raises(ValueError, match="different lengths"):
        taken_up({**arrays, "cost": arrays["cost"][:-1]}, text, 4)
    with pytest.raises(ValueError, match="no parent before it"):
        taken_up({**arrays, "parent": arrays["parent"] + 99}, text, 4)
    with pytest.raises(ValueError, match="contains no saved search"):
        taken_up(arrays, json.dumps([1]), 4)
    with pytest.raises(ValueError, match="no number"):
        taken_up(arrays, json.dumps({**json.loads(text), "rounds": "3"}), 4)
    run.generator = np.random.Generator(np.random.MT19937(1))
    with pytest.raises(ValueError, match="MT19937"):
        to_arrays(run)


def test_a_planner_that_breaks_its_promise_is_refused() -> None:
    with pytest.raises(ValueError, match="0 results"):
        search(lambda work, samples, seed: [], 2).run()
    with pytest.raises(ValueError, match="finite"):
        search(answers((0, math.nan, True)), 2).run()
    with pytest.raises(ValueError, match="shape"):
        search(
            lambda work, samples, seed: [[Candidate(np.zeros((one, 1)), 0.0, True)] for one, _ in enumerate(work)], 3
        ).run()


def test_the_presets_are_the_papers_batch_and_the_greedy_ablation() -> None:
    assert (PAPER.few_samples * PAPER.wide, PAPER.many_samples * PAPER.narrow) == (800, 800)
    assert (FSOT.wide, FSOT.narrow, FSOT.children, FSOT.tries) == (1, 1, 1, 1)
    greedy = search(lanes([EVERYWHERE] * 5), 5, FSOT, order=(2, 1, 3, 0, 4))
    (solution,) = greedy.run().solutions
    assert solution.sequence == (2, 1, 3, 0, 4)
    assert greedy.expansions == 5
