"""Folders with random changes: one place in one document, with the manifest adapted or not."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Mapping
from typing import Any

from tests.support.forged_folders import Files, hashed

NOTHING = object()
"""Marker for a removed entry."""

DEEP = "\0deep\0"
"""Marker for lists nested ten thousand deep."""

JUNK: tuple[Any, ...] = (
    NOTHING,
    None,
    True,
    False,
    0,
    -1,
    1,
    1e-300,
    -1e-300,
    1e160,
    1e308,
    -1e308,
    float("nan"),
    float("inf"),
    2**31,
    2**63,
    10**400,
    -(10**400),
    "",
    "nan",
    "1e308",
    "-2",
    "1e160",
    "missing",
    "\ud800",
    "a" * 100_000,
    "\0",
    "../x",
    "\x1b[2J",
    [],
    {},
    [[]],
    [None],
    {"": None},
    DEEP,
)


def mutated(files: Mapping[str, bytes], seed: int) -> tuple[Files, str]:
    """Changed files, reproducible by seed, and a description of the change."""
    chance = random.Random(seed)
    name = chance.choice([name for name in files for _ in range(_weight(name))])
    changed, what = _changed(chance, name, files[name])
    found = {**files, name: changed}
    forged = chance.random() < 0.7
    return hashed(found, keep=name == "manifest.json") if forged else found, f"{name}: {what}{', forged' * forged}"


def mutated_file(name: str, content: bytes, seed: int) -> tuple[bytes, str]:
    """Changed content of one file, reproducible by seed, and a description of the change."""
    return _changed(random.Random(seed), name, content)


def _weight(name: str) -> int:
    """Weight of a file: JSON documents are read in most ways."""
    return 8 if name.endswith(".json") else 1


def _changed(chance: random.Random, name: str, content: bytes) -> tuple[bytes, str]:
    if name.endswith(".json"):
        return _json(chance, content)
    if name.endswith(".jsonl"):
        lines = content.split(b"\n")
        number = chance.randrange(len(lines) - 1)
        lines[number], what = _json(chance, lines[number])
        return b"\n".join(lines), f"line {number + 1}, {what}"
    if name.endswith(".toml") and chance.random() < 0.6:
        return _setting(chance, content)
    if name.endswith(".csv") and chance.random() < 0.8:
        return _table(chance, content)
    return _text(chance, content)


# ------------------------------------------------------------------------ JSON


def _json(chance: random.Random, content: bytes) -> tuple[bytes, str]:
    if chance.random() < 0.05:
        return _text(chance, content)
    document = json.loads(content)
    holder, key = _place(chance, document)
    before = holder[key]
    change: Callable[[random.Random, Any, Any, Any], str] = chance.choice(
        (_replace, _replace, _nudge, _nudge, _repeat, _rename, _swap)
    )
    what = change(chance, holder, key, before)
    text = json.dumps(document).replace(json.dumps(DEEP), "[" * 10_000 + "]" * 10_000)
    return text.encode("utf-8", "surrogatepass"), f"{str(key)[:30]} {what}"


def _place(chance: random.Random, document: Any) -> tuple[Any, Any]:
    """Record or list in the document with one of its keys, uniform over depths and lists."""
    holder, key = document, chance.choice(list(document))
    while isinstance(holder[key], dict | list) and holder[key] and chance.random() < 0.75:
        holder = holder[key]
        key = chance.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    return holder, key


def _replace(chance: random.Random, holder: Any, key: Any, before: Any) -> str:
    value = chance.choice(JUNK)
    if value is NOTHING:
        del holder[key]
        return "taken away"
    holder[key] = value
    return f"is {str(value)[:20]!r}"


def _nudge(chance: random.Random, holder: Any, key: Any, before: Any) -> str:
    if isinstance(before, bool) or before is None:
        holder[key] = not before
    elif isinstance(before, int):
        holder[key] = before + chance.choice((-1, 1, 7))
    elif isinstance(before, float):
        holder[key] = before + chance.choice((-1, 1)) * 10.0 ** chance.randint(-13, 2)
    elif isinstance(before, str):
        letter = chance.randrange(len(before) + 1)
        holder[key] = before[:letter] + chance.choice("0 ax\u00e9") + before[letter + chance.randint(0, 1) :]
    elif isinstance(before, list):
        holder[key] = before[::-1] if chance.random() < 0.5 else before[:-1]
    else:
        holder[key] = list(before)
    return "nudged"


def _repeat(chance: random.Random, holder: Any, key: Any, before: Any) -> str:
    if isinstance(holder, list):
        holder.insert(key, before)
    else:
        holder[f"{key}2"] = before
    return "twice"


def _rename(chance: random.Random, holder: Any, key: Any, before: Any) -> str:
    if isinstance(holder, list):
        del holder[key]
        return "taken away"
    holder[chance.choice(("", "a/../" + key, "./" + key, key.upper(), key + "\ud800", "x"))] = holder.pop(key)
    return "renamed"


def _swap(chance: random.Random, holder: Any, key: Any, before: Any) -> str:
    other = chance.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    holder[key], holder[other] = holder[other], before
    return f"swapped with {str(other)[:30]}"


# ----------------------------------------------------------------- other texts


def _table(chance: random.Random, content: bytes) -> tuple[bytes, str]:
    lines = content.decode().split("\n")
    row = chance.randrange(len(lines))
    words = lines[row].split(",")
    column = chance.randrange(len(words))
    kind = chance.choice(("number", "number", "word", "row", "rows", "column"))
    match kind:
        case "number":
            words[column] = chance.choice((_moved(chance, words[column]), "1e160", "1e308", "-0", "nan", "1_0", "+1"))
            lines[row] = ",".join(words)
        case "word":
            words[column] = chance.choice(("", " ", "x", "٣", "0x10", "\0", '"'))
            lines[row] = ",".join(words)
        case "row":
            del lines[row]
        case "rows":
            lines.insert(row, lines[row])
        case _:
            lines[row] += ",0"
    return "\n".join(lines).encode(), f"line {row + 1} {kind}"


def _setting(chance: random.Random, content: bytes) -> tuple[bytes, str]:
    """Change one value in a TOML text."""
    values = ("nan", "inf", "-1", "true", '""', "[]", "{}", "9" * 310, "1e308", "9" * 5000, "[" * 5000 + "]" * 5000)
    lines = content.split(b"\n")
    number = chance.choice([number for number, line in enumerate(lines) if b"=" in line])
    value = chance.choice(values)
    lines[number] = lines[number].partition(b"=")[0] + b"= " + value.encode()
    return b"\n".join(lines), f"line {number + 1} is {value[:20]}"


def _moved(chance: random.Random, word: str) -> str:
    try:
        return repr(float(word) + chance.choice((-1, 1)) * 10.0 ** chance.randint(-12, 1))
    except ValueError:
        return word + "0"


def _text(chance: random.Random, content: bytes) -> tuple[bytes, str]:
    start = chance.randrange(len(content) + 1)
    end = min(len(content), start + chance.choice((0, 0, 1, 1, 5, 1000)))
    new = chance.choice(
        (b"", b" ", b"0", b"1", b"\n", b"\xff", b"\0", b"x", b"\xed\xa0\x80", b"import os\n", b'"', b"}")
    )
    return content[:start] + new + content[end:], f"byte {start} to {end} is {new!r}"
