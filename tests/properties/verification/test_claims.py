"""No bound of a flight's claims is above what samples of the flight show, for every kind of margin and every part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Indices
from missionc.geometry.curves.piecewise_polynomials import Curves, values
from missionc.verification.flight.joint_claims import (
    Flight,
    clear_of,
    downwash,
    obstacles,
    seen_from,
    separation,
    world,
)
from missionc.verification.flight.verify_polynomials import MANY, limits, prove
from missionc.verification.plan.obstacle_bodies import solid
from missionc.verification.proof import branch_and_bound as search
from missionc.verification.proof.branch_and_bound import Claim, Judge, branch_and_bound
from missionc.verification.proof.proof_boxes import (
    at_least_in_box,
    at_most,
    between_bounds,
    bound_on,
    boxes_of,
    fault,
    in_band,
    upright,
)
from tests.support.legal_plans import mission_of, moving, still

SEEDS = st.integers(0, 10_000)
FINE = np.linspace(0.0, 1.0, 201)
NEAR = 1e-7
"""What samples in plain doubles may err."""

BOX = ir.Box((4.0, 4.0), (6.0, 5.0))
SHAPES: list[ir.Shape] = [
    BOX,
    ir.Disc((5.0, 5.0), 0.7),
    ir.Polygon(((4.0, 4.0), (6.0, 4.5), (5.1, 5.0), (5.2, 6.2))),
    ir.Union(BOX, ir.Disc((5.0, 5.0), 0.7)),
    ir.Difference(BOX, ir.Disc((5.0, 5.0), 0.7)),
    ir.Intersection(BOX, ir.Disc((5.0, 5.0), 0.9)),
]
VOLUMES: list[ir.Shape] = [
    ir.Box((4.0, 4.0, 0.0), (6.0, 5.0, 5.5)),
    ir.Disc((5.0, 5.0), 0.7, ir.Prism(3.0, 5.5)),
    ir.Disc((5.0, 5.0), 0.7, ir.Prism(-np.inf, np.inf)),
    ir.Ball((5.0, 5.0, 5.0), 0.8),
    ir.Polygon(((4.0, 4.0), (6.0, 4.5), (5.1, 5.0), (5.2, 6.2)), ir.Prism(4.0, 6.0)),
]


def flight(seed: int, agents: int = 3, pieces: int = 4, wide: float = 1.0) -> Flight:
    """Curves about the middle of a world of 10 m; their pieces do not join."""
    generator = np.random.default_rng(seed)
    durations = generator.uniform(0.3, 1.5, pieces).astype(np.float32).astype(np.float64)
    size = wide / (1.0 + np.arange(8)) ** 2 / durations[:, None] ** np.arange(8)
    coefficients = generator.normal(size=(agents, pieces, 4, 8)) * size[None, :, None]
    coefficients[:, :, :3, 0] += 5.0
    return Flight(durations, coefficients.astype(np.float32).astype(np.float64))


def sampled(curves: Curves) -> np.ndarray:
    """(agents, pieces, samples, dim)."""
    local = FINE * curves.durations[:, None]
    wide = curves.coefficients[:, :, None]
    shape = (*wide.shape[:2], FINE.size)
    return values(np.broadcast_to(wide, (*shape, *wide.shape[3:])), np.broadcast_to(local, shape))


def curves_of(own: Flight, order: int = 0) -> Curves:
    curves = Curves(own.times, own.coefficients[:, :, :3])
    for _ in range(order):
        curves = curves.derivative()
    return curves


def claim_of(own: Flight, judge: Judge, order: int = 0, dimension: int = 3) -> Claim:
    curves = own.derived(order, tuple(range(dimension)))
    pieces = own.durations.size

    def curve(item: Indices) -> object:
        return curves[item // pieces, item % pieces]

    agents = np.arange(len(own.coefficients))[:, None]
    return Claim("made", "up", "m", 0.0, "", agents, own.times, curve, judge, 1e-5)  # type: ignore[arg-type]


def assert_sound(claim: Claim, margins: np.ndarray) -> None:
    """(items, samples): the true margins. The least is met, and every part's bound holds on the part."""
    parts = branch_and_bound(claim)
    assert parts.lower.min() <= margins.min() + NEAR
    assert parts.lower.min() >= min(margins.min(), parts.least) - claim.gap - 1e-3 * abs(parts.least) - NEAR
    assert parts.item.size < 5_000
    for item, begin, width, lower in zip(parts.item, parts.begin, parts.width, parts.lower, strict=True):
        inside = margins[item, (begin <= FINE) & (begin + width >= FINE)]
        assert lower <= inside.min(initial=np.inf) + NEAR
    # A part's bound depends on the part alone, not on how the search came to it.
    assert bound_on(claim, parts.item, parts.begin, parts.width) == pytest.approx(parts.lower, abs=1e-9)
    assert fault(boxes_of(claim, parts)) is None


