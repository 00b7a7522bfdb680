"""Which places are linked, and that each finds its neighbours."""

from __future__ import annotations

import math

import numpy as np
import pytest

from missionc import ir
from missionc.backends.smt.roadmap import roadmap_links as module
from missionc.backends.smt.roadmap.roadmap_links import Links, links_between
from missionc.base.units import Metres
from missionc.ir.language.margins.links import link_margin
from tests.support.legal_plans import SPAN

RADIO = ir.Proximity("radio", Metres(1.0), (0, 1, 2), SPAN)
CELL = ir.BeaconCover("cell", Metres(1.0), ((0.0, 0.0), (4.0, 0.0)), (0, 1, 2), SPAN)
EYES = ir.Sight("eyes", Metres(2.0), (ir.Box((1.0, 1.0), (2.5, 3.0)), ir.Disc((3.0, 0.5), 0.4)), (0, 1, 2), SPAN)


def pairs(links: Links) -> set[tuple[int, int]]:
    """Every place with every place that it is linked to, each group spelt out."""
    count = len(links.first) - 1
    _, owner, linked = links.beside(np.arange(count))
    found = [(place, other) for place, each in zip(owner, linked, strict=True) for other in spelt_out(links, int(each))]
    assert len(found) == len(set(found)), "no link is there twice"
    return {(int(place), int(other)) for place, other in found}


def spelt_out(links: Links, each: int) -> list[int]:
    places = len(links.first) - 1
    if each < places:
        return [each]
    return [place for member in links.groups[each - places] for place in spelt_out(links, int(member))]


def scattered(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, 4, (count, 2))


def test_places_are_linked_where_they_are_nearer_than_the_radius_and_to_no_place_twice() -> None:
    position = scattered(60)
    links = links_between(RADIO, position)
    expected = {
        (one, other)
        for one in range(60)
        for other in range(60)
        if one != other and math.dist(position[one], position[other]) < 1.0
    }
    assert pairs(links) == expected


def test_places_that_see_each_other_are_linked_exactly_where_their_margin_says_so() -> None:
    position = scattered(150, seed=3)
    margins = link_margin(EYES, 0, 1, position[:, None], position[None])
    expected = {(one, other) for one, other in np.argwhere(margins > 0).tolist() if one != other}
    near = EYES.radius - np.linalg.norm(position[:, None] - position[None], axis=-1) > 0
    assert pairs(links_between(EYES, position)) == expected
    assert 1000 < len(expected) < near.sum() - 1000


@pytest.mark.parametrize("graph", [RADIO, CELL, EYES], ids=lambda graph: graph.name)
def test_a_link_is_there_from_both_its_ends(graph: ir.Graph) -> None:
    found = pairs(links_between(graph, scattered(80)))
    assert found
    assert found == {(other, one) for one, other in found}


def test_no_place_is_linked_to_itself_nor_to_another_at_the_same_point() -> None:
    position = np.array([[1.0, 1.0], [1.0, 1.0], [3.0, 3.0], [1.5, 1.0]])
    assert pairs(links_between(RADIO, position)) == {(0, 3), (1, 3), (3, 0), (3, 1)}


def test_places_of_one_cell_are_linked_however_far_apart_and_those_of_two_cells_are_not() -> None:
    position = np.array([[-0.9, 0.0], [0.9, 0.0], [3.2, 0.0], [2.0, 0.0]])
    assert pairs(links_between(CELL, position)) == {(0, 1), (1, 0)}


@pytest.mark.parametrize(("name", "value"), [("BLOCK", 120), ("DENSE", -1)])
def test_in_blocks_and_in_groups_the_links_are_the_same(name: str, value: int, monkeypatch: pytest.MonkeyPatch) -> None:
    position = scattered(50, seed=3)
    whole = pairs(links_between(RADIO, position))
    monkeypatch.setattr(module, name, value)
    assert pairs(links_between(RADIO, position)) == whole


def test_the_neighbours_of_some_places_come_in_the_order_in_which_these_are_asked_for() -> None:
    links = links_between(RADIO, np.array([[0.0, 0.0], [0.5, 0.0], [1.2, 0.0], [3.0, 0.0]]))
    sizes, owner, neighbours = links.beside(np.array([2, 3, 1, 2]))
    assert sizes.tolist() == [1, 0, 2, 1]
    assert owner.tolist() == [0, 2, 2, 3]
    assert neighbours.tolist() == [1, 0, 2, 1]


def test_no_places_have_no_links() -> None:
    assert pairs(links_between(RADIO, np.zeros((0, 2)))) == set()
