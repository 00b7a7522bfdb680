"""The farm: its trials are the same every time, its journal is gone on with, and it sees faults that are planted."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from farm import found_files
from farm.ended_command import Moment, run
from farm.journal import Journal, Line
from farm.kinds.drawings import DRAWINGS
from farm.kinds.killed_processes import KILLED_PROCESSES
from farm.kinds.lanes import LANES
from farm.kinds.mutated_texts import MUTATED_TEXTS
from farm.look import in_one_text, look
from farm.own_process import carried_out
from farm.referees import engines, second_reading
from farm.shrink import declarations, least, shrunk
from farm.table import table
from farm.trial import MISSION, Broken, Case, Fault, Kind
from farm.trials import KINDS, TURNS, trial
from missionc.backends.api import Impossible
from missionc.compiler import driver
from missionc.output.folder import write_folder
from missionc.verification.monitoring.evaluate import Evaluation
from tests.support.busy_processes import alive
from tests.support.small_missions import SMALL


def nobody(line: str) -> None:
    pass


def kind_of(carry_out: object, seconds: float = 20.0) -> Kind:
    return Kind("made", "for a test", lambda generator: Case(), carry_out, seconds)  # type: ignore[arg-type]


def farmed(folder: Path, kind: Kind, case: Case) -> list[tuple[Fault, str]]:
    """What one trial finds, and the text of the file in which it is kept."""
    found = look(Journal(folder / "farm"), 0, 0.01, folder / "found", "", nobody, lambda *_: (kind, case))
    return [(each.fault, each.path.read_text(encoding="utf-8")) for each in found]


# ------------------------------------------------------------- what is looked at


def test_a_seed_and_a_number_are_the_same_trial_in_whichever_order() -> None:
    numbers = range(len(TURNS))
    there, back = [trial(3, number) for number in numbers], [trial(3, number) for number in reversed(numbers)]
    assert there == back[::-1]
    assert trial(4, 0)[1] != there[0][1]
    assert {kind.name for kind, _ in there} == set(KINDS)


def test_trials_go_on_after_the_last_one_that_is_in_the_journal(tmp_path: Path) -> None:
    asked: list[tuple[int, int]] = []

    def of(seed: int, number: int) -> tuple[Kind, Case]:
        asked.append((seed, number))
        return kind_of(lambda case, folder: "well"), Case()

    for _ in range(2):
        look(Journal(tmp_path), 7, 0.01, tmp_path / "found", "tree", nobody, of)
    assert asked == [(7, number) for number in range(len(asked))]
    assert len(asked) >= 2
    assert [line.trial for line in Journal(tmp_path).lines] == [number for _, number in asked]
    assert Journal(tmp_path).next_trial(8) == 0
    assert Journal(tmp_path).commit == "tree"


def test_a_line_that_was_cut_off_is_none_and_the_next_one_is_whole(tmp_path: Path) -> None:
    line = Line(0, 0, "lanes", "planned", 0.5, "tree")
    Journal(tmp_path).add(line)
    with (tmp_path / "journal.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"seed": 0, "trial": 1, "ki')
    assert Journal(tmp_path).next_trial(0) == 1
    Journal(tmp_path).add(replace(line, trial=1))
    assert [each.trial for each in Journal(tmp_path).lines] == [0, 1]


def test_nobody_else_works_on_a_journal_meanwhile(tmp_path: Path) -> None:
    with Journal(tmp_path).at_work() as alone, Journal(tmp_path).at_work() as other:
        assert (alone, other) == (True, False)
    with Journal(tmp_path).at_work() as alone:
        assert alone


def test_the_table_counts_trials_and_findings_of_each_kind() -> None:
    lines = [Line(0, number, "lanes", "planned", 1.0, "") for number in range(3)]
    rows = list(table([*lines, Line(0, 3, "lattice", "fault", 2.0, "", "lattice: wrong")]))
    assert rows[2] == "| lanes | 3 | 60.0 | 3 | 0 | 3 planned |"
    assert rows[3] == "| lattice | 1 | 30.0 | 2 | 1 | 1 fault |"
    assert rows[4].startswith("| all | 4 |")


# ------------------------------------------------------------- processes of their own


def test_a_trial_that_does_not_end_is_a_finding_that_says_where() -> None:
    def endless(case: Case, folder: Path) -> str:
        from missionc.base import memory

        memory._status = lambda name: time.sleep(60)  # type: ignore[assignment,return-value,misc]
        memory.held()
        return "never"

    answer = carried_out(kind_of(endless, 0.3), Case())
    assert answer.fault is not None
    assert answer.fault.signature == "made: no end in held"


def test_a_crash_of_the_interpreter_is_a_finding() -> None:
    answer = carried_out(kind_of(lambda case, folder: os.kill(os.getpid(), signal.SIGSEGV)), Case())
    assert answer.fault is not None
    assert answer.fault.signature.startswith("made: SIGSEGV")


def test_a_command_that_ends_the_process_is_a_finding_and_who_is_ended_from_outside_found_nothing() -> None:
    answer = carried_out(kind_of(lambda *_: os._exit(143)), Case())
    assert answer.fault is not None
    assert answer.fault.signature == "made: exit 143"
    assert carried_out(kind_of(lambda *_: os.kill(os.getpid(), signal.SIGTERM)), Case()).fault is None


def test_a_process_that_is_left_over_is_a_finding_and_is_ended() -> None:
    started = "import time; time.sleep(60)"
    answer = carried_out(kind_of(lambda *_: str(subprocess.Popen([sys.executable, "-c", started]).pid)), Case())
    assert answer.fault is not None
    assert answer.fault.signature == "made: left over"
    end = time.monotonic() + 5
    while alive(int(answer.outcome)) and time.monotonic() < end:
        time.sleep(0.01)
    assert not alive(int(answer.outcome))


def test_a_trial_that_asks_for_too_much_memory_ends_alone() -> None:
    answer = carried_out(kind_of(lambda *_: len(bytearray(1 << 40))), Case(), memory=8 << 30)
    assert answer.fault is not None
    assert "MemoryError" in answer.fault.signature


# ------------------------------------------------------------- smaller, and kept


def test_what_is_left_of_a_list_is_what_the_fault_takes() -> None:
    parts = [str(number) for number in range(40)]
    assert least(parts, lambda some: {"3", "17", "38"} <= set(some)) == ["3", "17", "38"]


def test_a_text_is_shrunk_by_declarations_lines_words_and_numbers() -> None:
    text = SMALL + "require other: (some drone: (eventually[2 s, 5.25 s] goal)) and every drone: always[0, 6 s] base\n"
    small = shrunk(text, lambda text: "require" in text and "eventually" in text and "5" in text)
    assert len(small) < 25
    assert shrunk(text, lambda candidate: candidate == text) == text
    assert shrunk(text, lambda candidate: "team" in candidate, seconds=0.0) == text


def test_declarations_begin_at_the_margin_and_have_their_braces() -> None:
    assert [part.split()[0] for part in declarations(SMALL)] == [
        *("mission", "time", "world", "region", "region", "team", "solve", "require")
    ]
    assert "".join(declarations(SMALL)) == SMALL


def test_included_missions_are_put_where_they_are_included() -> None:
    case = Case({MISSION: 'mission m\ninclude "p.mission"\nsolve with smt\n', "p.mission": "region a\n", "x": "y"})
    assert in_one_text(case).files == {MISSION: "mission m\nregion a\nsolve with smt\n", "x": "y"}


@pytest.mark.parametrize("files", [{MISSION: "# a comment\n" + SMALL}, {MISSION: SMALL, "lanes.graphml": "<graphml/>"}])
def test_a_finding_is_read_as_it_was_kept(tmp_path: Path, files: dict[str, str]) -> None:
    case = Case(files, {"flags": ["--seed", "1"], "long": ["words"] * 40})
    fault = Fault("lanes: all motions", "A sentence that is a long one. " * 9, "seen")
    paths = [found_files.keep(tmp_path, LANES, case, fault, (5, 17)) for _ in range(2)]
    assert paths == found_files.kept_in(tmp_path)[::-1] or paths == found_files.kept_in(tmp_path)
    for path in paths:
        found = found_files.read(path)
        assert (found.kind, found.case, found.trial) == ("lanes", case, (5, 17))
        assert " ".join(found.promise.split()) == " ".join(fault.promise.split())


# ------------------------------------------------------------- planted faults


def test_a_command_that_raises_is_found_and_shrunk_to_what_it_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raising(file: Path, **named: object) -> None:
        if "obstacle" in file.read_text():
            raise ZeroDivisionError("planted")
        check(file, **named)

    from missionc.cli.commands import explain

    check = explain.check
    monkeypatch.setattr(explain, "check", raising)
    text = "mission m\nworld (0, 0) to (1, 1)\nobstacle a = disc at (1, 1) radius 1 m\nregion b = disc\n"
    ((fault, kept),) = farmed(tmp_path, MUTATED_TEXTS, Case({MISSION: text}))
    assert fault.signature == "mutated_texts: ZeroDivisionError in missionc/cli/commands/explain.py:_mission"
    head, _, body = kept.rpartition("# settings: {}\n")
    assert head.startswith("# promise: No command ends with an unexpected error.\n# trial: mutated_texts 0 0\n")
    assert body.strip() == "obstacle"


def test_an_operator_of_the_monitor_with_its_sense_swapped_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read_twice(case: Case, folder: Path) -> str:
        checked = driver.check(case.laid(folder), backend="any")
        if checked.mission is None or checked.kernel is None:
            return "refused"
        for seed in range(3):
            motion = second_reading.random_motion(checked.mission, seed)
            second_reading.agree(checked.mission, checked.kernel, motion, f"{seed}")
        return "agreed"

    kind, case = (
        kind_of(read_twice),
        Case({MISSION: SMALL + "require both: every drone: eventually[1 s, 6 s] (not base and not goal)\n"}),
    )
    assert carried_out(kind, case).outcome == "agreed"
    monkeypatch.setattr(Evaluation, "meet", Evaluation.join)
    answer = carried_out(kind, case)
    assert answer.fault is not None
    assert answer.fault.signature == "made: second reading"


def test_an_engine_that_says_impossible_where_some_motion_is_a_plan_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from missionc.backends.smt import backend

    def refusing(run: backend.Run) -> Generator[None, None, Impossible]:
        yield from ()
        return Impossible(("r0",), "planted", run.account.report())

    monkeypatch.setattr(backend.Run, "turns", refusing)
    answer = carried_out(LANES, LANES.draw(np.random.default_rng((0, 2))))
    assert answer.fault is not None
    assert answer.fault.signature == "lanes: all motions MC601"


def test_an_engine_that_calls_impossible_what_another_plans_or_proves_too_much_is_found(tmp_path: Path) -> None:
    def planned(name: str, value: float, least: float) -> engines.Reply:
        (tmp_path / name).mkdir()
        (tmp_path / name / "plan.json").write_text(
            f'{{"proven": {{"value": {value}, "least": {least}, "unit": "s", "by": "cover"}}}}'
        )
        return engines.Reply(name, "planned", frozenset(), tmp_path / name)

    plan, proud = planned("smt", 9, 8), planned("clot", 12, 10)
    engines.consistent([plan, plan])
    engines.consistent([plan, engines.Reply("clot", "impossible", frozenset({"MC601"}), tmp_path)])
    for replies in ([plan, proud], [plan, engines.Reply("clot", "impossible", frozenset({"MC609"}), tmp_path)]):
        with pytest.raises(Broken):
            engines.consistent(replies)


def test_a_reader_that_takes_the_axes_of_a_mirrored_entity_for_those_of_the_drawing_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("ezdxf")
    from missionc.frontend.maps.dxf import shapes

    case = next(
        case for seed in range(99) if (case := DRAWINGS.draw(np.random.default_rng((0, seed)))) and mirrored(case)
    )
    assert carried_out(DRAWINGS, case).outcome == "the same area"
    lift = shapes._Frame.lift
    monkeypatch.setattr(shapes._Frame, "lift", lambda self, points, *height: lift(self, points, *height) * (-1, 1, 1))
    answer = carried_out(DRAWINGS, case)
    assert answer.fault is not None
    assert answer.fault.signature == "drawings: area of a region"


def mirrored(case: Case) -> bool:
    """Whether it is whole and has a polyline whose own axes are not those of its block."""
    text = case.files["floor.dxf"].split("ENTITIES")
    return not case.settings and "\nLWPOLYLINE\n" in case.files["floor.dxf"] and "230\n-1.0" in "".join(text)


def test_a_writer_that_leaves_half_a_folder_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_place(target: Path, files: object, force: bool) -> None:
        target.mkdir(exist_ok=True)
        for name, content in files.items():  # type: ignore[attr-defined]
            (target / name).parent.mkdir(exist_ok=True)
            (target / name).write_bytes(content)

    monkeypatch.setattr(write_folder, "write_folder", in_place)
    settings = {"command": "compile", "signal": "SIGKILL", "at_change": True, "share": 0.5}
    answer = carried_out(KILLED_PROCESSES, Case({MISSION: SMALL.replace("drone[2]", "drone[1]")}, settings))
    assert answer.fault is not None
    assert answer.fault.signature == "killed_processes: compile half"


def test_a_command_is_ended_before_it_changes_a_file_for_the_nth_time(tmp_path: Path) -> None:
    mission = tmp_path / MISSION
    mission.write_text(SMALL.replace("  radius   0.1 m", "radius 0.1 m"))
    before = mission.read_text()
    words = ["fmt", str(mission)]
    ended = run(words, tmp_path, Moment("SIGKILL", 1))
    assert (ended.status, ended.changes, mission.read_text()) == (137, 1, before)
    assert run(words, tmp_path).status == 0
    assert mission.read_text() != before