@settings(max_examples=25)
@given(SEEDS, st.integers(0, 3))
def test_lengths_are_kept_and_limited(seed: int, order: int) -> None:
    own = flight(seed)
    length = np.linalg.norm(sampled(curves_of(own, order)), axis=-1).reshape(12, -1)
    some = np.full(12, 2.0)
    assert_sound(claim_of(own, at_least_in_box(some), order), length - 2.0)
    assert_sound(claim_of(own, at_most(some), order), 2.0 - length)
    assert_sound(claim_of(own, in_band(some, some * 3), order), np.minimum(length - 2.0, 6.0 - length))


@settings(max_examples=25)
@given(SEEDS)
def test_bounds_are_kept(seed: int) -> None:
    own = flight(seed)
    low, high = np.full((12, 3), 4.0), np.full((12, 3), 6.5)
    where = sampled(curves_of(own)).reshape(12, -1, 3)
    assert_sound(claim_of(own, between_bounds(low, high)), np.minimum(where - 4.0, 6.5 - where).min(axis=-1))


@settings(max_examples=25)
@given(SEEDS, st.floats(-10, 10))
def test_a_lean_is_bounded(seed: int, lift: float) -> None:
    own = flight(seed)
    own = replace(own, coefficients=own.coefficients.copy())
    own.coefficients[:, :, 2, 2] += np.float32(lift)
    push = sampled(curves_of(own, 2)).reshape(12, -1, 3)
    assert_sound(claim_of(own, upright(np.full(12, 1.0)), 2), 1.0 - lean_of(push))


@settings(max_examples=10, deadline=None)
@given(SEEDS, st.sampled_from([*SHAPES, *VOLUMES]))
def test_distances_to_bodies_are_bounded(seed: int, shape: ir.Shape) -> None:
    own, dimension = flight(seed), 3 if shape in VOLUMES else 2
    where = sampled(curves_of(own)).reshape(12, -1, 3)[..., :dimension]
    margin = solid(shape, dimension)(where) - 0.2
    assert_sound(claim_of(own, clear_of(shape, dimension, np.full(12, 0.2)), 0, dimension), margin)


def test_a_flight_along_a_wall_takes_few_parts() -> None:
    """What a plane separates is not cut into little pieces, however narrow it is."""
    coefficients = np.zeros((1, 1, 4, 8))
    coefficients[0, 0, :, :2] = [[0.0, 5.0], [2.0, 0.0], [1.0, 0.0], [0.0, 0.0]]
    own = Flight(np.array([2.0]), coefficients)
    wall = ir.Box((1.0, 2.2), (9.0, 3.0))
    parts = branch_and_bound(claim_of(own, clear_of(wall, 2, np.array([0.2])), 0, 2))
    assert parts.item.size == 1
    assert parts.lower[0] == pytest.approx(0.0, abs=1e-9)


