"""The golden runner: Markdown files with prose, missions, and the output of commands about them.

A few kinds of fenced blocks have a meaning; all others are prose.

```mission NAME.mission      a file. Without a name it is called after the mission it declares.
```mission NAME.mission wrong   the same, of a mission with errors.
```mission fragment NAME.mission   declarations; that mission of the page is checked with them.
```xml NAME.graphml          a file for missions or commands; likewise ```csv, ```geojson, ```jsonl, ```pgm and ```yaml.
```python FOLDER/NAME.py   a file of a package; likewise ```toml.
```mission excerpt PATH     lines that stand in a mission of this repository.
```console                  commands, each `$ missionc …`, and below each what it prints and its exit status
                            (`[exit status 1]`, left out where it is 0). `< FILE` at its end is its standard input.
                            `$ pip install --quiet --editable .` installs the package in the folder until the page ends.
```console norun            the same, of what cannot be made to happen here: a full disk, a defect.

The files lie in an empty folder in which the commands run, one after the other. A line `…` of the expected output
stands for any number of lines, and `…` within a line for any words.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from missionc.cli.app import main
from tests.support.installed_packages import source_package

FENCE = re.compile(r"^```(?P<info>[^\n`]*)\n(?P<body>.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
TIMED = re.compile(r"(verified in) [0-9.]+ s")
"""Durations in outputs, which vary."""
FILES = frozenset({"csv", "geojson", "jsonl", "pgm", "xml", "yaml"})
"""Languages of files that are not missions."""
CODE = frozenset({"python", "toml"})
"""Languages of the files of a package; a block without a name is not a file."""
INSTALL = "pip install --quiet --editable ."
NAME = re.compile(r"^\s*mission\s+(\w+)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Block:
    """Fenced block: the words after the fence, its text, and the place of the text in the page."""

    info: str
    body: str
    start: int
    end: int
    heading: str


def blocks(page: str) -> list[Block]:
    """All fenced blocks of a page, each with its heading."""
    found = []
    for match in FENCE.finditer(page):
        headings = re.findall(r"^#+ +(.+)$", page[: match.start()], re.MULTILINE)
        found.append(
            Block(
                match["info"].strip(),
                match["body"],
                match.start("body"),
                match.end("body"),
                headings[-1] if headings else "",
            )
        )
    return found


def file_name(block: Block) -> str:
    """File name of a mission block."""
    words = block.info.split()
    if len(words) > 1 and words[1].endswith(".mission"):
        return words[1]
    declared = NAME.search(block.body)
    return f"{declared[1]}.mission" if declared else "example.mission"


def is_file(block: Block) -> bool:
    """Return whether it is a file that is not a mission."""
    words = block.info.split()
    return len(words) == 2 and words[0] in FILES | CODE


def put_file(block: Block, folder: Path) -> None:
    """Write a block that is a file."""
    path = folder / block.info.split()[1]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(block.body, encoding="utf-8")


def package_in(folder: Path) -> contextlib.AbstractContextManager[None]:
    """Context in which the package in a folder, if any, is installed."""
    if not (folder / "pyproject.toml").exists():
        return contextlib.nullcontext()
    return source_package(folder, folder / "site-packages")


def is_fragment(block: Block) -> bool:
    return block.info.split()[:2] == ["mission", "fragment"]


def is_excerpt(block: Block) -> bool:
    return block.info.split()[:2] == ["mission", "excerpt"]


def run(words: list[str]) -> tuple[int, str]:
    """Exit status and output of a command, both streams together."""
    stream = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
        status = main(words)
    stream.seek(0)
    return status, stream.read()


@contextlib.contextmanager
def fed(content: bytes | None) -> Iterator[None]:
    """Context with a standard input; unchanged if None."""
    before = sys.stdin
    if content is not None:
        sys.stdin = io.TextIOWrapper(io.BytesIO(content), encoding="utf-8")
    try:
        yield
    finally:
        sys.stdin = before


@contextlib.contextmanager
def within(folder: Path) -> Iterator[None]:
    """Context with a working directory."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def transcript(console: str) -> str:
    """Console block with current outputs of its commands."""
    said = []
    for line in console.splitlines():
        if not line.startswith("$ "):
            continue
        if line[2:] == INSTALL:
            said.append(f"{line}\n")
            continue
        program, *words = shlex.split(line[2:])
        assert program == "missionc", f"only missionc is run here, not `{program}`"
        given = Path(words[-1]).read_bytes() if words[-2:-1] == ["<"] else None
        with fed(given):
            status, output = run(words if given is None else words[:-2])
        output = TIMED.sub(r"\1 … s", output)
        said.append(f"{line}\n{output}" + (f"[exit status {status}]\n" if status else ""))
    return "".join(said)


def agrees(expected: str, actual: str) -> bool:
    """Return whether an output matches; `…` stands for any text."""
    pattern = "".join(
        r"(?:.*\n)*?" if line == "…\n" else ".*".join(map(re.escape, line.split("…")))
        for line in expected.splitlines(keepends=True)
    )
    return re.fullmatch(pattern, actual) is not None


def play(page: str, folder: Path) -> str:
    """Page with current outputs of all console blocks; matching ones stay unchanged."""
    said = []
    at = 0
    with within(folder), contextlib.ExitStack() as installed:
        for block in blocks(page):
            said.append(page[at : block.start])
            at = block.end
            kind = block.info.split()[0] if block.info else ""
            text = block.body
            if kind == "mission" and not is_fragment(block) and not is_excerpt(block):
                (folder / file_name(block)).write_text(text, encoding="utf-8")
            elif is_file(block):
                put_file(block, folder)
            elif block.info == "console":
                if f"$ {INSTALL}\n" in text:
                    installed.enter_context(package_in(folder))
                actual = transcript(text)
                text = text if agrees(text, actual) else actual
            said.append(text)
    return "".join(said) + page[at:]
