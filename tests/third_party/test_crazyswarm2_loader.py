"""Crazyswarm2's own loader reads the trajectories that are exported for it, and flies what was verified.

Its sources are no package: ``MISSIONC_CRAZYSWARM2`` names the folder of theirs that has ``uav_trajectory.py``.
"""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.output.export.formats import FORMATS, Exported
from tests.support.hand_made_flights import place, turning, wandered

pytestmark = pytest.mark.third_party

FOLDER = "MISSIONC_CRAZYSWARM2"
FLIGHTS = [
    pytest.param(wandered(2, 6, 2), id="plane"),
    pytest.param(turning(wandered(3, 7, 3, 1 / 3), 0.25), id="turns"),
]


@pytest.fixture(scope="module")
def loader() -> Any:
    if not os.environ.get(FOLDER):
        pytest.skip(f"{FOLDER} names no folder with uav_trajectory.py of Crazyswarm2")
    found = importlib.util.spec_from_file_location("uav_trajectory", Path(os.environ[FOLDER]) / "uav_trajectory.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


@pytest.mark.parametrize("flight", FLIGHTS)
def test_what_it_loads_is_the_flight_that_was_verified(flight: Any, loader: Any, tmp_path: Path) -> None:
    found = FORMATS["crazyswarm2"].export(flight)
    assert isinstance(found, Exported)
    files = {Path(name).stem: content for name, content in found.files.items() if name.endswith(".csv")}
    assert len(files) == len(flight.parts)
    for part in flight.parts:
        (tmp_path / "trajectory.csv").write_bytes(files[part.file])
        trajectory = loader.Trajectory()
        trajectory.loadcsv(tmp_path / "trajectory.csv")
        assert trajectory.n_pieces() == len(part.pieces.duration)
        assert trajectory.duration == pytest.approx(flight.duration, abs=1e-6)
        for time in np.linspace(0, float(trajectory.duration), 53):
            state = trajectory.eval(min(time, trajectory.duration))
            assert [*state.pos, state.yaw] == pytest.approx(place(part, time).tolist(), abs=1e-5)
            assert state.vel == pytest.approx(place(part, time, 1)[:3].tolist(), abs=1e-4)
            assert state.acc == pytest.approx(place(part, time, 2)[:3].tolist(), abs=1e-3)