def test_where_the_least_margin_takes_too_many_boxes_those_that_prove_enough_are_stated() -> None:
    """In a notch no plane separates: 2 m beside its wall, to 0.01 mm, are a hundred thousand parts."""
    coefficients = np.zeros((1, 1, 4, 8))
    coefficients[0, 0, :, :2] = [[4.0, 2.0], [5.0, 0.0], [1.0, 0.0], [0.0, 0.0]]
    own = Flight(np.array([1.0]), coefficients)
    inner = ((6.5, 6.0), (6.5, 4.79), (3.5, 4.79), (3.5, 6.0))
    notched = ir.Polygon(((3.0, 6.0), (3.0, 4.0), (7.0, 4.0), (7.0, 6.0), *inner))
    claim = claim_of(own, clear_of(notched, 2, np.array([0.2])), 0, 2)
    assert branch_and_bound(claim).item.size > MANY
    check, boxes = prove(mission_of([[4.0, 5.0]], 1), claim)
    assert check.passed
    assert 0 <= check.margin <= 0.01
    assert sum(map(len, boxes.bounds)) < 1000
    assert fault(boxes) is None


@settings(max_examples=15)
@pytest.mark.parametrize("moves", [False, True])
@given(SEEDS)
def test_an_obstacle_that_grows_is_as_large_as_it_is_at_the_time(moves: bool, seed: int) -> None:
    own = flight(seed)
    knots, offsets = [0.0, 1.0, 2.5], [(0.0, 0.0), (0.4, -0.3), (-1.0, 0.2)]
    for shape in SHAPES:
        body = moving(shape, knots, offsets) if moves else still(shape)
        mission = mission_of([[5.0, 5.0]] * 3, 4, obstacles=[replace(body, growth=0.4)])
        claim = obstacles(mission, own, strict=True)[0]
        parts = branch_and_bound(claim)
        boxes = boxes_of(claim, parts)
        assert fault(boxes) is None
        distance, least = solid(shape, 2), np.inf
        for piece, begin in enumerate(own.times[:-1]):
            local = FINE * own.durations[piece]
            place = values(
                np.repeat(own.coefficients[:, piece, :2][:, None], FINE.size, axis=1), np.tile(local, (3, 1))
            )
            moved = np.stack([np.interp(begin + local, knots, axis) for axis in np.array(offsets).T], axis=-1) * moves
            margin = distance(place - moved) - 0.4 * (begin + local) - mission.agents[0].radius
            least = min(least, float(margin.min()))
        assert parts.lower.min() <= least + NEAR
        assert parts.lower.min() >= least - claim.gap - 1e-2 * (1 + abs(least))


@settings(max_examples=15)
@given(SEEDS)
def test_what_an_obstacle_sees_is_the_flight_less_its_motion(seed: int) -> None:
    own = flight(seed)
    generator = np.random.default_rng(seed)
    knots = np.sort(generator.uniform(0, own.times[-1], 5))
    offsets = generator.normal(size=(5, 2))
    truck = moving(ir.Disc((5.0, 5.0), 0.3), knots.tolist(), [tuple(offset) for offset in offsets.tolist()])
    mission = mission_of([[5.0, 5.0]] * 3, 4, obstacles=[truck])
    joints, seen = seen_from(mission, own, truck)
    for part in range(joints.size - 1):
        for half, share in zip(seen[:, part].halves(), (0.25, 0.75), strict=True):
            at = joints[part] + share * (joints[part + 1] - joints[part])
            piece = int(np.searchsorted(own.times, at, side="right")) - 1
            place = values(own.coefficients[:, piece, :2], np.full(3, at - own.times[piece]))
            moved = np.array([np.interp(at, knots, axis) for axis in offsets.T])
            assert half.middle().points[..., 0] == pytest.approx(place - moved, abs=1e-9)
    claim = obstacles(mission, own, strict=True)[0]
    assert fault(boxes_of(claim, branch_and_bound(claim))) is None


