"""Pages made from the code, so that they cannot say anything else than it does."""

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
"""A heading for each module that public names live in, in the order of the page."""


def api() -> str:
    """Every public name, from its docstring.

    Raises:
        ValueError: a public name lives in a module without a heading.
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
    """The programs of ``examples/``, each with what it says of itself."""
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
    """Every mission of the repository, with what its first comment says."""
    said = [
        "# Missions\n",
        "All missions of the folder `missions/`. The tests compile each of them.\n",
        "| mission | subject |\n|---|---|",
    ]
    said += [f"| [{name}]({name}.md) | {_about(name)} |" for name in names()]
    return "\n".join(said) + "\n"


def mission(name: str) -> str:
    """The text of a mission, by its path in ``missions/``."""
    text = (ROOT / "missions" / f"{name}.mission").read_text(encoding="utf-8")
    return f'# {name.rpartition("/")[2]}\n\n```mission title="missions/{name}.mission"\n{text.rstrip()}\n```\n'


def _about(name: str) -> str:
    """The first comment of a mission, as far as it comes before anything else."""
    lines = (ROOT / "missions" / f"{name}.mission").read_text(encoding="utf-8").splitlines()
    comment = list(takewhile(lambda line: line.startswith("#"), lines))
    return " ".join(line.lstrip("# ") for line in comment).replace("|", "\\|")


def changes() -> str:
    """What was released, and what will be: the fragments."""
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
"""By where the page lies on the site."""


def made(place: str) -> str:
    """The generated page that lies at a place of the site."""
    if place in MAKERS:
        return MAKERS[place]()
    return mission(place.removeprefix("missions/").removesuffix(".md"))
