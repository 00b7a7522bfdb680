"""The line on a terminal: it says the stage, its round and the time, and is gone at the end."""

from __future__ import annotations

import io
import re
import time

from missionc.backends.api import Progress
from missionc.cli.progress import ProgressLine


def drawn(*heard: Progress) -> str:
    """Everything written while a backend says where it is."""
    stream = io.StringIO()
    with ProgressLine(stream) as line:
        for progress in heard:
            line.listen(progress)
            before = len(stream.getvalue())
            while len(stream.getvalue()) == before:
                time.sleep(0.01)
    return stream.getvalue()


def test_stage_round_and_detail_are_said() -> None:
    text = drawn(Progress("roadmap"), Progress("solve", 2, "187 nodes"))
    assert " s  building a roadmap" in text
    assert " s  searching for paths, round 2: 187 nodes" in text


def test_how_far_a_search_is_is_said() -> None:
    search = Progress("search", 4, planned=(3, 5), margin=-0.03)
    text = drawn(search, Progress("polish", 2, iteration=7, margin=0.01))
    assert " s  searching for trajectories, round 4: 3/5 agents, best margin -0.03 m" in text
    assert " s  optimizing trajectories, round 2, iteration 7: best margin 0.01 m" in text
    assert re.search(r"\r\x1b\[K +\d+\.\d s  searching", text)


def test_the_line_is_erased_at_the_end() -> None:
    assert drawn(Progress("solve")).endswith("\r\x1b[K")


def test_a_long_line_is_cut_to_the_terminal() -> None:
    lines = drawn(Progress("solve", 1, "x" * 500)).split("\r\x1b[K")
    assert max(len(line) for line in lines) < 500
