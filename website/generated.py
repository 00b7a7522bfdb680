"""Pages generated from the code, so that they are always up to date."""

from __future__ import annotations

import ast
from itertools import takewhile

import missionc
from missionc.base.diagnostics.code import CODES, FAMILIES
from website.pages import ROOT
from website.pages import missions as names


def errors() -> str:
    """Every code with its one line, by family."""
    said = [
        "# Errors\n",
        "Every message of the compiler has a code, and every code has a page with its meaning, a failing example "
        "and a repaired example. `missionc explain MC301` prints the page in a terminal.\n",
    ]
    for family, about in FAMILIES.items():
        said.append(f"## MC{family}xx: {about}\n")
        said.append("| code | meaning | |\n|---|---|---|")
        for code in CODES.values():
            if code.name[2] == family:
                kind = "a warning" if code.warning else ""
                said.append(f"| [{code.name}]({code.name}.md) | {code.title} | {kind} |")
        said.append("")
    return "\n".join(said)


HEADINGS = {
    "missionc.tools.api.missions": "Functions of missions: check and monitor",
    "missionc.compiler.driver": "Functions of missions: compile",
    "missionc.tools.api.folders": "Functions of plan folders",
    "missionc.tools.api.sweeps": "Sweeps",
    "missionc.frontend.builder.mission": "Missions built in Python",
    "missionc.frontend.builder.parts": "Formulas, quantities, shapes and agents",
    "missionc.frontend.builder.functions": "Predicates, states and shapes",
    "missionc.frontend.builder.items": "Dynamics",
    "missionc.compiler.front_end": "Results of check",
    "missionc.compiler.results": "Results of compile and monitor",
    "missionc.backends.options": "Planning: options",
    "missionc.base.continuous_time": "Planning: continuous time",
    "missionc.backends.api": "Planning: progress, outcomes",
    "missionc.base.diagnostics.code": "Findings: severity",
    "missionc.base.diagnostics.model": "Findings",
    "missionc.compiler.graphs": "Graphs",
    "missionc.frontend.syntax.lark_grammar": "The grammar",
    "missionc.base.limits": "Size limits",
    "missionc.base.source": "Texts",
}
"""Heading for each module with public names, in the order of the page."""


def api() -> str:
    """Public names with their docstrings.

    Raises:
        ValueError: the module of a public name has no heading.
    """
    said = [
        "# Python API\n",
        "The public names of `missionc`, with their docstrings. All other names are internal and may change. "
        "[missionc from Python](python.md) shows how to use them together.\n",
    ]
    for home in sorted(missionc.HOMES, key=list(HEADINGS).index):
        said.append(f"## {HEADINGS[home]}\n")
        said += [f"::: {home}.{name}\n" for name in missionc.HOMES[home]]
    return "\n".join(said)


def examples() -> str:
    """Programs in ``examples/``, each with its description."""
    said = [
        "# Programs in Python\n",
        "Short programs that use [the public API](api.md), from the folder `examples/`. The tests run them.\n",
    ]
    for program in sorted((ROOT / "examples").glob("*.py")):
        text = program.read_text(encoding="utf-8")
        about = (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]
        said.append(f"## {program.stem.replace('_', ' ').capitalize()}\n\n{about}\n")
        said.append(f'```python title="examples/{program.name}"\n{text}```\n')
    return "\n".join(said)


def missions() -> str:
    """All missions of the repository, with their first comments."""
    said = [
        "# Missions\n",
        "All missions of the folder `missions/`. The tests compile each of them.\n",
        "| mission | subject |\n|---|---|",
    ]
    said += [f"| [{name}]({name}.md) | {_about(name)} |" for name in names()]
    return "\n".join(said) + "\n"


def mission(name: str) -> str:
    """Text of a mission, by its path in ``missions/``."""
    text = (ROOT / "missions" / f"{name}.mission").read_text(encoding="utf-8")
    return f'# {name.rpartition("/")[2]}\n\n```mission title="missions/{name}.mission"\n{text.rstrip()}\n```\n'


def _about(name: str) -> str:
    """First comment of a mission, if it comes before anything else."""
    lines = (ROOT / "missions" / f"{name}.mission").read_text(encoding="utf-8").splitlines()
    comment = list(takewhile(lambda line: line.startswith("#"), lines))
    return " ".join(line.lstrip("# ") for line in comment).replace("|", "\\|")


def changes() -> str:
    """Released and upcoming changes: the fragments."""
    released = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    fragments = [page for page in sorted((ROOT / "changelog.d").glob("*.md")) if page.name != "README.md"]
    title, _, rest = released.partition("\n")
    coming = "\n\n".join(page.read_text(encoding="utf-8").strip() for page in fragments)
    return f"{title}\n{rest.rstrip()}\n\n## Not released yet\n\n{coming}\n"


MAKERS = {
    "errors/index.md": errors,
    "api.md": api,
    "examples.md": examples,
    "missions/index.md": missions,
    "changes.md": changes,
}
"""Generator of each page, by its place on the site."""


def made(place: str) -> str:
    """Generated page for a place on the site."""
    if place in MAKERS:
        return MAKERS[place]()
    return mission(place.removeprefix("missions/").removesuffix(".md"))
