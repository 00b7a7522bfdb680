"""The missions of `missions/both_sides`, half of them impossible: a label in the name, and a reason in the first lines.

Their answers are measured by `bench/both_sides.py`; here the bench asks and counts a few of them. Of those that are
possible and seldom planned there are motions made by hand.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from missionc.compiler import driver
from missionc.verification.verify_plan import verify
from tests.support.legal_plans import straight

ROOT = Path(__file__).resolve().parents[2]
BENCH = ROOT / "bench" / "both_sides.py"
FILES = sorted((ROOT / "missions" / "both_sides").glob("*.mission"))
LABELS = ("impossible", "possible")

Waypoints = list[tuple[int, tuple[float, ...]]]

MOTIONS: dict[str, list[Waypoints]] = {
    "possible_errand_in_order": [[(0, (7, 2)), (6, (13, 2)), (18, (1, 2))]],
    "possible_far_from_each_other": [
        [(0, (3, 3)), (8, (0, 0))],
        [(0, (5, 3)), (8, (8, 0))],
        [(0, (3, 5)), (8, (0, 8))],
        [(0, (5, 5)), (8, (8, 8))],
        [(0, (4, 4))],
    ],
    "possible_five_in_a_square": [
        [(0, (1, 1)), (3, (1, 1)), (6, (4, 4))],
        [(0, (3, 1)), (3, (3, 5.5)), (4, (4, 5.5))],
        [(0, (5, 1)), (2, (4.75, 4.75))],
        [(0, (7, 1)), (3, (7, 5.5)), (4, (5.5, 5.5))],
        [(0, (9, 1)), (3, (9, 1)), (6, (5.5, 4))],
    ],
    "possible_four_corners": [
        [(0, (4.8, 5)), (6, (1, 1)), (14, (1, 9))],
        [(0, (5.2, 5)), (6, (9, 1)), (14, (9, 9))],
    ],
    "possible_nine_in_a_cube": [
        [(0, (1, 1, 0.5)), (2, (1, 1, 0.5)), (5, (4, 4, 3.3))],
        [(0, (4, 1, 0.5)), (5, (4, 1, 0.5)), (8, (4, 4, 2))],
        [(0, (7, 1, 0.5)), (2, (7, 1, 0.5)), (5, (5.3, 4, 3.3))],
        [(0, (1, 4, 0.5)), (5, (1, 4, 0.5)), (8, (4, 5.3, 2))],
        [(0, (4, 4, 0.5)), (2, (4.65, 4.65, 2.65))],
        [(0, (7, 4, 0.5)), (5, (7, 4, 0.5)), (8, (5.3, 4, 2))],
        [(0, (1, 7, 0.5)), (2, (1, 7, 0.5)), (5, (4, 5.3, 3.3))],
        [(0, (4, 7, 0.5)), (5, (4, 7, 0.5)), (8, (5.3, 5.3, 2))],
        [(0, (7, 7, 0.5)), (2, (7, 7, 0.5)), (5, (5.3, 5.3, 3.3))],
    ],
    "possible_out_and_back": [[(0, (1, 2)), (7, (8, 2)), (14, (1.5, 2))]],
    "possible_soonest_four_corners": [
        [(0, (4.8, 5)), (6, (1, 1)), (14, (1, 9))],
        [(0, (5.2, 5)), (6, (9, 1)), (14, (9, 9))],
    ],
    "possible_tall_tower": [[(0, (2, 2, 1)), (4, (2, 2, 9)), (9, (2, 2, 0.5))]],
    "possible_too_often_at_both": [
        [(0, (2.5, 2)), (4, (6, 2)), (7, (3, 2)), (10, (6, 2)), (13, (3, 2)), (16, (6, 2)), (19, (3, 2))]
    ],
}
"""Of those that are seldom planned: each agent's way, straight and at one speed between places at steps, in metres."""


def title(path: Path) -> str:
    return path.stem


def test_a_mission_of_both_sides_says_in_its_first_line_what_its_name_says(subtests: pytest.Subtests) -> None:
    for path in FILES:
        with subtests.test(title(path)):
            first, *_ = path.read_text(encoding="utf-8").splitlines()
            label, _, subject = path.stem.partition("_")
            assert label in LABELS
            assert subject
            assert first.startswith(f"# {label.capitalize()}: ")
            checked = driver.check(path)
            assert checked.mission is not None
            assert checked.mission.name == path.stem


def test_there_are_thirty_missions_of_either_label_for_one_to_ten_agents_in_planes_and_volumes() -> None:
    for label in LABELS:
        missions = [driver.check(path).mission for path in FILES if path.stem.startswith(label)]
        assert len(missions) >= 30
        assert {mission.dimension for mission in missions if mission} == {2, 3}
        sizes = {len(mission.agents) for mission in missions if mission}
        assert min(sizes) == 1
        assert max(sizes) == 10


def test_check_refuses_some_that_are_impossible_and_none_that_is_possible() -> None:
    refused = [path.stem for path in FILES if any(not each.code.warning for each in driver.check(path).findings)]
    assert refused
    assert [name for name in refused if name.startswith("possible")] == []


@pytest.mark.parametrize("name", MOTIONS)
def test_a_motion_made_by_hand_satisfies_what_is_called_possible(name: str) -> None:
    checked = driver.check(ROOT / "missions" / "both_sides" / f"{name}.mission")
    assert checked.mission is not None
    assert checked.kernel is not None
    steps = np.arange(checked.mission.steps + 1)
    ways = [
        np.stack(
            [
                np.interp(steps, *zip(*((step, place[axis]) for step, place in way), strict=True))
                for axis in range(len(way[0][1]))
            ],
            axis=-1,
        )
        for way in MOTIONS[name]
    ]
    certificate = verify(checked.mission, checked.kernel, straight(np.stack(ways)))
    assert [f"{check.name} {check.subject} {check.margin:g}" for check in certificate.failures] == []


def test_the_bench_tells_labels_answers_and_sides() -> None:
    command = [sys.executable, str(BENCH), "--only", "meeting_too_soon", "possible_shortest_handover"]
    came = subprocess.run(command, capture_output=True, text=True, check=False)
    rows = [line for line in came.stdout.splitlines() if line.startswith(("| impossible_", "| possible_"))]
    assert [[cell.strip() for cell in row.split("|")[1:3]] for row in rows] == [
        ["impossible_meeting_too_soon", "impossible"],
        ["possible_meeting_too_soon", "possible"],
        ["possible_shortest_handover", "possible"],
    ]
    assert "| planned |" in rows[-1]
    assert "plans of the impossible: 0" in came.stdout
    assert "wrong refusals of the possible: 0" in came.stdout
    assert came.returncode == 0, came.stderr


def test_the_bench_says_of_a_wrong_answer_that_it_is_wrong(tmp_path: Path) -> None:
    wrong = tmp_path / "impossible_rest.mission"
    wrong.write_text(
        "mission rest\ntime step 1 s, horizon 4 s\nworld (0, 0) to (4, 4)\n"
        "agent cart { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1) }\n"
        "require move: cart: eventually[0, 4 s] x >= 2\n",
        encoding="utf-8",
    )
    came = subprocess.run([sys.executable, str(BENCH), str(wrong)], capture_output=True, text=True, check=False)
    assert "planned (wrong)" in came.stdout
    assert "plans of the impossible: 1" in came.stdout
    assert came.returncode == 1, came.stderr
