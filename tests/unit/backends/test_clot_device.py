"""Where the batches of Algorithm 1 are worked on: a GPU that is not there is refused; in a step nobody waits for it."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

pytest.importorskip("torch")

import torch
from torch import Tensor

from missionc.backends import load
from missionc.backends.api import Budget, Planned, Progress
from missionc.backends.clot.backend import BACKEND
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.paper.free_distance import Surroundings
from missionc.backends.clot.paper.motion_batch import team
from missionc.backends.clot.paper.prefix import about
from missionc.backends.clot.paper.prefix_check import prefix_margins
from missionc.backends.clot.paper.probe_cost import ProbeCost
from missionc.backends.clot.paper.torch_device import available, one_thread
from missionc.backends.clot.paper.transport import transport
from missionc.backends.clot.settings import ProbeWeights, TransportSettings
from missionc.backends.options import DEVICES, Options
from missionc.base.diagnostics.code import NO_DEVICE, NOT_ITS_FLAG
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.cli import app
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel, Node
from missionc.verification.verify_plan import verify

TRIO = """\
mission trio
time step 0.4 s, horizon 4 s
world (0, 0) to (8, 6)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (5, 3) to (7.5, 5.5)
obstacle rock = disc at (3.8, 2.8) radius 0.5
obstacle cart = box (2, 4) to (2.4, 5) moving (0.5 m/s, 0 m/s)
team drone[3] {
  radius 0.1 m
  dynamics double_integrator(speed <= 4 m/s, acceleration <= 9 m/s^2)
  start in base
}
graph radio = proximity 1.5 m
formation row = line of drone spacing 0.6 m tolerance 0.15 m
require visit: eventually[0, 4 s] every drone: goal
require link:  always[0, 4 s] connected(radio)
require row:   eventually[1.2 s, 2.8 s] row
require near:  every drone: always[0, 2 s] (base or (speed <= 3 m/s until[0, 2 s] goal) or distance(goal) >= 0.2)
require some:  every drone: eventually[0, 4 s] somewhere[hops 0..1 on radio] goal
"""
PLAIN = TRIO.split("graph")[0] + "require visit: eventually[0, 4 s] every drone: goal\n"
NO_GPU = pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")


def meant(text: str) -> tuple[Mission, Kernel]:
    checked = driver.check(Source("a.mission", text), backend=driver.ANY_BACKEND)
    assert checked.mission is not None
    assert checked.kernel is not None, checked.findings
    return checked.mission, checked.kernel


class Batch:
    """One agent among two planned ones, and random candidates of it."""

    def __init__(self, device: str, dtype: torch.dtype = torch.float32) -> None:
        self.mission, self.kernel = meant(TRIO)
        self.device, self.dtype = torch.device(device), dtype
        generator = torch.Generator().manual_seed(3)
        drawn = torch.rand((8, 3, self.mission.steps + 1, 2), generator=generator, dtype=torch.float64)
        joint = (drawn * torch.tensor([7.0, 5.0]) + 0.5).to(self.device, dtype)
        self.own, self.others = joint[:, 1], joint[:1, [0, 2]]
        offsets = torch.rand((8, self.mission.steps + 1, 4, 2), generator=generator, dtype=torch.float64)
        self.probes = self.own[:, :, None] + offsets.to(self.device, dtype)

    def goals(self, newest: int | None) -> tuple[Node, ...]:
        return about([wanted.formula for wanted in build(self.kernel).requirements], frozenset({0, 1, 2}), {}, newest)

    def cost(self) -> ProbeCost:
        crew = team(self.mission, self.device, self.dtype)
        around = Surroundings(self.mission, 2, self.device, self.dtype)
        return ProbeCost(self.mission, crew, 1, (0, 2), self.goals(1), around, ProbeWeights(), True)

    def costs(self) -> Tensor:
        return self.cost()(self.own, self.probes, self.others)

    def margins(self) -> Tensor:
        crew = team(self.mission, self.device, self.dtype)
        around = Surroundings(self.mission, 4, self.device, self.dtype)
        return prefix_margins(crew, 1, (0, 2), self.own, self.others, self.goals(None), around).amin(dim=0)


def test_single_precision_costs_and_margins_are_those_of_double_precision_but_for_rounding() -> None:
    single, double = Batch("cpu"), Batch("cpu", torch.float64)
    assert single.costs().dtype is torch.float32
    assert torch.allclose(single.costs().double(), double.costs(), rtol=1e-4, atol=1e-3)
    assert torch.allclose(single.margins().double(), double.margins(), atol=1e-4)


def test_inside_an_iteration_nothing_is_read_back_from_the_device() -> None:
    """Tensors of the device `meta` have no content: whoever waited for a number of theirs would raise here."""
    batch = Batch("meta")
    cost, fixed = batch.cost(), torch.zeros(batch.mission.steps + 1, dtype=torch.bool, device="meta")
    moved = transport(
        batch.own,
        fixed,
        lambda waypoints, probes: cost(waypoints, probes, batch.others),
        TransportSettings(iterations=3),
        torch.Generator(),
    )
    assert moved.device.type == "meta"
    assert batch.margins().device.type == "meta"
    with pytest.raises(RuntimeError):
        float(moved.sum())


def test_the_command_line_and_the_backend_know_the_same_devices() -> None:
    assert DEVICES == ("cpu", "cuda")
    assert available("cpu")
    assert not available("abacus")


@NO_GPU
@pytest.mark.parametrize("backend", ["clot", "hybrid"])
def test_a_gpu_that_is_not_there_is_said_before_anything_is_planned(backend: str) -> None:
    finding = load.load(backend, Options(device="cuda"))
    assert isinstance(finding, Diagnostic)
    assert finding.code is NO_DEVICE
    assert finding.help is not None


@NO_GPU
def test_the_command_refuses_a_gpu_that_is_not_there(tmp_path, capsys) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "trio.mission").write_text(PLAIN + "solve with clot\n")
    status = app.main(["compile", str(tmp_path / "trio.mission"), "--device", "cuda", "-o", str(tmp_path / "out")])
    assert status == 1
    assert "error[MC406]: torch has no device `cuda` here" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_device_is_refused_where_the_mission_goes_to_a_solver() -> None:
    finding = load.load("smt", Options(device="cuda"))
    assert isinstance(finding, Diagnostic)
    assert finding.code is NOT_ITS_FLAG
    assert "`--device cuda`" in finding.message


@pytest.fixture
def three_threads() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    yield
    torch.set_num_threads(before)


def test_a_search_takes_one_thread_and_gives_the_others_back(three_threads: None) -> None:
    mission, kernel = meant(TRIO)
    heard: list[int] = []

    def listen(progress: Progress) -> None:
        if progress.stage == "search":
            heard.append(torch.get_num_threads())

    BACKEND.plan(mission, kernel, Options(preset="search"), Budget(time.monotonic() + 3, on_progress=listen))
    assert set(heard) == {1}
    assert torch.get_num_threads() == 3


def test_threads_are_given_back_after_a_failure_too(three_threads: None) -> None:
    with pytest.raises(KeyError), one_thread():
        raise KeyError
    assert torch.get_num_threads() == 3


@pytest.mark.gpu
def test_a_gpu_gives_the_costs_and_margins_of_the_cpu() -> None:
    here, there = Batch("cpu"), Batch("cuda")
    assert torch.allclose(here.costs(), there.costs().cpu(), rtol=1e-4, atol=1e-3)
    assert torch.allclose(here.margins(), there.margins().cpu(), atol=1e-4)


@pytest.mark.gpu
@pytest.mark.parametrize("preset", ["search", "mpot"])
def test_a_search_on_a_gpu_finds_a_plan_that_the_verifier_accepts(preset: str) -> None:
    mission, kernel = meant(PLAIN)
    options = Options(preset=preset, samples=64, device="cuda")
    outcome = BACKEND.plan(mission, kernel, options, Budget(time.monotonic() + 120))
    assert isinstance(outcome, Planned)
    assert verify(mission, kernel, outcome.trace).passed


def test_the_device_is_recorded_beside_the_preset() -> None:
    outcome = driver.compile(Source("a.mission", PLAIN), backend="clot").outcome
    assert isinstance(outcome, Verified)
    assert '"device": "cpu"' in dict(outcome.files)["manifest.json"].decode()
