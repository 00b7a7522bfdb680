"""Choices that a plan makes once: which nodes are asked at one step, what is kept, and what is left of formulas."""

from __future__ import annotations

import pytest

from missionc.ir.kernel.choices import ChoicePoint, branches, kept, made_once, without, witnesses
from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Eventually, Is, Node

F, G, H = (Is(frozenset((index,))) for index in range(3))


def test_what_is_shared_is_asked_once_and_what_comes_after_it_too() -> None:
    shared = Any((F, G))
    formula = All((shared, shared, H))
    assert [each.node for each in made_once(formula)] == [formula, shared, F, G, H]


def test_an_agent_is_asked_what_is_said_of_it() -> None:
    body = Any((F, G))
    assert [(each.node, each.agent) for each in made_once(At(2, body))][1:] == [(body, 2), (F, 2), (G, 2)]


def test_what_is_to_last_from_an_event_on_is_kept_over_its_window() -> None:
    choice = Any((F, G))
    inner = Always(choice, 1, 2)
    found = {each.node: each for each in made_once(Eventually(Always(inner, 1, 3), 0, 5))}
    assert found[choice] == ChoicePoint(choice, 0, 2, 5, event=True)
    assert not found[choice].once
    (endless,) = (each for each in made_once(Eventually(Always(choice, 1, None), 0, 5)) if each.node is choice)
    assert (endless.low, endless.high) == (1, None)
    assert choice not in {each.node for each in made_once(Always(choice, 0, 3))}


@pytest.mark.parametrize(("low", "high"), [(0, 2), (1, 1), (2, None), (0, None)])
def test_what_is_kept_over_a_window_is_a_new_node(low: int, high: int | None) -> None:
    node = kept(ChoicePoint(F, 0, low, high, event=True))
    assert isinstance(node, Always)
    assert (node.body, node.low, node.high) == (F, low, high)
    assert kept(ChoicePoint(F, 0)) is F


@pytest.mark.parametrize(
    ("node", "choices", "needed"),
    [
        (Any((F, G)), [F, G], 1),
        (Any((F,)), [], 1),
        (AtLeast(2, (F, G, H)), [F, G, H], 2),
        (AtLeast(2, (F, G)), [], 2),
        (All((F, G)), [], 1),
    ],
)
def test_there_is_a_choice_where_not_all_branches_are_needed(node: Node, choices: list[Node], needed: int) -> None:
    found = branches(ChoicePoint(node, 1, event=True))
    assert [(each.node, each.agent, each.event) for each in found] == [(choice, 1, True) for choice in choices]
    assert witnesses(ChoicePoint(node, 1)) == needed


def test_a_formula_without_a_branch_is_the_same_elsewhere() -> None:
    choice, other = Any((F, G, H)), Any((F, H))
    formula = All((choice, At(1, other)))
    assert without(formula, {}) is formula
    found = without(formula, {ChoicePoint(choice, 0): frozenset((1,))})
    assert isinstance(found, All)
    left, same = found.parts
    assert isinstance(left, Any)
    assert left.parts == (F, H)
    assert same is formula.parts[1]
    assert without(formula, {ChoicePoint(other, 0): frozenset((1,))}) is formula
