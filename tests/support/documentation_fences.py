"""Static checks of documentation blocks that are not run.

``shell`` is split into commands; each must exist, with existing options.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click

from missionc.cli.app import commands
from tests.support.golden_pages import within

ROOT = Path(__file__).resolve().parents[2]
_HERE_DOCUMENT = re.compile(r"<<'(\w+)'\n(.*?)^\1$", re.MULTILINE | re.DOTALL)
_BETWEEN = frozenset({"&&", "||", "|", ";", "&"})
_ELSEWHERE = frozenset({"dask", "git", "pip", "pygmentize", "python", "python3", "ros2", "source", "uv"})
"""Foreign programs, whose options are not checked."""


def shell(text: str) -> None:
    """Check a shell block.

    Raises:
        AssertionError: the block is not valid, or names a missing command, option, target, extra or file.
    """
    parsed = subprocess.run(["bash", "-n"], input=text, capture_output=True, text=True, check=False)
    assert parsed.returncode == 0, parsed.stderr
    for _, program in _HERE_DOCUMENT.findall(text):
        compile(program, "here-document", "exec")
    for words in _commands(_HERE_DOCUMENT.sub("", text)):
        _command(words)


def console(text: str) -> None:
    """Check the commands of a console block, whose further columns, after two spaces, are descriptions."""
    lines = [line[2:].partition("  ")[0] for line in text.splitlines() if line.startswith("$ ")]
    assert lines, "there is no command"
    for line in lines:
        _command(shlex.split(line))


def _commands(text: str) -> Iterator[list[str]]:
    for line in text.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=";&|")
        lexer.whitespace_split = True
        words: list[str] = []
        for word in lexer:
            if word in _BETWEEN:
                yield words
                words = []
            else:
                words.append(word)
        if words:
            yield words


def _command(words: list[str]) -> None:
    while re.match(r"\w+=", words[0]):
        words = words[1:]
    program, *rest = words
    for word in rest:
        if re.match(r"(missions|examples|bench)/", word):
            assert any(ROOT.glob(word)), word
    match Path(program).name:
        case "missionc":
            usage(rest)
        case "python" | "python3" if rest[:2] == ["-m", "missionc"]:
            usage(rest[2:])
        case "make":
            targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
            assert {word for word in rest if "=" not in word} <= set(targets), words
        case "pytest":
            assert all((ROOT / word).exists() for word in rest if "/" in word), words
        case "eval":
            assert any(shell in rest[0] for shell in ("bash_source missionc", "zsh_source missionc")), words
        case name:
            assert name in _ELSEWHERE, f"`{name}` is no program that this test knows"
    _extras(words)


def usage(words: list[str]) -> None:
    """Parse the words of a command line without running it. Files are assumed to exist."""
    said = ""
    with tempfile.TemporaryDirectory() as folder, within(Path(folder)):
        for _ in words:
            said = _refused(words)
            if absent := re.fullmatch(r"there is no file `(.+)`; check the path", said):
                Path(absent[1]).parent.mkdir(parents=True, exist_ok=True)
                Path(absent[1]).touch()
            elif absent := re.fullmatch(r"there is no folder `(.+)`; check the path", said):
                Path(absent[1]).mkdir(parents=True)
            else:
                break
    assert said == "", f"missionc {' '.join(words)}: {said}"


def _refused(words: list[str]) -> str:
    """Error in the words of a command line."""
    with click.Context(commands, info_name="missionc") as context:
        try:
            name, command, rest = commands.resolve_command(context, list(words))
            assert command is not None
            command.make_context(name, list(rest), parent=context)
        except click.UsageError as error:
            return error.format_message()
        except click.exceptions.Exit:
            pass
    return ""


def _extras(words: list[str]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for word in words:
        for extras in re.findall(r"^(?:missionc|\.)\[([\w,]+)\]", word):
            assert set(extras.split(",")) <= set(project["optional-dependencies"]), word
