"""The parent of the process that does the work: it ends what nothing within can end, and reports how it ended."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from missionc.base.memory import exhausted
from missionc.base.supervision import Cause, Ended
from missionc.cli.app import say_ended

ROOT = Path(__file__).resolve().parents[3]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has what supervision takes")

HEAD = """
import os, signal, sys, time
from missionc.base import supervision
from missionc.base.deadline import OutOfTime, interrupted_at
from missionc.base.signals import Stopped, defer_stop, stop_requested, stoppable
supervision.GRACE = supervision.PATIENCE = 0.2
ended = supervision.supervise()
if ended:
    print("parent:", ended.status, ended.cause, *[True] * ended.kept, flush=True)
    os._exit(0)
def forever():
    print("begun", flush=True)
    sum(range(10**12))  # no signal is looked at, and no other thread runs
"""


def started(code: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-c", HEAD + code]
    return subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True)


def said(code: str) -> str:
    return started(code).communicate(timeout=60)[0]


def test_work_that_cannot_be_interrupted_is_ended_at_its_deadline() -> None:
    found = said("""
with stoppable(), interrupted_at(time.monotonic() + 0.1):
    forever()
""")
    assert found == f"begun\nparent: 9 {Cause.TIME}\n"


def test_work_that_ends_at_its_deadline_by_itself_goes_on_to_its_result() -> None:
    found = said("""
try:
    with stoppable(), interrupted_at(time.monotonic() + 0.1):
        time.sleep(60)
except OutOfTime:
    time.sleep(0.6)
os._exit(4)
""")
    assert found == "parent: 4 None\n"


@pytest.mark.parametrize(
    ("number", "cause"),
    [(signal.SIGABRT, Cause.MEMORY), (signal.SIGKILL, Cause.MEMORY), (signal.SIGSEGV, Cause.CRASH)],
)
def test_a_signal_that_nobody_sent_is_reported(number: signal.Signals, cause: Cause) -> None:
    assert said(f"os.kill(os.getpid(), {number.value})") == f"parent: {number.value} {cause}\n"


def test_a_c_library_without_memory_for_a_thread_is_reported() -> None:
    assert said("os._exit(127)") == f"parent: 127 {Cause.MEMORY}\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("to_all", [False, True])
def test_a_signal_counts_once_whether_one_process_gets_it_or_both(number: signal.Signals, to_all: bool) -> None:
    """A second one would end the process before it has brought home what it holds."""
    process = started("""
with stoppable():
    defer_stop()
    print("begun", flush=True)
    while not stop_requested():
        time.sleep(0.01)
    time.sleep(0.3)
    print("brought home", flush=True)
os._exit(0)
""")
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    (os.killpg if to_all else os.kill)(process.pid, number)
    assert process.communicate(timeout=60)[0] == "brought home\nparent: 0 None\n"


def test_a_signal_ends_work_that_cannot_be_interrupted() -> None:
    process = started("with stoppable():\n    forever()\n")
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=60)[0] == "parent: 143 None\n"


def test_the_work_ends_with_its_parent() -> None:
    process = started("print(os.getpid(), flush=True)\nforever()\n")
    assert process.stdout is not None
    worker = int(process.stdout.readline())
    process.kill()
    process.communicate(timeout=60)  # until the worker has closed its end too
    status = Path(f"/proc/{worker}/status")
    while status.exists() and "\nState:\tZ" not in status.read_text():
        time.sleep(0.01)


def test_an_end_from_outside_has_a_code_in_every_form(capsys: pytest.CaptureFixture[str]) -> None:
    assert say_ended(Ended(9, Cause.TIME), ["compile", "m", "--format=json"]) == 4
    assert json.loads(capsys.readouterr().out)["diagnostics"][0]["code"] == "MC602"
    assert say_ended(Ended(6, Cause.MEMORY), ["check", "m"]) == 4
    assert "error[MC603]" in capsys.readouterr().err
    assert say_ended(Ended(11, Cause.CRASH), ["check", "m"]) == 70
    assert "error[MC901]" in capsys.readouterr().err


def test_a_plan_that_was_written_is_the_result_however_the_work_ends(capsys: pytest.CaptureFixture[str]) -> None:
    found = said("""
supervision.tell_kept()
with stoppable(), interrupted_at(time.monotonic() + 0.1):
    forever()
""")
    assert found == f"begun\nparent: 9 {Cause.TIME} True\n"
    assert say_ended(Ended(9, Cause.TIME, True), ["compile", "m"]) == 0
    assert "warning[MC613]" in capsys.readouterr().err


def test_libraries_of_cxx_have_their_own_words_for_no_memory() -> None:
    assert exhausted(MemoryError())
    assert exhausted(RuntimeError("std::bad_alloc"))
    assert not exhausted(RuntimeError("bad weather"))
