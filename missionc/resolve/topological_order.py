"""Topological order of definitions: each comes after what it rests on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping


def in_order(rests_on: Mapping[str, Iterable[str]]) -> tuple[list[str], list[tuple[str, ...]]]:
    """The names in order, and the cycles.

    A cycle is a chain of names in which each rests on the next and the last on
    the first. Its names come in the order too: whoever walks it finds the
    missing one not made yet. Names that are no key are passed over.
    Iterative: a chain of definitions may be longer than Python's stack.
    """
    order: list[str] = []
    cycles: list[tuple[str, ...]] = []
    done: set[str] = set()
    for root in rests_on:
        if root in done:
            continue
        chain = [root]
        place = {root: 0}
        pending = [iter(tuple(rests_on[root]))]
        while chain:
            following = next(pending[-1], "")
            if not following:
                name = chain.pop()
                pending.pop()
                del place[name]
                done.add(name)
                order.append(name)
            elif following in place:
                cycles.append(tuple(chain[place[following] :]))
            elif following in rests_on and following not in done:
                place[following] = len(chain)
                chain.append(following)
                pending.append(iter(tuple(rests_on[following])))
    return order, cycles
