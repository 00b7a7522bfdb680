"""Every file and folder that docs/architecture.md names is there, and every stage is on the page, in its order."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields

from missionc.ir.kernel import nodes
from tests.support.names_in_pages import ROOT

PACKAGE = ROOT / "missionc"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
TREE = PAGE.split("## The tree\n\n```\n", 1)[1].split("\n```", 1)[0]
PROSE = re.sub(r"^```.*?^```", "", PAGE, flags=re.MULTILINE | re.DOTALL)
MODULES = {path.stem for path in PACKAGE.rglob("*.py")} | {path.name for path in PACKAGE.rglob("*") if path.is_dir()}


def entries() -> dict[str, str]:
    """What the tree says of each of its paths, relative to the repository."""
    found: dict[str, str] = {}
    branch: list[str] = []
    for line in TREE.splitlines():
        entry = re.match(r"( {0,4})(\w+/|\w+\.py)\s+(.+)", line)
        if entry is None:
            found["/".join(branch)] += " " + line.strip()
        else:
            inside = branch[: len(entry[1]) // 2] if branch[:1] == ["missionc"] else []
            branch = [*inside, entry[2].rstrip("/")]
            found["/".join(branch)] = entry[3]
    return {path: text for path, text in found.items() if path}


ENTRIES = entries()


def test_what_the_tree_names_is_there() -> None:
    assert ENTRIES
    missing = []
    for path, text in ENTRIES.items():
        home = ROOT / path
        folders = re.findall(r"\b(\w+)/", text)
        modules = re.findall(r"(?<![\w*])(?=\w*_)[a-z][a-z_]*(?:\*|\b(?!/))", text)
        missing += [path] if not home.exists() else []
        missing += [f"{path}: {name}/" for name in folders if not ((home / name).is_dir() or (ROOT / name).is_dir())]
        missing += [f"{path}: {name}.py" for name in modules if not any(home.rglob(f"{name}.py"))]
    assert not missing, "\n".join(missing)


def test_every_stage_and_every_room_of_a_backend_is_in_the_tree() -> None:
    stages = {f"missionc/{path.parent.name}" for path in PACKAGE.glob("*/__init__.py")}
    assert stages - ENTRIES.keys() == set()
    assert {f"missionc/{path.name}" for path in PACKAGE.glob("*.py")} - ENTRIES.keys() == set()
    for backend in ("smt", "clot"):
        rooms = {path.parent.name for path in (PACKAGE / "backends" / backend).glob("*/__init__.py")}
        assert rooms - set(re.findall(r"(\w+)/", ENTRIES[f"missionc/backends/{backend}"])) == set()


def test_the_stages_stand_in_the_order_in_which_they_may_import() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    whole = next(contract for contract in contracts if contract.get("containers") == ["missionc"])
    level = {name: height for height, layer in enumerate(reversed(whole["layers"])) for name in layer.split(" | ")}
    shown = [path.removeprefix("missionc/") for path in ENTRIES if re.fullmatch(r"missionc/[a-z]+", path)]
    assert [level[name] for name in shown] == sorted(level[name] for name in shown)


def test_a_name_in_the_prose_is_a_module_a_folder_or_a_part_of_the_kernel() -> None:
    parts = {part for made in constructors().values() for part in made}
    for name in re.findall(r"`([a-z_]+(?:\.[a-z_]+)*)/?`", PROSE):
        if name == "sys.modules":
            continue
        first, *rest = name.removeprefix("missionc.").split(".")
        assert first in MODULES | parts | {"missionc"}, name
        assert not rest or any((PACKAGE / first).rglob(f"{rest[0]}*")), name


def test_the_table_of_the_kernel_has_every_constructor_with_its_parts() -> None:
    table = PROSE.split("| constructor | true at an agent and a step if |", 1)[1].split("\n\n", 1)[0]
    shown = dict(re.findall(r"`(\w+)\(([\w, ]+)\)`", table))
    assert {name: parts.split(", ") for name, parts in shown.items()} == constructors()


def constructors() -> dict[str, list[str]]:
    """What each node of the kernel is made of, but for the words it came from, and whether it says their opposite."""
    kinds = [getattr(nodes, name) for name in nodes.Node.split(" | ")]
    made = [node for kind in kinds for node in kind.__subclasses__() or [kind]]
    return {node.__name__: [part.name for part in fields(node) if part.name not in ("span", "dual")] for node in made}
