"""Mutation testing of what judges: ``make mutants``.

in   the packages or modules that are mutated; how many mutants of each package, drawn by a seed, or all
out  a table by package: mutants, killed, timed out, survived, reached by no test; the survivors with their changes

mutmut keeps what it has tried in ``mutants/``: the next run goes on there. A mutant meets the fastest tests that reach
its function, up to ``SECONDS`` of them, and the first that fails kills it.
"""

from __future__ import annotations

import argparse
import os
import random
from collections import Counter
from collections.abc import Iterable, Iterator

from mutmut import __main__ as mutmut
from mutmut.mutation.data import SourceFileMutationData
from mutmut.mutation.diff_apply import get_diff_for_mutant
from mutmut.mutation.trampoline import set_mutant_under_test
from mutmut.state import state
from mutmut.stats import save_stats, status_by_exit_code
from mutmut.utils.file_utils import copy_also_copy_files, copy_src_dir, setup_source_paths, walk_mutatable_files

PACKAGES = ("missionc/ir/kernel", "missionc/verification/monitoring", "missionc/verification")
SECONDS = 45.0
"""Of tests that a mutant meets, by the seconds that each takes while mutmut notes what it reaches."""


def made(workers: int) -> None:
    """Make the mutants of all packages, and note which test reaches which function."""
    os.makedirs("mutants", exist_ok=True)
    set_mutant_under_test("mutant_generation")
    with mutmut.CatchOutput(spinner_title="Making mutants"):
        copy_src_dir()
        copy_also_copy_files()
        setup_source_paths()
        mutmut.create_mutants(workers)
    mutmut.collect_or_load_stats(mutmut.get_mutant_runner(workers))
    lasting, reached = state().duration_by_test, state().tests_by_mangled_function_name
    for function, tests in reached.items():
        reached[function] = set(fastest(sorted(tests, key=lambda test: (lasting[test], test)), lasting))
    save_stats()


def fastest(tests: list[str], lasting: dict[str, float]) -> Iterator[str]:
    """The first tests, which take up to ``SECONDS`` together; one at least."""
    total = 0.0
    for number, test in enumerate(tests):
        total += lasting[test]
        if number and total > SECONDS:
            return
        yield test


def outcomes(parts: Iterable[str]) -> dict[str, int | None]:
    """The exit status of the tests of each mutant below these paths; None: not tried yet."""
    found: dict[str, int | None] = {}
    for path in walk_mutatable_files():
        if any(str(path).startswith(part) for part in parts):
            data = SourceFileMutationData(path=path)
            data.load()
            found |= data.exit_code_by_key
    return found


def drawn(names: Iterable[str], count: int | None, seed: int) -> list[str]:
    """So many of the mutants of each package, the same for a seed; all without a count."""
    by_package: dict[str, list[str]] = {}
    for name in sorted(names):
        by_package.setdefault(name.split(".")[1], []).append(name)
    generator = random.Random(seed)
    return [
        name
        for own in by_package.values()
        for name in (own if count is None or count >= len(own) else generator.sample(own, count))
    ]


def table(found: dict[str, int | None]) -> str:
    """The rows of the packages. Who is reached by no test has survived; a time limit kills."""
    rows = ["package      mutants   killed  timeout  survived  unreached  killed %"]
    by_package: dict[str, Counter[str]] = {}
    for name, status in found.items():
        by_package.setdefault(name.split(".")[1], Counter())[status_by_exit_code[status]] += 1
    for package, counted in by_package.items():
        total = counted.total() - counted["not checked"]
        killed = counted["killed"] + counted["timeout"]
        cells = (total, counted["killed"], counted["timeout"], counted["survived"], counted["no tests"])
        share = 100 * killed / total if total else 0.0
        rows.append(f"{package:11}" + "".join(f"{cell:>9}" for cell in cells) + f"{share:>11.1f}")
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description="Mutation testing of the verifier.")
    parser.add_argument("parts", nargs="*", default=PACKAGES, help="paths to mutate, within the default packages")
    parser.add_argument("--workers", type=int, default=2, help="number of parallel processes")
    parser.add_argument("--sample", type=int, help="number of random mutants of each package; default: all")
    parser.add_argument("--seed", type=int, default=0, help="seed of the sample")
    given = parser.parse_args()
    made(given.workers)
    names = drawn(outcomes(given.parts), given.sample, given.seed)
    waiting = [name for name, status in outcomes(given.parts).items() if status is None]
    left = [name for name in names if name in set(waiting)]
    if left:
        mutmut._run(left, given.workers)
    found = outcomes(given.parts)
    chosen = {name: found[name] for name in names}
    for name, status in chosen.items():
        if status_by_exit_code[status] == "survived":
            print(get_diff_for_mutant(name))
    print(table(chosen))


if __name__ == "__main__":
    main()
