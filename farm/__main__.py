"""A test farm that searches for defects of the compiler.

    python -m farm --minutes 10 [--seed 0] [--journal build/farm] [--found tests/corpus/found]
    python -m farm --trial N [--seed 0]
    python -m farm --again FILE

Trials are numbered, and the same seed and number give the same trial. What was done is in the journal: the same command
goes on after it, whenever and however it ended. A new finding is made small, which takes up to a minute and a half, and
is kept in a file. With ``--trial`` one trial is carried out once more and its finding shown, with ``--again`` that of a
file. The exit status is 1 where something new was found.
"""

from __future__ import annotations

import argparse
import importlib
import os
import signal
import sys
from importlib.util import find_spec
from pathlib import Path
from types import FrameType

# This process forks: no library may have threads in it.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from farm import found_files
from farm.journal import Journal, described
from farm.look import look
from farm.own_process import carried_out
from farm.table import table
from farm.trial import Answer, Case
from farm.trials import KINDS, trial

LARGE = ("scipy.optimize", "shapely", "z3", "torch", "matplotlib.figure", "jinja2", "piqp", "ezdxf")
"""Libraries for trials, loaded once for all of them."""


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m farm", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="duration of the search")
    parser.add_argument("--seed", type=int, default=0, help="seed of all trials")
    parser.add_argument(
        "--journal",
        type=Path,
        default=found_files.ROOT / "build" / "farm",
        metavar="FOLDER",
        help="folder of the journal of trials",
    )
    parser.add_argument("--found", type=Path, default=found_files.FOUND, metavar="FOLDER", help="folder for findings")
    parser.add_argument("--trial", type=int, metavar="N", help="run one trial and print its input")
    parser.add_argument("--again", type=Path, metavar="FILE", help="run the trial of a finding again")
    arguments = parser.parse_args()
    load()
    if arguments.again:
        found = found_files.read(arguments.again)
        return _shown(carried_out(KINDS[found.kind], found.case))
    if arguments.trial is not None:
        kind, case = trial(arguments.seed, arguments.trial)
        print(f"{kind.name}: {kind.says}\n{_texts(case)}")
        return _shown(carried_out(kind, case))
    journal = Journal(arguments.journal)
    with journal.at_work() as alone:
        if not alone:
            parser.error(f"another process uses {journal.path}; choose another `--journal`")
        return _look(arguments, journal)


def load() -> None:
    """Load everything for trials before the first fork."""
    from missionc.cli.command_names import BUILT_IN

    for name in BUILT_IN:
        importlib.import_module(f"missionc.cli.commands.{name}")
    for name in LARGE:
        if find_spec(name.partition(".")[0]):
            importlib.import_module(name)


def _look(arguments: argparse.Namespace, journal: Journal) -> int:
    commit = described(found_files.ROOT)
    before = len(journal.lines)
    if before and journal.commit != commit:
        print(f"continuing trials of {journal.commit} with {commit}")
    print(f"seed {arguments.seed}, starting at trial {journal.next_trial(arguments.seed)}", flush=True)
    signal.signal(signal.SIGTERM, _interrupted)
    found = []
    try:
        found = look(
            journal,
            arguments.seed,
            60 * arguments.minutes,
            arguments.found,
            commit,
            lambda line: print(line, flush=True),
        )
    except KeyboardInterrupt:
        print("interrupted; run the same command again to continue", file=sys.stderr)
    print("\n".join(["", *table(journal.lines[before:])]))
    for each in found:
        print(f"\n{each.path}: {each.fault.promise}\n{each.fault.seen}")
    return 1 if found else 0


def _interrupted(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _texts(case: Case) -> str:
    texts = [f"--- {name}\n{text}" for name, text in case.files.items()]
    return "\n".join([*texts, f"--- settings\n{case.settings}"])


def _shown(answer: Answer) -> int:
    if answer.fault is None:
        print(f"passed: {answer.outcome}, {answer.seconds:.1f} s")
        return 0
    print(f"{answer.fault.signature}\n{answer.fault.promise}\n{answer.fault.seen}")
    return 1


if __name__ == "__main__":
    sys.exit(main())
