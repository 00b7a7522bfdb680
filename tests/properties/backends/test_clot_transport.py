"""What transport promises for any cost and any settings."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

torch = pytest.importorskip("torch", reason="torch is not installed")

from torch import Tensor

from missionc.backends.clot.paper.transport import Fixed, prior, row_softmax, sinkhorn, transport
from missionc.backends.clot.settings import Coupling, Polytope, TransportSettings

SEEDS = st.integers(0, 2**32 - 1)
SETTINGS = st.builds(
    TransportSettings,
    iterations=st.integers(0, 6),
    first_radius=st.floats(0.05, 2),
    last_radius=st.floats(0.01, 2),
    first_width=st.floats(0.1, 10),
    last_width=st.floats(0.1, 10),
    regulariser=st.floats(0.01, 1),
    flat=st.floats(0.01, 2),
    polytope=st.sampled_from(Polytope),
    probes=st.integers(1, 3),
    coupling=st.sampled_from(Coupling),
    check_every=st.integers(1, 3),
)


@given(SEEDS, st.integers(1, 3), st.integers(1, 30), st.integers(2, 9), st.floats(0.01, 10), st.floats(0.001, 1000))
def test_weights_share_the_mass_as_promised(
    seed: int, batch: int, steps: int, ways: int, regulariser: float, size: float
) -> None:
    costs = torch.rand(batch, steps, ways, generator=torch.Generator().manual_seed(seed), dtype=torch.float64) * size
    rows = torch.full((batch, steps), 1 / steps, dtype=torch.float64)
    for weights in (sinkhorn(costs, regulariser), row_softmax(costs, regulariser)):
        assert weights.shape == costs.shape
        assert (weights >= 0).all()
        assert torch.allclose(weights.sum(2), rows, rtol=1e-9)
    if size <= 10 * regulariser:
        received = sinkhorn(costs, regulariser, tolerance=1e-6, limit=100_000).sum(1)
        assert float((received - 1 / ways).abs().sum(1).max()) <= 1e-6


@given(SEEDS, SETTINGS, st.integers(2, 3), st.floats(0, 1))
def test_nothing_moves_further_than_its_radii_and_fixed_waypoints_not_at_all(
    seed: int, settings: TransportSettings, dim: int, share: float
) -> None:
    generator = torch.Generator().manual_seed(seed)
    before = torch.randn(2, 9, dim, generator=generator)
    fixed = torch.rand(2, 9, generator=generator) < share

    def rough(waypoints: Tensor, probes: Tensor) -> Tensor:
        return (probes * 7).sin().sum(-1) * 100

    after = transport(before, fixed, rough, settings, generator)
    ratio = settings.last_radius / settings.first_radius
    last = max(1, settings.iterations - 1)
    reach = sum(settings.first_radius * ratio ** (step / last) for step in range(settings.iterations))
    assert float((after - before).norm(dim=-1).max()) <= reach + 1e-4
    assert torch.equal(after[fixed], before[fixed])


@given(SEEDS, st.integers(3, 40), st.integers(0, 4), st.booleans(), st.floats(1e-4, 10))
def test_samples_meet_ends_and_places(seed: int, steps: int, places: int, at_rest: bool, acceleration: float) -> None:
    generator = torch.Generator().manual_seed(seed)
    start, finish = torch.randn(2, 3, 2, generator=generator) * 10
    # Different steps for each place, none of them an end.
    inner = torch.stack([torch.randperm(steps - 2, generator=generator)[:places] + 1 for _ in range(3)])
    at = torch.randn(*inner.shape, 2, generator=generator) * 10
    samples = prior(steps, Fixed(start, at_rest), Fixed(finish, at_rest), acceleration, inner, at).sample(generator)
    assert samples.isfinite().all()
    assert torch.equal(samples[:, 0], start)
    assert torch.equal(samples[:, -1], finish)
    for place in range(inner.shape[1]):
        assert torch.equal(samples[torch.arange(3), inner[:, place]], at[:, place])