@settings(max_examples=15, deadline=None)
@given(SEEDS, st.sampled_from([None, "truck", "skew", "downwash"]))
def test_who_is_far_is_judged_by_the_box_around_its_flight(seed: int, what: str | None) -> None:
    """The least margin is that of a search that looks at all, and every bound stated holds."""
    own = flight(seed, agents=12, pieces=5, wide=0.5)
    generator = np.random.default_rng(seed)
    own.coefficients[:, :, :3, 0] += generator.uniform(-20, 20, (12, 1, 3)).astype(np.float32)
    bodies = [still(shape) for shape in SHAPES]
    if what == "truck":
        bodies = [moving(BOX, [0.0, 2.0, 4.0], [(0.0, 0.0), (9.0, 1.0), (0.0, -9.0)])]
    mission = mission_of([[5.0, 5.0, 5.0][: 3 if what == "downwash" else 2]] * 12, 4, obstacles=bodies)
    if what in ("skew", "downwash"):
        vehicle = ir.Vehicle("some", start_skew=0.1, tracking=0.1, downwash_radius=0.5, downwash_height=1.0)
        mission = replace(mission, agents=tuple(replace(agent, vehicle=vehicle) for agent in mission.agents))
    claims = downwash(mission, own) if what == "downwash" else obstacles(mission, own, strict=True)
    stated_whole = 0
    for claim in [*claims, *separation(mission, own, strict=True)]:
        assert claim.far is not None
        every = np.arange(claim.items)
        bounds = claim.judge(every, claim.curve(every))[1].reshape(-1, claim.pieces)
        assert (claim.far(np.arange(len(claim.agents))) <= bounds.min(axis=1) + NEAR).all()
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(search, "FEW", 1)
            parts = branch_and_bound(claim)
        whole = branch_and_bound(replace(claim, far=None))
        assert parts.least == pytest.approx(whole.least, abs=claim.gap + 2e-3 * abs(whole.least))
        assert parts.worst == whole.worst or parts.least == pytest.approx(whole.least, abs=1e-9)
        assert parts.lower.min() >= parts.least - claim.gap - 1e-3 * abs(parts.least) - NEAR
        assert parts.item.size <= whole.item.size
        stated_whole += int((parts.width > 1).sum())
        assert fault(boxes_of(claim, parts)) is None
        wrong = boxes_of(claim, parts)
        raised_by = [(*bounds[:-1], bounds[-1] + 1e3) for bounds in wrong.bounds]
        assert fault(replace(wrong, bounds=tuple(raised_by))) is not None
    assert stated_whole


@settings(max_examples=15)
@given(SEEDS, st.floats(0, 0.3), st.floats(0, 0.2))
def test_no_start_that_is_late_and_no_flight_that_misses_brings_two_nearer(
    seed: int, skew: float, tracking: float
) -> None:
    own = flight(seed, wide=0.3)
    own.coefficients[:, :, 0, 0] += np.float32(2.0) * np.arange(3)[:, None]
    mission = flown_by(ir.Vehicle("some", start_skew=skew, tracking=tracking))
    (claim,) = separation(mission, own, strict=False)
    least = boxes_of(claim, branch_and_bound(claim)).least
    generator = np.random.default_rng(seed)
    for _ in range(200):
        at = generator.uniform(0, own.times[-1])
        places = [where(own, agent, at + generator.uniform(-skew, skew)) for agent in range(3)]
        apart = min(float(np.linalg.norm(places[i] - places[j])) for i in range(3) for j in range(i))
        assert apart - 2 * tracking - 0.2 >= least - NEAR


def where(own: Flight, agent: int, at: float) -> np.ndarray:
    """An agent's place; before it starts and after it ends it is where its pieces begin and end."""
    at = min(max(at, 0.0), float(own.times[-1]))
    piece = min(int(np.searchsorted(own.times, at, side="right")) - 1, own.durations.size - 1)
    return values(own.coefficients[agent, piece, :3], np.array(at - own.times[piece]))


def flown_by(vehicle: ir.Vehicle) -> ir.Mission:
    mission = mission_of([[5.0, 5.0, 5.0]] * 3, 4)
    return replace(mission, agents=tuple(replace(agent, vehicle=vehicle) for agent in mission.agents))


