"""The presets: each plans or says how far it came, the same for a seed; partial teams, probes and checks under them."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from missionc.ir.kernel import nodes as kernel_nodes
from missionc.ir.kernel.nodes import Atom

pytest.importorskip("torch")

import torch

from missionc.backends import load
from missionc.backends.api import Budget, NotFound, Planned, Progress
from missionc.backends.clot.backend import BACKEND, TransportRun
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.paper.expand_agent import Expansion
from missionc.backends.clot.paper.first_motions import FirstMotions
from missionc.backends.clot.paper.free_distance import Surroundings
from missionc.backends.clot.paper.motion_batch import States, team, velocities
from missionc.backends.clot.paper.paper_rules import PaperRules
from missionc.backends.clot.paper.planning_sequence import couplings
from missionc.backends.clot.paper.prefix import about, spelled_out
from missionc.backends.clot.paper.prefix_check import left_open, prefix_margins
from missionc.backends.clot.paper.probe_cost import ProbeCost
from missionc.backends.clot.paper.robustness import Robustness
from missionc.backends.clot.paper.search_tree import Node as SearchNode
from missionc.backends.clot.paper.sparsity_pattern import sparsity_pattern
from missionc.backends.clot.paper.tree_search import Candidate
from missionc.backends.clot.run.presets import PRESETS, fewer_samples, preset
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.settings import ProbeWeights
from missionc.backends.options import OWN_PRESETS, Options
from missionc.backends.options import TRANSPORT_PRESETS as NAMES
from missionc.backends.registry import is_published
from missionc.base.diagnostics.code import NOT_ITS_FLAG
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.ir import Connected, InFormation, Mission
from missionc.ir.kernel.nodes import At, Neighbour, Node, UntilNode
from missionc.ir.kernel.walk import postorder
from missionc.verification.verify_plan import verify
from tests.support.transport_missions import checked

PAIR = """\
mission pair
time step 0.4 s, horizon 4 s
world (0, 0) to (8, 6)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (5, 3) to (7.5, 5.5)
obstacle rock = disc at (3.8, 2.8) radius 0.5
team drone[2] { radius 0.1 m  dynamics single_integrator(speed <= 4 m/s)  start in base }
graph radio = proximity 1.5 m
require visit: eventually[0, 4 s] every drone: goal
require link:  always[0, 4 s] connected(radio)
"""


def planned(text: str, name: str, seed: int = 0, limit: float = 60.0, **others: int) -> Planned | NotFound:
    mission, kernel = checked(text)
    outcome = BACKEND.plan(mission, kernel, Options(preset=name, **others), Budget(time.monotonic() + limit, seed=seed))
    assert isinstance(outcome, Planned | NotFound)
    if isinstance(outcome, Planned):
        assert verify(mission, kernel, outcome.trace).passed
    return outcome


def test_the_command_line_and_the_backend_know_the_same_presets() -> None:
    assert tuple(PRESETS) == NAMES


@pytest.mark.slow
@pytest.mark.parametrize(("name", "agents"), [("clot_star", 5), ("crazyflie_corridor", 3), ("clot_corridor", 12)])
def test_the_papers_preset_plans_scenarios_of_the_paper_with_few_iterations_for_each_robot(
    name: str, agents: int
) -> None:
    """A star, a chain, and a line through a corridor in the plane; a chain with momentum in a volume."""
    text = (Path(__file__).resolve().parents[3] / "missions" / f"{name}.mission").read_text(encoding="utf-8")
    outcome = planned(text, "paper", limit=600.0)
    assert isinstance(outcome, Planned)
    assert agents <= dict(outcome.report.sizes)["local iterations"] <= 2 * agents


OPEN = PAIR.replace("obstacle rock = disc at (3.8, 2.8) radius 0.5\n", "").replace("proximity 1.5 m", "proximity 3 m")
"""Wide enough for every preset."""


@pytest.mark.parametrize("name", NAMES)
def test_every_preset_plans_a_small_mission_and_the_verifier_agrees(name: str) -> None:
    samples = {} if name in ("sketch", "search") else {"samples": 48 if name == "mpot" else 16}
    outcome = planned(OPEN, name, **samples)
    assert isinstance(outcome, Planned)
    assert [each.by for each in outcome.report.solved] == ["sketch" if name == "sketch" else "transport"]


@pytest.mark.parametrize("name", ["search", pytest.param("fsot", marks=pytest.mark.slow)])
def test_the_same_seed_gives_the_same_motion_and_another_another(name: str) -> None:
    first, again, other = (planned(OPEN, name, seed, samples=16) for seed in (0, 0, 1))
    assert isinstance(first, Planned)
    assert isinstance(again, Planned)
    assert np.array_equal(first.trace.position, again.trace.position)
    assert not isinstance(other, Planned) or not np.array_equal(first.trace.position, other.trace.position)


def test_a_moving_obstacle_a_formation_and_inertia_are_searched_too() -> None:
    text = PAIR.replace(
        "single_integrator(speed <= 4 m/s)", "double_integrator(speed <= 4 m/s, acceleration <= 9 m/s^2)"
    )
    text = text.replace("radius 0.5\n", "radius 0.5 moving (0 m/s, 0.4 m/s)\n")
    text += "formation row = line of drone spacing 0.6 m tolerance 0.15 m\nrequire row: eventually[1.2 s, 2.8 s] row\n"
    assert isinstance(planned(text, "search"), Planned)


def test_what_a_search_does_not_find_is_undecided_and_says_how_far_it_came() -> None:
    text = PAIR + "require far: eventually[0, 4 s] distance(drone[0], drone[1]) >= 3\n"
    found = planned(text, "fsot", samples=2, limit=2.0)
    assert isinstance(found, NotFound)
    assert "of 2 agents" in found.statement or "the best candidate violates" in found.statement


def test_no_time_ends_a_search() -> None:
    assert isinstance(planned(PAIR, "paper", limit=0.0), NotFound)


def test_the_listener_hears_how_many_robots_are_planned() -> None:
    mission, kernel = checked(PAIR)
    heard: list[Progress] = []
    BACKEND.plan(mission, kernel, Options(preset="search"), Budget(time.monotonic() + 60, on_progress=heard.append))
    searching = [each for each in heard if each.stage == "search"]
    assert (searching[0].planned, searching[-1].planned) == ((1, 2), (2, 2))
    assert all(each.margin is not None for each in searching)


@pytest.mark.parametrize(
    ("engines", "preset", "published"),
    [
        (("clot",), "paper", True),
        (("clot",), "mpot", True),
        (("clot",), "search", False),
        (("clot",), "sketch", False),
        (("smt",), "paper-apart", True),
        (("smt",), "fsot", False),
        (("smt", "clot"), "paper", False),
    ],
)
def test_a_published_method_is_one_of_the_only_backend(engines: tuple[str, ...], preset: str, published: bool) -> None:
    assert is_published(engines, Options(preset=preset)) is published


def test_presets_of_the_paper_have_as_many_trajectories_as_published_and_our_own_have_none() -> None:
    assert {name for name, each in PRESETS.items() if not each.published} == set(OWN_PRESETS)


def test_an_unknown_preset_and_too_few_samples_are_named() -> None:
    with pytest.raises(ValueError, match="unknown preset `serach`"):
        preset("serach")
    with pytest.raises(ValueError, match="many_samples = 0"):
        preset("paper", 0)


@pytest.mark.parametrize("name", ["paper", "fsot", "mpot"])
def test_published_presets_take_as_many_trajectories_as_published_on_a_gpu_and_say_so_where_not(name: str) -> None:
    on_gpu, on_cpu = preset(name, None, "cuda"), preset(name, None, "cpu")
    assert (on_gpu.search.few_samples, on_gpu.search.many_samples) == (200 if name == "paper" else 800, 800)
    said = fewer_samples(on_cpu, None, "cpu")
    assert said is not None
    assert "96 trajectories together; the paper uses 800" in said
    assert fewer_samples(on_gpu, None, "cuda") is None
    assert fewer_samples(preset(name, 24), 24, "cpu") is None


def test_of_many_joint_motions_the_three_cheapest_are_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    mission, kernel = checked(OPEN)
    run = TransportRun(mission, kernel, Options(preset="mpot", samples=8), Budget(time.monotonic() + 3600))
    rng = np.random.default_rng(0)
    begun = run.begun(0, rng)
    found = [Candidate(begun.motion + cost, cost, True) for cost in (4.0, 1.0, 3.0, 0.0, 2.0)]
    monkeypatch.setattr(Expansion, "together", lambda self, samples, seed: found)
    motions = run.searched(preset("mpot", 8), begun, rng, 0, None)
    assert [float((motion - begun.motion).mean()) for motion in motions] == pytest.approx([0.0, 1.0, 2.0], abs=1e-9)


def test_the_papers_preset_shares_its_trajectories_among_the_nodes_of_a_round() -> None:
    for way in (preset("paper"), preset("paper", 40), preset("paper", None, "cuda")):
        search = way.search
        assert search.wide > search.narrow
        assert search.few_samples * search.wide == search.many_samples * search.narrow
    assert preset("paper", 1).search.few_samples == 1


@pytest.mark.parametrize("name", ["sketch", "search"])
def test_presets_of_our_own_are_the_same_on_any_device(name: str) -> None:
    assert preset(name, None, "cuda") == preset(name)
    assert fewer_samples(preset(name), None, "cpu") is None


def test_a_preset_is_refused_where_the_mission_goes_to_the_other_backend() -> None:
    finding = load.load("smt", Options(preset="search"))
    assert isinstance(finding, Diagnostic)
    assert finding.code is NOT_ITS_FLAG
    assert "`--preset search`" in finding.message
    assert not isinstance(load.load("clot", Options(preset="search")), Diagnostic)


def test_the_preset_is_recorded_beside_the_seed() -> None:
    compiled = driver.compile(Source("a.mission", PAIR), backend="clot", options=Options(preset="search", samples=16))
    assert isinstance(compiled.outcome, Verified)
    manifest = dict(compiled.outcome.files)["manifest.json"].decode()
    assert '"preset": "search"' in manifest
    assert '"samples": "16"' in manifest


# --------------------------------------------------------------- partial teams

TRIO = """\
mission trio
time step 0.5 s, horizon 3 s
world (0, 0) to (8, 6)
region base = box (0.5, 0.5) to (4, 4)
region goal = box (5, 3) to (7.5, 5.5)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 4 m/s)  start in base }
graph radio = proximity 2 m
formation row = chain of drone spacing 0.6 m tolerance 0.1 m
"""

REQUIREMENTS = (
    "every drone: eventually[0, 3 s] goal",
    "some drone: eventually[0, 3 s] goal",
    "always[0, 3 s] row",
    "always[0, 2 s] ((every drone: goal) or row)",
    "every drone: (base until[0, 3 s] goal)",
    "not (eventually[0, 2 s] drone[1]: goal)",
    "always[0, 3 s] distance(drone[0], drone[2]) >= 1",
    "at least 2 drone: eventually[0, 3 s] goal",
    "every drone: always[0, 3 s] everywhere[hops 0..1 on radio] base",
    "every drone: eventually[0, 3 s] somewhere[hops 0..1 on radio] goal",
)


def test_a_partial_team_is_never_judged_worse_than_the_whole_team_could_be(subtests: pytest.Subtests) -> None:
    """Whatever the others do: with all agents planned the goal is worth no more than its part for some of them."""
    for requirement, known in product(REQUIREMENTS, [{0}, {1}, {0, 1}, {0, 2}, {0, 1, 2}]):
        with subtests.test(requirement=requirement, known=known):
            mission, kernel = checked(TRIO + f"require it: {requirement}\n", driver.ANY_BACKEND)
            graph = build(kernel)
            (whole,) = (wanted.formula for wanted in graph.requirements)
            part = about([whole], frozenset(known), {})
            generator = torch.Generator().manual_seed(len(requirement))
            position = torch.rand((64, 3, mission.steps + 1, 2), generator=generator, dtype=torch.float64)
            position = position * torch.tensor([7.0, 5.0]) + 0.5
            states = States(position, velocities(position, mission.step))
            value = Robustness(team(mission, dtype=torch.float64), states).values(postorder(graph.formulas))[whole][
                :, 0, 0
            ]
            if known == {0, 1, 2}:
                assert part == (whole,) or len(part) == 1
            for node in part:
                shaken = position.clone()
                shaken[:, sorted({0, 1, 2} - known)] = 0.0
                moved = States(shaken, velocities(shaken, mission.step))
                bound = Robustness(team(mission, dtype=torch.float64), moved).values(postorder([node]))[node][:, 0, 0]
                assert bool((bound >= value - 1e-9).all())


def test_connected_becomes_a_link_of_the_agent_that_is_moved() -> None:
    _, kernel = checked(TRIO + "require it: always[0, 3 s] connected(radio)\n")
    roots = [wanted.formula for wanted in build(kernel).requirements]
    assert about(roots, frozenset({1}), {}) == ()
    (among,) = about(roots, frozenset({0, 1}), {})
    assert isinstance(among.body, Atom)  # type: ignore[union-attr]
    assert isinstance(among.body.predicate, Connected)  # type: ignore[union-attr]
    assert among.body.predicate.agents == (0, 1)  # type: ignore[union-attr]
    (own,) = about(roots, frozenset({0, 1}), {}, newest=1)
    assert isinstance(own.body, At)  # type: ignore[union-attr]
    assert isinstance(own.body.body, Neighbour)  # type: ignore[union-attr]


def test_a_formation_keeps_the_edges_between_planned_agents() -> None:
    _, kernel = checked(TRIO + "require it: always[0, 3 s] row\n")
    (part,) = about([wanted.formula for wanted in build(kernel).requirements], frozenset({0, 1}), {})
    predicate = part.body.predicate  # type: ignore[union-attr]
    assert isinstance(predicate, InFormation)
    assert [(edge.first, edge.second) for edge in predicate.formation.edges] == [(0, 1)]


HELD = "always[0, 3 s] ((every drone: goal) implies row)"
"""Of part of the team it holds whatever they do: somebody still to come may stay out of the goal."""


@pytest.mark.parametrize("as_whole", [False, True])
def test_as_a_whole_team_the_planned_keep_their_formation_where_all_of_them_are_inside(as_whole: bool) -> None:
    mission, kernel = checked(TRIO + f"require it: {HELD}\n")
    roots = [wanted.formula for wanted in build(kernel).requirements]
    part = about(roots, frozenset({0, 1}), {}, as_whole=as_whole)
    assert len(part) == as_whole
    # The first two a metre apart, where the chain has 0.6 m, both inside; then the second one outside.
    for second, margin in (((6.5, 4.0), -0.3), ((4.0, 4.0), 1.0)):
        position = parked(mission, [(5.5, 4.0), second, (0.0, 0.0)])
        values = Robustness(team(mission), States(position, torch.zeros_like(position))).values(postorder(part))
        for node in part:
            assert float(values[node][0, 0, 0]) == pytest.approx(margin, abs=1e-5)


def test_what_asks_for_one_who_is_not_planned_asks_nothing_of_the_others() -> None:
    _, kernel = checked(TRIO + "require it: eventually[0, 3 s] drone[2]: goal\n")
    roots = [wanted.formula for wanted in build(kernel).requirements]
    assert about(roots, frozenset({0, 1}), {}, as_whole=True) == ()


def test_until_spelled_out_is_worth_the_same_and_its_end_is_not_hidden_by_what_is_before() -> None:
    """By the rule of the mean, half of a motion that never ends in the goal is what it lacks of that."""
    mission, kernel = checked(TRIO + "require it: every drone: (not goal until[1 s, 3 s] goal)\n")
    goals = about([wanted.formula for wanted in build(kernel).requirements], frozenset({0}), {})
    spelt = spelled_out(goals, mission.steps)
    assert not any(isinstance(node, UntilNode) for node in postorder(spelt))
    generator = torch.Generator().manual_seed(4)
    position = torch.rand((64, 3, mission.steps + 1, 2), generator=generator, dtype=torch.float64) * 8
    states = States(position, velocities(position, mission.step))
    values = Robustness(team(mission, dtype=torch.float64), states).values(postorder((*goals, *spelt)))
    assert torch.equal(values[goals[0]][..., 0], values[spelt[0]][..., 0])
    still = parked(mission, [(4.5, 4.5), (0.0, 0.0), (0.0, 0.0)])
    probes = still[:, 0, :, None].clone()

    def worth(goal: Node, enough: float = math.inf) -> float:
        reads = sparsity_pattern([goal], 0, 3, mission.steps + 1)
        return float(PaperRules(reads, team(mission), still, probes, enough).goals()[0, 0, -1, 0])

    lacking, before = -0.5, 0.5
    assert worth(spelt[0]) == pytest.approx((lacking + before) / 2, abs=0.05)
    assert worth(goals[0]) > 0.3
    assert worth(spelt[0], 0.1) == pytest.approx((lacking + 0.1) / 2, abs=0.05), "what is before pays no more than 0.1"


def test_of_until_the_moments_that_a_planned_motion_rules_out_are_left_out_unless_all_are() -> None:
    mission, kernel = checked(TRIO + "require it: (every drone: base) until[0.5 s, 3 s] every drone: goal\n")
    roots = [wanted.formula for wanted in build(kernel).requirements]
    both, known = (spelled_out(about(roots, frozenset(who), {}), mission.steps)[0] for who in ({0, 1}, {0}))
    assert isinstance(both, kernel_nodes.Any)
    assert isinstance(known, kernel_nodes.Any)
    planned = parked(mission, [(6.0, 4.0)])
    late = planned.clone()
    planned[:, :, :3] = torch.tensor([2.0, 2.0])
    late[:, :, :-1] = torch.tensor([4.5, 2.0])
    assert left_open(both, known, team(mission), (0,), planned).parts == both.parts[2:3], "out of base at step 3"
    assert left_open(both, known, team(mission), (0,), late).parts == both.parts, "never in base"


def test_of_a_visit_by_some_agent_those_are_left_out_who_are_planned_and_miss_it() -> None:
    mission, kernel = checked(
        TRIO + "require it: (some drone: eventually[0, 3 s] goal) or (some drone: eventually[0, 3 s] base)\n"
    )
    roots = [wanted.formula for wanted in build(kernel).requirements]
    (visit,) = about(roots, frozenset({0, 1}), {}, as_whole=True)
    assert isinstance(visit, kernel_nodes.Any)
    away, there = parked(mission, [(4.5, 4.5)]), parked(mission, [(6.0, 4.0)])
    asked = {part.agent for part in left_open(visit, visit, team(mission), (0,), away).parts}
    assert asked == {1}
    assert len(left_open(visit, visit, team(mission), (0,), there).parts) == 3, "only the place that is missed"


# -------------------------------------------------------------- probes, checks


def parked(mission: Mission, places: list[tuple[float, float]]) -> torch.Tensor:
    """Agents that stay where they are, (1, agents, steps, dim)."""
    return torch.tensor(places)[None, :, None].expand(1, len(places), mission.steps + 1, 2).clone()


def test_the_check_of_a_partial_team_gives_the_worst_margin_in_metres() -> None:
    mission, kernel = checked(PAIR)
    roots = [wanted.formula for wanted in build(kernel).requirements]
    around, everyone = Surroundings(mission, 4), team(mission)
    still = parked(mission, [(1.5, 1.5), (1.5, 2.0)])

    def margin(own: torch.Tensor, goals: bool) -> float:
        known = about(roots, frozenset({0, 1}), {}) if goals else ()
        return float(prefix_margins(everyone, 0, (1,), own, still[:, 1:], known, around).min())

    assert margin(still[:, 0], False) == pytest.approx(0.3, abs=1e-5)  # half a metre apart, discs of 0.1 m
    assert margin(still[:, 0], True) < -1.0  # nobody ever goes to the goal
    jump = still[:, 0].clone()
    jump[:, 5] += torch.tensor([0.0, 2.0])
    assert margin(jump, False) < 0  # through the other one, and faster than it may


def test_the_check_judges_the_accelerations_that_are_flown_from_rest_to_rest() -> None:
    text = PAIR.replace(
        "single_integrator(speed <= 4 m/s)", "double_integrator(speed <= 4 m/s, acceleration <= 1 m/s^2)"
    )
    mission, _ = checked(text)
    around, nobody = Surroundings(mission, 4), torch.zeros(1, 0, mission.steps + 1, 2)
    own = torch.stack([torch.linspace(1.0, 3.0, mission.steps + 1), torch.ones(mission.steps + 1)], dim=1)[None]
    flown = np.diff(splines(mission).through(own.double().numpy()), 2, axis=1)
    spare = 1.0 * mission.step**2 - np.linalg.norm(flown, axis=-1).max()
    assert spare < -0.1, "it is off at once"
    waypoints, spline = (
        float(prefix_margins(team(mission), 0, (), own, nobody, (), around, how).min()) for how in (False, True)
    )
    assert spline == pytest.approx(spare, abs=1e-5)
    assert waypoints > 0.1


def test_first_motions_with_targets_end_where_the_key_frames_do_and_stay_from_the_frame_that_is_there_on() -> None:
    mission, kernel = checked(OPEN)
    begun = TransportRun(mission, kernel, Options(), Budget(time.monotonic() + 60)).begun(0, np.random.default_rng(0))
    start, end = begun.key[0], begun.key[-1]
    key = (start, replace(end, step=6), end)
    first = FirstMotions(mission, key, None, None, Geodesics(mission), 1.5, follows=True, targets=frozenset({1}))
    beside = (0, begun.motion[0] + 0.3)
    drawn = first.of(1, beside, 16, torch.Generator().manual_seed(0))
    assert np.abs(drawn[:, 0].numpy() - start.position[1]).max() < 1e-5
    assert np.abs(drawn[:, 6:].numpy() - end.position[1]).max() < 1e-5
    assert np.linalg.norm(drawn[:, 4].numpy() - end.position[1], axis=-1).min() > 0.02
    assert first.fixed(1).tolist() == [True] + [False] * mission.steps, "a target is no finish"
    free = first.of(0, None, 16, torch.Generator().manual_seed(0))
    assert np.linalg.norm(free[:, -1].numpy() - end.position[0], axis=-1).min() > 0.02, "who has none ends anywhere"


def small_round(in_one_batch: bool) -> list[list[Candidate]]:
    """What four pieces of work lead to, of which two have the same agents, by a few iterations on few samples."""
    mission, kernel = checked(OPEN)
    way = preset("paper", 8)
    way = replace(way, transport=replace(way.transport, iterations=6), slack=100.0)
    begun = TransportRun(mission, kernel, Options(), Budget(time.monotonic() + 60)).begun(0, np.random.default_rng(0))
    first = FirstMotions(mission, begun.key, None, None, Geodesics(mission), 1.5, follows=True)
    goals = tuple(wanted.formula for wanted in build(kernel).requirements)
    coupled = couplings(mission, kernel, begun.key[0].position)
    cpu = torch.device("cpu")
    expansion = Expansion(mission, way, goals, {}, first, coupled, cpu, lambda: True, lambda *_: None)
    assert not expansion.in_one_batch, "on a CPU the pieces come one by one"
    expansion.in_one_batch = in_one_batch
    root, moved = SearchNode(0, (), np.zeros((0, 0, 0)), 0.0), begun.motion[:1]
    nodes = [SearchNode(number, (0,), moved + 0.1 * number, 0.0) for number in (1, 2)]
    return expansion([(root, 0), (nodes[0], 1), (root, 1), (nodes[1], 1)], 8, 5)


def test_a_round_in_one_batch_gives_the_motions_that_its_pieces_give_one_by_one() -> None:
    together, apart = small_round(True), small_round(False)
    assert [len(each) for each in together] == [len(each) for each in apart] == [8] * 4
    for ours, theirs in zip(together, apart, strict=True):
        for one, other in zip(ours, theirs, strict=True):
            assert np.abs(one.trajectory - other.trajectory).max() < 1e-4
            assert one.cost == pytest.approx(other.cost, abs=1e-3)


def test_a_probe_costs_less_away_from_an_obstacle_and_from_the_others() -> None:
    mission, kernel = checked(PAIR)
    own = parked(mission, [(3.8, 2.2)])[:, 0]
    other = parked(mission, [(3.8, 2.0)])
    cost = ProbeCost(mission, team(mission), 0, (1,), (), Surroundings(mission, 2), ProbeWeights(), True)
    probes = own[:, :, None] + torch.tensor([[0.3, -0.3], [0.0, 0.3], [0.0, -0.15]])
    aside, into_rock, into_other = cost(own, probes, other)[0, 5].tolist()
    assert aside < into_rock
    assert aside < into_other
    assert [wanted.name for wanted in build(kernel).requirements] == ["visit", "link"]


@pytest.mark.parametrize("reward", [0.0, 0.5])
def test_a_probe_towards_what_a_goal_asks_for_costs_less(reward: float) -> None:
    mission, kernel = checked(PAIR)
    goals = about([wanted.formula for wanted in build(kernel).requirements], frozenset({0}), {}, 0)
    own = parked(mission, [(4.5, 4.0)])[:, 0]
    cost = ProbeCost(mission, team(mission), 0, (), goals, Surroundings(mission, 2), ProbeWeights(), reward)
    probes = own[:, :, None] + torch.tensor([[0.5, 0.0], [-0.5, 0.0]])
    towards, away = cost(own, probes, torch.zeros(1, 0, mission.steps + 1, 2))[0, 5].tolist()
    assert towards < away
    share = replace(cost, shares=(0.25,), reward=0.0)
    full, part = (of(own, probes, torch.zeros(1, 0, mission.steps + 1, 2))[0, 5] for of in (cost, share))
    if not reward:
        assert float(part[1] - part[0]) == pytest.approx(float(full[1] - full[0]) / 4, abs=1e-4)


@pytest.mark.parametrize("capped", [False, True])
def test_a_metre_from_what_is_to_be_kept_out_of_a_probe_gains_nothing_more_where_that_is_enough(capped: bool) -> None:
    mission, kernel = checked(TRIO + "require it: drone[0]: always[0, 3 s] not goal\n")
    goals = about([wanted.formula for wanted in build(kernel).requirements], frozenset({0}), {}, 0)
    own, nobody = parked(mission, [(2.0, 4.0)])[:, 0], torch.zeros(1, 0, mission.steps + 1, 2)
    around, weights = Surroundings(mission, 2), ProbeWeights()
    cost = ProbeCost(mission, team(mission), 0, (), goals, around, weights, 0.5, capped=capped)
    probes = own[:, :, None] + torch.tensor([[-0.5, 0.0], [0.5, 0.0]])
    farther, nearer = cost(own, probes, nobody)[0, 3].tolist()
    assert nearer - farther == pytest.approx(0.0 if capped else 0.5 * weights.task, abs=1e-3)
