"""Sweeps on a Dask cluster: the same rows and bytes, whoever does the runs, and whoever dies over them."""

from __future__ import annotations

import csv
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CLUSTER_UNREACHABLE, OTHER_VERSIONS
from missionc.cli.app import main
from missionc.tools.sweep.results_table import OF_THE_MACHINE
from tests.support.small_missions import SMALL

pytestmark = pytest.mark.skipif(not find_spec("distributed"), reason="distributed is not installed")

MANY = SMALL.replace("mission small", "mission small\nparam N = 2", 1).replace("drone[2]", "drone[N]")
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}


class Cluster:
    """A scheduler, and workers that may be killed; all of them processes of this machine."""

    def __init__(self, home: Path) -> None:
        self.file = home / "scheduler.json"
        self._workers: list[subprocess.Popen[bytes]] = []
        words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(self.file)]
        self.scheduler = subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_scheduler", *words], **QUIET)  # type: ignore[call-overload]
        while not self.file.exists():
            time.sleep(0.05)

    def add(self, **environment: str) -> None:
        words = ["--scheduler-file", str(self.file), "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        words = [sys.executable, "-m", "distributed.cli.dask_worker", *words]
        self._workers.append(subprocess.Popen(words, env={**os.environ, **environment}, **QUIET))  # type: ignore[call-overload]

    def kill(self, which: int) -> None:
        self._workers.pop(which).kill()

    def end(self) -> None:
        for process in (*self._workers, self.scheduler):
            process.kill()
            process.wait()


@contextmanager
def cluster(home: Path, workers: int) -> Iterator[Cluster]:
    found = Cluster(home)
    try:
        for _ in range(workers):
            found.add()
        yield found
    finally:
        found.end()


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    (tmp_path / "small.mission").write_text(MANY, encoding="utf-8")
    return tmp_path / "small.mission"


def swept(mission: Path, name: str, *words: str, seeds: int = 2) -> Path:
    out = mission.parent / name
    assert (
        main(["sweep", str(mission), "--vary", "N=1,3", "--seeds", str(seeds), "-o", str(out), "--keep", *words]) == 0
    )
    return out


def steady(folder: Path) -> list[dict[str, str]]:
    """What of a table does not follow from the machine."""
    read = csv.DictReader((folder / "runs.csv").read_text(encoding="utf-8").splitlines())
    return [{name: cell for name, cell in each.items() if name not in OF_THE_MACHINE} for each in read]


def plans(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes() for path in (folder / "plans").rglob("*") if path.is_file()
    }


def test_there_is_a_cluster_or_a_message(
    mission: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missionc.tools.sweep.run_sweep.CONNECTION_PATIENCE", 0.2)
    words = ["sweep", str(mission), "-o", str(mission.parent / "out"), "--format", "json"]
    assert main([*words, "--cluster", "tcp://127.0.0.1:9"]) == 1
    (said,) = json.loads(capsys.readouterr().out)["diagnostics"]
    assert said["code"] == CLUSTER_UNREACHABLE.name
    assert main([*words, "--cluster", "somewhere"]) == 2


@pytest.mark.slow
def test_rows_and_plans_are_the_same_with_one_worker_with_three_and_with_none(mission: Path) -> None:
    here = swept(mission, "here", "--jobs", "2")
    one = swept(mission, "one", "--cluster", "local:1")
    three = swept(mission, "three", "--cluster", "local:3")
    assert steady(here) == steady(one) == steady(three)
    assert plans(here) == plans(one) == plans(three)


@pytest.mark.slow
def test_runs_of_workers_that_die_are_done_by_others(mission: Path, tmp_path: Path) -> None:
    here = swept(mission, "here", seeds=8)
    draw, over = random.Random(0), threading.Event()
    killed = 0
    with cluster(tmp_path, 3) as found:

        def kill() -> None:
            nonlocal killed
            while not over.wait(draw.uniform(1.5, 3.0)):
                if not (mission.parent / "there" / "runs.jsonl").exists():
                    continue
                found.add()
                found.kill(draw.randrange(3))
                killed += 1

        killer = threading.Thread(target=kill)
        killer.start()
        try:
            there = swept(mission, "there", "--cluster", str(found.file), seeds=8)
        finally:
            over.set()
            killer.join()
    assert killed
    assert steady(there) == steady(here)
    assert plans(there) == plans(here)


@pytest.mark.slow
def test_what_is_done_is_kept_where_the_cluster_is_lost(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = mission.parent / "out"
    words = ["sweep", str(mission), "--vary", "N=1,3", "--seeds", "10", "-o", str(out), "--format", "json"]
    with cluster(tmp_path, 1) as found:

        def end() -> None:
            while not (out / "runs.jsonl").exists() or not (out / "runs.jsonl").stat().st_size:
                time.sleep(0.05)
            found.scheduler.send_signal(signal.SIGKILL)

        threading.Thread(target=end).start()
        assert main([*words, "--cluster", str(found.file)]) == 1
    said = json.loads(capsys.readouterr().out)
    assert CLUSTER_UNREACHABLE.name in {each["code"] for each in said["diagnostics"]}
    assert 0 < said["over"] < 20
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["complete"]


@pytest.mark.slow
def test_a_worker_with_another_version_is_refused(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other"
    (other / "numpy-0.0.dist-info").mkdir(parents=True)
    (other / "numpy-0.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 0.0\n")
    with cluster(tmp_path, 0) as found:
        found.add(PYTHONPATH=f"{other}:{os.environ.get('PYTHONPATH', '')}")
        words = ["sweep", str(mission), "-o", str(mission.parent / "out"), "--format", "json"]
        assert main([*words, "--cluster", str(found.file)]) == 1
    (said,) = json.loads(capsys.readouterr().out)["diagnostics"]
    assert said["code"] == OTHER_VERSIONS.name
    assert "numpy 0.0, here" in said["notes"][0]
