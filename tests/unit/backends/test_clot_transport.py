"""Algorithm 1 of the transport backend: its prior, its directions, its weights, and what a whole run does."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is not installed")

from numpy.typing import NDArray
from scipy.linalg import null_space
from torch import Tensor

from missionc.backends.clot.paper.transport import (
    End,
    Fixed,
    Free,
    Prior,
    _by_logarithms,
    _by_scaling,
    directions,
    prior,
    rotations,
    row_softmax,
    sinkhorn,
    smoother,
    transport,
)
from missionc.backends.clot.settings import Coupling, Polytope, TransportSettings

Array = NDArray[np.float64]

DIMS = (1, 2, 3, 4, 5)
ENDS = torch.tensor([True] + [False] * 18 + [True])


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def no_places(batch: int, dim: int = 2) -> tuple[Tensor, Tensor]:
    return torch.zeros(batch, 0, dtype=torch.int64), torch.zeros(batch, 0, dim)


# Directions


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("polytope", Polytope)
def test_corners_are_unit_vectors_that_sum_to_zero_and_look_everywhere_alike(polytope: Polytope, dim: int) -> None:
    corners = directions(polytope, dim)
    count = {Polytope.SIMPLEX: dim + 1, Polytope.ORTHOPLEX: 2 * dim, Polytope.CUBE: 2**dim}[polytope]
    assert corners.shape == (count, dim)
    assert torch.allclose(corners.norm(dim=1), torch.ones(count, dtype=torch.float64))
    assert torch.allclose(corners.sum(0), torch.zeros(dim, dtype=torch.float64), atol=1e-12)
    assert torch.allclose(corners.mT @ corners, torch.eye(dim, dtype=torch.float64) * count / dim)
    assert len({tuple(corner) for corner in corners.tolist()}) == count


@pytest.mark.parametrize("dim", DIMS)
def test_rotations_keep_lengths_and_orientation(dim: int) -> None:
    turned = rotations((7, 11), dim, seeded()).double()
    assert turned.shape == (7, 11, dim, dim)
    assert torch.allclose(turned @ turned.mT, torch.eye(dim, dtype=torch.float64).expand_as(turned), atol=1e-6)
    assert torch.allclose(torch.linalg.det(turned), torch.ones(7, 11, dtype=torch.float64), atol=1e-6)


@pytest.mark.parametrize("dim", DIMS[1:])
def test_rotations_are_uniform(dim: int) -> None:
    turned = rotations((40_000,), dim, seeded()).double()
    entries = turned.flatten(1)
    # Uniform rotations have entries of mean 0 and variance 1/dim, a known fourth moment, and no correlation (but in the
    # plane, where two entries say all).
    assert entries.mean(0).abs().max() < 0.02
    assert (entries.square().mean(0) - 1 / dim).abs().max() < 0.02
    fourth = 3 / 8 if dim == 2 else 3 / (dim * (dim + 2))
    assert (entries.pow(4).mean(0) - fourth).abs().max() < 0.02
    if dim > 2:
        correlation = entries.mT @ entries / len(entries) - torch.eye(dim * dim, dtype=torch.float64) / dim
        assert correlation.abs().max() < 0.02


# Weights


@pytest.mark.parametrize(("steps", "ways", "regulariser"), [(5, 4, 0.05), (48, 8, 0.08), (48, 3, 0.3), (3, 14, 1.0)])
def test_sinkhorn_finds_the_plan_that_python_optimal_transport_finds(steps: int, ways: int, regulariser: float) -> None:
    import ot

    costs = torch.rand(3, steps, ways, generator=seeded(steps), dtype=torch.float64)
    ours = sinkhorn(costs, regulariser, tolerance=1e-12, limit=100_000)
    for cost, found in zip(costs, ours, strict=True):
        theirs = ot.sinkhorn(
            np.full(steps, 1 / steps),
            np.full(ways, 1 / ways),
            cost.numpy(),
            regulariser,
            method="sinkhorn_log",
            numItermax=100_000,
            stopThr=1e-13,
        )
        assert np.abs(found.numpy() - theirs).max() < 1e-6


def test_sinkhorn_without_enough_rounds_still_gives_every_waypoint_its_share() -> None:
    costs = torch.rand(2, 30, 4, generator=seeded()) * 50
    weights = sinkhorn(costs, 0.05, limit=1)
    assert torch.allclose(weights.sum(2), torch.full((2, 30), 1 / 30), rtol=1e-4)
    assert (weights.sum(1) - 1 / 4).abs().max() > 1e-2


def test_sinkhorn_is_the_same_by_scaling_and_on_logarithms_and_finite_where_scaling_underflows() -> None:
    costs = torch.rand(4, 48, 4, generator=seeded())
    kernel = (costs - costs.amin(2, keepdim=True)) / -0.08
    scaled, logarithmic = (by(kernel, 1e-6, 500) for by in (lambda k, *how: _by_scaling(k.exp(), *how), _by_logarithms))
    assert torch.allclose(scaled, logarithmic, atol=1e-6)
    assert bool(sinkhorn(costs, 1e-4).isfinite().all())


def test_softmax_is_the_plan_where_directions_already_receive_the_same() -> None:
    first = torch.rand(6, generator=seeded(), dtype=torch.float64)
    costs = torch.stack([first.roll(shift) for shift in range(6)])[None]
    assert torch.allclose(row_softmax(costs, 0.1), sinkhorn(costs, 0.1, tolerance=1e-13), atol=1e-12)


def test_no_other_choice_of_single_waypoints_costs_less_than_softmax() -> None:
    costs = torch.rand(1, 20, 5, generator=seeded(), dtype=torch.float64)

    def objective(weights: Tensor) -> float:
        return float((weights * costs + 0.1 * weights * weights.log()).sum())

    best = row_softmax(costs, 0.1)
    for seed in range(20):
        other = torch.softmax(best.log() + 0.1 * torch.randn(best.shape, generator=seeded(seed)), 2) / 20
        assert objective(best) < objective(other)


# Prior


STEPS = 16
PLACES = (torch.tensor([[4, 9], [11, 6]]), torch.tensor([[[1.0, 2.0], [3.0, -1.0]], [[0.5, 0.0], [2.0, 2.0]]]))
BOTH_ENDS = (Fixed(torch.tensor([0.0, 0.0])), Fixed(torch.tensor([4.0, 1.0]), at_rest=False))


def conditioned(start: End, finish: End, acceleration: float, steps: list[int], at: Array) -> tuple[Array, Array]:
    """Mean and covariance of one candidate's waypoints: all motions that meet what is known, weighed by their noise.

    A motion is a position, a velocity and an acceleration at each step; its
    waypoints follow by summing up twice. The first two are anything, alike.
    """
    # Waypoints -1 … STEPS: one more on either side says what rest means.
    count = STEPS + 2
    row, column = np.indices((count, count))
    effect = np.where(column == 0, 1.0, np.where(column == 1, row, np.maximum(row + 1 - column, 0)))
    observe, seen = [effect[step + 1] for step in steps], [*at]
    for end, here, outside in ((start, 1, 0), (finish, STEPS, STEPS + 1)):
        if isinstance(end, Fixed):
            observe.append(effect[here])
            seen.append(end.position.numpy())
            if end.at_rest:
                observe.append(effect[here] - effect[outside])
                seen.append(np.zeros(at.shape[1]))
    one = np.linalg.lstsq(np.array(observe), np.array(seen), rcond=None)[0]
    others = null_space(np.array(observe))
    mean = effect @ (one - others @ np.linalg.lstsq(others[2:], one[2:], rcond=None)[0])
    spread = effect @ others
    covariance = acceleration**2 * spread @ np.linalg.inv(others[2:].T @ others[2:]) @ spread.T
    return mean[1:-1], covariance[1:-1, 1:-1]


@pytest.mark.parametrize(
    ("start", "finish"),
    [
        BOTH_ENDS,
        (BOTH_ENDS[1], BOTH_ENDS[0]),
        (BOTH_ENDS[0], BOTH_ENDS[0]),
        (BOTH_ENDS[0], Free()),
        (Free(), Free()),
    ],
)
def test_prior_is_the_gaussian_of_white_accelerations_given_what_is_known(start: End, finish: End) -> None:
    one = prior(STEPS, start, finish, 0.1, *PLACES)
    for candidate in range(2):
        steps, at = PLACES[0][candidate].tolist(), PLACES[1][candidate].numpy()
        mean, covariance = conditioned(start, finish, 0.1, steps, at)
        assert np.abs(one.mean[candidate].numpy() - mean).max() < 1e-3
        repeated = prior(
            STEPS,
            start,
            finish,
            0.1,
            *(part[candidate : candidate + 1].repeat_interleave(20_000, 0) for part in PLACES),
        )
        samples = (repeated.sample(seeded(candidate)) - repeated.mean).double()
        for axis in range(2):
            found = (samples[..., axis].mT @ samples[..., axis] / len(samples)).numpy()
            assert np.abs(found - covariance).max() < 0.05 * covariance.max()
        across = samples[..., 0].mT @ samples[..., 1] / len(samples)
        assert float(across.abs().max()) < 0.05 * covariance.max()


def test_what_is_known_is_met_bit_by_bit_by_every_sample() -> None:
    start, finish = torch.tensor([0.1, 0.2]), torch.tensor([[4.3, 1.7], [4.1, 1.9]])
    one = prior(STEPS, Fixed(start), Fixed(finish), 0.1, *PLACES)
    for waypoints in (one.mean, one.sample(seeded()), one.sample(seeded(), 100.0)):
        assert waypoints.dtype == torch.float32
        assert torch.equal(waypoints[:, 0], start.expand(2, 2))
        assert torch.equal(waypoints[:, -1], finish)
        for place in range(2):
            assert torch.equal(waypoints[torch.arange(2), PLACES[0][:, place]], PLACES[1][:, place])


def test_a_fixed_end_counts_more_than_a_place_and_the_last_place_more_than_the_first() -> None:
    steps = torch.tensor([[0, 5, 5]])
    at = torch.tensor([[[9.0, 9.0], [1.0, 1.0], [2.0, 2.0]]])
    one = prior(STEPS, *BOTH_ENDS, 0.1, steps, at)
    assert torch.equal(one.mean[0, 0], torch.zeros(2))
    assert torch.equal(one.mean[0, 5], torch.full((2,), 2.0))


def test_sampling_with_scale_zero_gives_the_mean_and_a_seed_gives_the_same_bytes() -> None:
    one = prior(STEPS, *BOTH_ENDS, 0.1, *PLACES)
    assert torch.equal(one.sample(seeded(), 0.0), one.mean)
    assert torch.equal(one.sample(seeded(3)), one.sample(seeded(3)))
    assert not torch.equal(one.sample(seeded(3)), one.sample(seeded(4)))


@pytest.mark.parametrize(
    ("start", "finish"), [(Free(), Free()), (BOTH_ENDS[1], Free()), (Free(), BOTH_ENDS[1])], ids=["no", "first", "last"]
)
def test_a_prior_that_could_drift_anywhere_is_refused(start: End, finish: End) -> None:
    with pytest.raises(ValueError, match="two pinned waypoints"):
        prior(STEPS, start, finish, 0.1, *no_places(3))


def test_the_smoother_keeps_fixed_waypoints_and_lengthens_no_step() -> None:
    fixed = torch.zeros(2, 40, dtype=torch.bool)
    fixed[0, [0, 25]] = True
    for width in (0.01, 0.8, 5.0):
        kernel = smoother(fixed, width)
        assert kernel.shape == (2, 40, 40)
        assert (kernel >= 0).all()
        assert float(kernel.sum(-1).max()) <= 1 + 1e-6
        assert not kernel[fixed].any()
        assert not kernel.mT[fixed].any()
        assert torch.equal(smoother(fixed[0], width), kernel[0])
    assert torch.allclose(smoother(fixed, 5.0)[1].sum(-1), torch.ones(40))
    assert torch.equal(smoother(fixed, 0.01)[1], torch.eye(40))


# The whole


def towards(target: Tensor, weight: float | Tensor = 1.0) -> object:
    """The cost of being away from a curve: metres squared."""
    return lambda waypoints, probes: weight * (probes - target[..., :, None, :]).square().sum(-1)


def straight(batch: int, dim: int = 2) -> Tensor:
    return torch.linspace(0, 1, 20)[None, :, None].repeat(batch, 1, dim)


@pytest.mark.parametrize("coupling", Coupling)
@pytest.mark.parametrize("polytope", Polytope)
@pytest.mark.parametrize("dim", [2, 3])
def test_transport_brings_waypoints_to_where_they_cost_less(coupling: Coupling, polytope: Polytope, dim: int) -> None:
    before = straight(6, dim)
    target = before + torch.sin(torch.linspace(0, torch.pi, 20))[:, None] * torch.eye(dim)[1]
    settings = TransportSettings(coupling=coupling, polytope=polytope, probes=2)
    after = transport(before, ENDS, towards(target), settings, seeded())
    assert (after - target).norm(dim=-1).mean() < 0.3 * (before - target).norm(dim=-1).mean()
    assert torch.equal(before, straight(6, dim))


def test_fixed_waypoints_keep_their_place_bit_by_bit() -> None:
    before = straight(3) + 0.1 * torch.randn(3, 20, 2, generator=seeded())
    fixed = torch.rand(3, 20, generator=seeded(1)) < 0.3
    target = torch.tensor([5.0, -5.0]).expand(20, 2)
    after = transport(before, fixed, towards(target), TransportSettings(), seeded())
    assert torch.equal(after[fixed], before[fixed])
    assert (after[~fixed] != before[~fixed]).any(-1).all()


def test_costs_of_fixed_waypoints_are_not_read() -> None:
    def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
        return probes.square().sum(-1).masked_fill(ENDS[:, None], torch.nan)

    for coupling in Coupling:
        settings = TransportSettings(coupling=coupling, iterations=3)
        assert transport(straight(2), ENDS, cost, settings, seeded()).isfinite().all()


@pytest.mark.parametrize("coupling", Coupling)
def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not(coupling: Coupling) -> None:
    target = torch.rand(20, 2, generator=seeded())
    runs = [
        transport(straight(4), ENDS, towards(target), TransportSettings(coupling=coupling), seeded(seed))
        for seed in (1, 1, 2)
    ]
    assert torch.equal(runs[0], runs[1])
    assert not torch.equal(runs[0], runs[2])


@pytest.mark.parametrize("coupling", Coupling)
def test_each_share_of_a_batch_is_moved_as_if_it_were_alone(coupling: Coupling) -> None:
    """The second share needs more rounds of Sinkhorn's iteration than the first."""
    target = torch.rand(4, 20, 2, generator=seeded())
    weight = torch.tensor([0.01, 0.01, 9.0, 9.0])[:, None, None]
    settings = TransportSettings(coupling=coupling, iterations=8)
    whole = transport(straight(4), ENDS, towards(target, weight), settings, [seeded(1), seeded(2)])
    for number, share in enumerate((slice(0, 2), slice(2, 4))):
        alone = transport(straight(2), ENDS, towards(target[share], weight[share]), settings, seeded(number + 1))
        assert torch.allclose(whole[share], alone, atol=1e-6)


