"""Both papers, row by row: the tables in docs/papers.md, generated from docs/papers.toml, with commands for each row.

python docs/papers.py              writes the tables into the page
python docs/papers.py --run TEXT   first runs the commands of the rows with TEXT in them, and keeps what they show

Keys of a row in docs/papers.toml:

item      a thing that the paper has, with its number
where     the modules, missions or texts that have it here; a name like `unroll.unroll` is a module and what is in it
command   a line that shows it, run at the root of a checkout
shows     texts that the command prints; `…` stands for anything within a line, a space for any spaces. Left out for
          `pytest`, of whose tests one passes and none fails
status    exit status of the command, 0 if left out
needs     packages without which the command prints what to install, and fails
slow      true if the command takes longer than a few seconds: then `make slow` runs it, not `make check`
verdict   `faithful`, `repaired` (the paper contradicts itself or leaves it open), `different` or `absent`
reason    how it differs and why; of a faithful row, what there is besides

docs/papers_shown.json keeps the texts that the last run of each command printed for `shows`.
``tests/unit/project/test_papers.py`` runs the commands, and says when the page is not what these files give.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "papers.md"
TABLE = ROOT / "docs" / "papers.toml"
SHOWN = ROOT / "docs" / "papers_shown.json"
VERDICTS = ("faithful", "repaired", "different", "absent")
PASSED = "… passed"
"""Text of a test run without failures."""
_PLACE = re.compile(r"(?P<marker><!-- rows of \[(?P<paper>\w+)\]: (?P<title>.+?) -->\n\n)(?:\|.*\n)*")


@dataclass(frozen=True, slots=True)
class Row:
    """Row of ``docs/papers.toml``, with its paper and the title of its part."""

    paper: str
    title: str
    item: str
    where: str
    command: str
    verdict: str
    reason: str = ""
    shows: list[str] = field(default_factory=lambda: [PASSED])
    status: int = 0
    needs: list[str] = field(default_factory=list)
    slow: bool = False

    @property
    def key(self) -> str:
        """Name of the row in docs/papers_shown.json."""
        return f"{self.paper}: {self.item}"


def read_rows() -> list[Row]:
    """Read all rows, in the order of the file.

    Raises:
        TypeError: a row has an unknown key, or lacks one.
    """
    parts = tomllib.loads(TABLE.read_text(encoding="utf-8"))["part"]
    return [Row(part["paper"], part["title"], **row) for part in parts for row in part["row"]]


def read_shown() -> dict[str, list[str]]:
    """Texts that commands printed for ``shows`` in their last run, by the key of the row."""
    shown: dict[str, list[str]] = json.loads(SHOWN.read_text(encoding="utf-8"))
    return shown


def page(text: str, rows: Iterable[Row], shown: dict[str, list[str]]) -> str:
    """Page with the tables from the rows."""
    rows = list(rows)

    def table(place: re.Match[str]) -> str:
        here = [row for row in rows if (row.paper, row.title) == (place["paper"], place["title"])]
        lines = [
            f"| [{place['paper']}] | implementation | command | output | verdict | difference and reason |",
            "|---|---|---|---|---|---|",
        ]
        lines += [f"| {' | '.join(map(_cell, _cells(row, shown)))} |" for row in here]
        return place["marker"] + "\n".join(lines) + "\n"

    return _PLACE.sub(table, text)


def _cells(row: Row, shown: dict[str, list[str]]) -> list[str]:
    if row.shows == [PASSED]:
        shows = "the tests pass"
    else:
        texts = shown.get(row.key, ())
        shows = ", ".join(f"`` {text} ``" if "`" in text else f"`{text}`" for text in texts) or "not run yet"
    return [row.item, row.where, f"`{row.command}`", shows, row.verdict, row.reason or "None."]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def find_shown(row: Row, status: int, output: str) -> tuple[list[str], str]:
    """Texts in an output that match a row's ``shows``, and the missing ones as text."""
    if status != row.status:
        return [], f"exit status {status}, expected {row.status}"
    found = []
    for pattern in row.shows:
        match = re.search(as_expression(pattern), output)
        if match is None:
            return [], f"no `{pattern}` in the output"
        found.append(" ".join(match[0].split()))
    return found, ""


def as_expression(pattern: str) -> str:
    """Regular expression for a text with `…` and spaces: `…` is as short as possible, at the end the whole line."""
    *before, last = (r" +".join(map(re.escape, part.split(" "))) for part in pattern.split("…"))
    return "".join(f"{part}.*?" for part in before) + (last or ".*") if before else last


def run(command: str, limit: float) -> tuple[int, str]:
    """Exit status and output of a command. `missionc` runs in a folder with the missions only.

    Raises:
        subprocess.TimeoutExpired: the command exceeded ``limit``, seconds.
    """
    programs = {**os.environ, "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "missions").symlink_to(ROOT / "missions")
        ran = subprocess.run(  # noqa: S602
            command,
            shell=True,
            cwd=folder if command.startswith("missionc ") else ROOT,
            env=programs,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=limit,
            check=False,
        )
    return ran.returncode, ran.stdout


def main(words: list[str]) -> int:
    failed = 0
    if words[:1] == ["--run"]:
        rows = read_rows()
        chosen = [row for row in rows if words[1] in f"{row.item} {row.command}"]
        for command in dict.fromkeys(row.command for row in chosen):
            status, output = run(command, 3600)
            shown = {}
            for row in (row for row in rows if row.command == command):
                found, lacking = find_shown(row, status, output)
                failed += bool(lacking)
                print(f"{command}: {lacking or ', '.join(found)}", flush=True)
                if not lacking:
                    shown[row.key] = found
            write(shown)
    write({})
    return 1 if failed else 0


def write(shown: dict[str, list[str]]) -> None:
    """Write the page and the new outputs of commands."""
    rows, known = read_rows(), read_shown() | shown
    kept = {row.key: known[row.key] for row in rows if row.key in known and row.shows != [PASSED]}
    SHOWN.write_text(json.dumps(kept, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), rows, kept), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
