"""A compiled folder with one place changed, by chance: refused with a code, or the same in all that people read."""

from __future__ import annotations

import sys
from collections import Counter

import pytest

from tests.support.folders_as_read import judged
from tests.support.whole_folder import files

pytestmark = pytest.mark.usefixtures("flown_once")

BLOCKS = 5
EACH = 8


@pytest.mark.parametrize("block", range(BLOCKS))
def test_a_folder_changed_by_chance_is_refused_or_says_the_same(block: int) -> None:
    for seed in range(block * EACH, (block + 1) * EACH):
        verdict, what = judged(files(), seed)
        assert verdict in ("refused", "accepted"), f"{seed}: {what}"


if __name__ == "__main__":
    first, last = map(int, sys.argv[1:3])
    counted: Counter[str] = Counter()
    for seed in range(first, last):
        try:
            verdict, what = judged(files(), seed)
        except Exception as error:
            verdict, what = "EXCEPTION", f"{type(error).__name__}: {str(error)[:1500]}"
        counted[verdict] += 1
        if verdict != "refused":
            print(seed, verdict, what, flush=True)
    print(dict(counted))