def test_a_candidate_that_costs_a_million_times_as_much_does_not_change_the_others() -> None:
    target = torch.rand(20, 2, generator=seeded())
    weight = torch.ones(4, 1, 1)
    alone = transport(straight(4), ENDS, towards(target, weight), TransportSettings(), seeded())
    weight[0] = 1e6
    beside = transport(straight(4), ENDS, towards(target, weight), TransportSettings(), seeded())
    assert torch.equal(alone[1:], beside[1:])


def test_waypoints_that_cost_the_same_everywhere_stay_where_they_are() -> None:
    after = transport(
        straight(2), ENDS, lambda _, probes: probes.new_zeros(probes.shape[:3]), TransportSettings(), seeded()
    )
    assert torch.allclose(after, straight(2), atol=1e-5)


def test_probes_lie_on_the_directions_at_equal_distances_up_to_the_radius() -> None:
    seen: list[Tensor] = []

    def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
        seen.append((probes - waypoints[:, :, None]).norm(dim=-1))
        return probes.square().sum(-1)

    settings = TransportSettings(iterations=3, first_radius=0.8, last_radius=0.2, probes=4)
    transport(straight(2), ENDS, cost, settings, seeded())
    for radius, distances in zip((0.8, 0.4, 0.2), seen, strict=True):
        expected = radius * torch.tensor([0.25, 0.5, 0.75, 1.0]).repeat(4)
        assert torch.allclose(distances, expected.expand(2, 20, 16), atol=1e-5)


