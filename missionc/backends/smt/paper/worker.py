"""Encoding and Z3 in a separate process: ``python -I -S worker.py MEMORY_BYTES SEED FOLDER...``.

Encoding and solver may exceed the available time and memory, and Z3 blocks signals in the interpreter. ``FOLDER`` are
the folders that contain ``missionc`` and ``z3``. The process reads one problem in JSON to its end, and answers by lines
of JSON: ``seconds`` of processor time for the terms; then ``states``, ``refused`` or ``gave_up``, with the solver's
seconds.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from typing import Any


def main() -> None:
    # Recursion levels of a formula, a few calls each; set here because it applies to the whole process.
    deepest = 1_000_000
    memory, seed = int(sys.argv[1]), int(sys.argv[2])
    sys.path += sys.argv[3:]
    from missionc.backends.smt.sat.worker import OUT_OF_MEMORY, die_with_parent

    die_with_parent()
    sys.setrecursionlimit(deepest)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    try:
        solve(json.load(sys.stdin), seed)
    except MemoryError:
        say(gave_up="memory")
    except Exception as error:  # memory parameter of Z3, which covers all kinds
        message = str(error)
        say(gave_up="memory" if any(words in message for words in OUT_OF_MEMORY) else message)


def solve(problem: dict[str, Any], seed: int) -> None:
    """Run lines 1 to 10 of Algorithm 2 and print the answer."""
    import z3

    from missionc.backends.smt.paper.encode import Encoding

    begin = time.process_time()
    encoding, solver = Encoding(problem), z3.Solver()
    solver.set("random_seed", seed % 2**31)
    solver.add(*encoding.plan())
    built = time.process_time()
    say(seconds=built - begin)
    answer = solver.check()
    solved = time.process_time() - built
    if answer == z3.sat:
        say(states=encoding.states(solver.model()), seconds=solved)
    elif answer == z3.unsat:
        say(refused=True, seconds=solved)
    else:
        say(gave_up=solver.reason_unknown(), seconds=solved)


def say(**words: object) -> None:
    print(json.dumps(words), flush=True)


if __name__ == "__main__":
    main()