@settings(max_examples=25)
@given(SEEDS, st.floats(0.01, 0.2), st.floats(0.1, 1.0), st.floats(0.1, 1.0))
def test_nothing_within_what_is_missed_is_in_the_downwash(seed: int, missed: float, wide: float, tall: float) -> None:
    vehicle = ir.Vehicle("some", tracking=missed, downwash_radius=wide, downwash_height=tall)
    own = flight(seed, wide=0.2)
    generator = np.random.default_rng(seed)
    own.coefficients[:, :, :3, 0] += generator.uniform(-2, 2, (3, 1, 3)).astype(np.float32)
    (claim,) = downwash(flown_by(vehicle), own)
    if boxes_of(claim, branch_and_bound(claim)).least < 0:
        return
    for _ in range(200):
        at = generator.uniform(0, own.times[-1])
        off = generator.normal(size=3)
        off *= 2 * missed / np.linalg.norm(off)
        between_two = where(own, 0, at) - where(own, 1, at) + off
        assert np.linalg.norm(between_two / (2 * np.array([wide, wide, tall]))) >= 1 - NEAR


def test_the_grown_downwash_is_no_larger_than_it_must_be() -> None:
    """Sideways it is the sum; in height a little more."""
    vehicle = ir.Vehicle("some", tracking=0.05, downwash_radius=0.15, downwash_height=0.3)
    for offset, free in (((0.4001, 0.0), True), ((0.3999, 0.0), False), ((0.0, 0.7300), True), ((0.0, 0.6999), False)):
        coefficients = np.zeros((3, 1, 4, 8))
        coefficients[1, 0, [0, 2], 0] = offset
        coefficients[2, 0, 1, 0] = 9.0
        (claim,) = downwash(flown_by(vehicle), Flight(np.array([1.0]), coefficients))
        assert (boxes_of(claim, branch_and_bound(claim)).least >= 0) is free


@settings(max_examples=10)
@given(SEEDS)
def test_the_world_and_every_limit_hold_on_every_part(seed: int) -> None:
    vehicle = ir.Vehicle(
        "some", 0.1, 1.0, 0.5, 2.0, 20.0, 0.3, ir.Band(0.5, 1.5), 1.5, ir.Band(4.0, 6.0), tracking=0.1, fence_inset=0.2
    )
    own, mission = flight(seed), flown_by(vehicle)
    velocity, push, jerk = (sampled(curves_of(own, order)).reshape(12, -1, 3) for order in (1, 2, 3))
    place = sampled(curves_of(own)).reshape(12, -1, 3)
    turn = sampled(Curves(own.times, own.coefficients[:, :, 3:]).derivative()).reshape(12, -1)
    thrust = push + np.array([0.0, 0.0, 9.81])
    weight = np.linalg.norm(thrust, axis=-1) / 9.81
    expected = {
        "flown world": np.minimum(place - 0.3, 9.7 - place).min(axis=-1),
        "flown speed": 1.0 - np.linalg.norm(velocity[..., :2], axis=-1),
        "flown vertical speed": 0.5 - np.abs(velocity[..., 2]),
        "flown acceleration": 2.0 - np.linalg.norm(push, axis=-1),
        "flown jerk": 20.0 - np.linalg.norm(jerk, axis=-1),
        "flown yaw rate": 1.5 - np.abs(turn),
        "flown tilt": 0.3 - lean_of(thrust),
        "flown thrust": np.minimum(weight - 0.5, 1.5 - weight),
        "flown height": np.minimum(place[..., 2] - 4.0, 6.0 - place[..., 2]),
    }
    claims = {claim.name: claim for claim in (world(mission, own), *limits(mission, own))}
    assert claims.keys() == expected.keys()
    for name, claim in claims.items():
        assert_sound(claim, expected[name])


def lean_of(thrust: np.ndarray) -> np.ndarray:
    lean = np.arctan2(np.hypot(thrust[..., 0], thrust[..., 1]), thrust[..., 2])
    return np.where(thrust[..., 2] > 0, lean, np.pi)


def test_a_plain_agent_has_no_limits() -> None:
    assert limits(flown_by(ir.PLAIN), flight(0)) == []
    assert downwash(flown_by(ir.PLAIN), flight(0)) == []
    mission = mission_of([[5.0, 5.0, 5.0]] * 3, 4, obstacles=[still(ir.Ball((1.0, 1.0, 1.0), 0.5))])
    assert len(obstacles(mission, flight(0), strict=True)) == 1