def test_transport_ends_when_done_says_so() -> None:
    calls: list[int] = []
    rounds: list[int] = []

    def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
        rounds.append(len(rounds))
        return probes.square().sum(-1)

    def done(waypoints: Tensor) -> bool:
        calls.append(len(rounds))
        return len(rounds) >= 8

    settings = TransportSettings(iterations=100, check_every=4)
    transport(straight(2), ENDS, cost, settings, seeded(), done)
    assert calls == [0, 4, 8]
    assert len(rounds) == 8


def test_what_is_already_done_is_not_touched() -> None:
    before = straight(2)
    assert torch.equal(
        transport(before, ENDS, towards(before + 1), TransportSettings(), seeded(), lambda _: True), before
    )


def test_smoothed_steps_bring_a_robot_around_a_disc_without_tearing_its_path() -> None:
    """Straight through the middle of a disc of 1 m; the cost knows the disc and the distance to the neighbours."""
    steps, speed = 32, 0.4
    ends = torch.zeros(steps, dtype=torch.bool)
    ends[[0, -1]] = True
    start, finish = torch.tensor([-3.0, 0.1]), torch.tensor([3.0, 0.0])

    def depth(points: Tensor) -> Tensor:
        return (1.2 - points.norm(dim=-1)).clamp(min=0)

    def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
        padded = torch.cat([waypoints[:, :1], waypoints, waypoints[:, -1:]], 1)
        paces = [(probes - padded[:, shift : shift + steps, None]).norm(dim=-1) for shift in (0, 2)]
        return 4 * depth(probes) + sum((pace - 0.9 * speed).clamp(min=0) for pace in paces)

    def clear(waypoints: Tensor) -> Tensor:
        between = torch.cat([waypoints, (waypoints[:, 1:] + waypoints[:, :-1]) / 2], 1)
        pace = (waypoints[:, 1:] - waypoints[:, :-1]).norm(dim=-1).amax(-1)
        return (between.norm(dim=-1).amin(-1) > 1) & (pace < speed)

    guess = prior(steps, Fixed(start), Fixed(finish), 0.004, *no_places(32)).sample(seeded())
    assert int(clear(guess).sum()) == 0
    smooth = transport(guess, ends, cost, TransportSettings(), seeded())
    torn = transport(guess, ends, cost, TransportSettings(first_width=0.01, last_width=0.01), seeded())
    assert int(clear(smooth).sum()) >= 24
    assert int(clear(torn).sum()) < int(clear(smooth).sum())


@pytest.mark.gpu
def test_transport_runs_on_a_gpu_with_its_own_generator() -> None:
    generator = torch.Generator("cuda").manual_seed(0)
    one: Prior = prior(20, Fixed(torch.zeros(2)), Fixed(torch.ones(2)), 0.1, *(part.cuda() for part in no_places(8)))
    before, target = one.sample(generator), torch.full((20, 2), 0.5, device="cuda")
    after = transport(before, ENDS.cuda(), towards(target), TransportSettings(), generator)
    assert after.is_cuda
    assert (after - target).norm(dim=-1).mean() < (before - target).norm(dim=-1).mean()
