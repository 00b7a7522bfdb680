"""What is loaded when: the front end stays light, and data never becomes code."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path

import pytest

from missionc.cli.app import MODULES as COMMANDS

ROOT = Path(__file__).resolve().parents[2]
HEAVY = {"z3", "pysat", "torch", "networkx", "scipy", "matplotlib", "piqp", "jinja2", "mcap"}
MODULES = sorted((ROOT / "missionc").rglob("*.py"))
COVERED = """\
mission covered
time step 1 s, horizon 4 s
world (0, 0) to (6, 6)
region goal = disc at (3, 3) radius 0.5 m
obstacle left = box (1, 1) to (3.2, 5)
obstacle right = box (3, 1) to (5, 5)
team robot[1] {
  radius 0.1 m
  dynamics single_integrator(speed <= 1 m/s)
  start at (0.5, 0.5)
}
require there: some robot: eventually[0, 4 s] goal
"""
FORBIDDEN_MODULES = {"pickle", "marshal", "shelve", "yaml", "cflib", "dill", "cloudpickle", "joblib"}
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}


def loaded_by(code: str) -> set[str]:
    """The top-level modules in memory after some code ran in a process of its own."""
    script = f"{code}\nimport sys\nprint('\\n'.join({{name.partition('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(run.stdout.split())


ARRAYS = {"numpy", "shapely", "scipy"}
"""What takes longer to load than all else that a mission without many shapes and agents needs."""

SAMPLES = ("wildfire", "clot_dynamic", "gallery/evacuation", "gallery/mountain_rescue", "gallery/pylon_inspection")
"""Boxes, discs, balls, cylinders and paths, in planes and in volumes."""

QUICK = (
    *(["check", f"missions/{name}.mission"] for name in SAMPLES),
    ["fmt", "--check", "missions/wildfire.mission"],
    ["explain"],
    ["explain", "MC301"],
    ["explain", "missions/wildfire.mission"],
    ["init", "--list"],
    ["--version"],
    ["--help"],
    *([command, "--help"] for command in COMMANDS),
)


@pytest.mark.parametrize("words", QUICK, ids=" ".join)
def test_what_needs_no_arrays_loads_none(words: list[str]) -> None:
    assert loaded_by(f"from missionc.cli.app import main\nassert main({words}) == 0") & (ARRAYS | HEAVY) == set()


def test_init_loads_no_arrays(tmp_path: Path) -> None:
    words = ["init", str(tmp_path / "first")]
    assert loaded_by(f"from missionc.cli.app import main\nassert main({words}) == 0") & (ARRAYS | HEAVY) == set()


@pytest.mark.parametrize("words", ["ch", "check --vehicle c", "compile --backend ", "export build c", "explain MC30"])
def test_completion_loads_no_arrays(words: str) -> None:
    asked = {"COMP_WORDS": f"missionc {words}", "COMP_CWORD": str(len(words.split(" ")))}
    code = (
        f"import os\nos.environ |= {asked | {'_MISSIONC_COMPLETE': 'bash_complete'}}\n"
        "from missionc.cli.app import commands\n"
        "try:\n    commands.main(args=[], prog_name='missionc')\nexcept SystemExit:\n    pass"
    )
    loaded = loaded_by(code)
    assert "missionc" in loaded
    assert loaded & (ARRAYS | HEAVY) == set()


def test_geometry_is_loaded_where_no_place_answers(tmp_path: Path) -> None:
    mission = tmp_path / "covered.mission"
    mission.write_text(COVERED, encoding="utf-8")
    code = f"from missionc.cli.app import main\nassert main(['check', {str(mission)!r}]) == 1"
    assert loaded_by(code) >= {"numpy", "shapely"}


def test_check_loads_no_solver_and_no_large_library() -> None:
    check = "main(['check', '--format', 'json', 'missions/wildfire.mission'])"
    code = f"from missionc.cli.app import main\nassert {check} == 0"
    assert loaded_by(code) & HEAVY == set()


def test_explain_loads_no_solver_and_no_large_library() -> None:
    asked = ["explain", "missions/wildfire.mission", "--format", "json"]
    code = f"from missionc.cli.app import main\nassert main({asked}) == 0"
    assert loaded_by(code) & HEAVY == set()


def test_the_cost_graph_is_shown_without_loading_torch() -> None:
    asked = ["compile", "missions/clot_star.mission", "--emit", "cost-graph"]
    code = f"from missionc.cli.app import main\nassert main({asked}) == 0"
    assert "torch" not in loaded_by(code)


ALONE = """\
mission alone
time step 0.4 s, horizon 4 s
world (0, 0) to (8, 6)
region goal = box (5, 3) to (7.5, 5.5)
team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 4 m/s)  start at (1, 1) }
require visit: eventually[0, 4 s] every drone: goal
"""
TOGETHER = (
    ALONE.replace("team drone[1]", "team drone[2]").replace("start at (1, 1)", "start at (1, 1), (1, 2)")
    + "formation row = line of drone spacing 0.6 m tolerance 0.1 m\nrequire row: eventually[1.2 s, 2.8 s] row\n"
)


@pytest.mark.parametrize(
    ("mission", "preset", "opened"),
    [(TOGETHER, "sketch", False), (ALONE, "search", True)],
    ids=["sketch", "search"],
)
def test_the_algorithms_of_the_paper_are_loaded_where_they_are_asked_for(
    mission: str, preset: str, opened: bool
) -> None:
    pytest.importorskip("torch")
    code = (
        "import sys\nfrom missionc import Options, Source, compile\n"
        f"source, options = Source('a.mission', {mission!r}), Options(preset={preset!r})\n"
        "made = compile(source, backend='clot', seed=1, options=options)\n"
        "assert any(name == 'plan.json' for name, _ in made.files), made.outcome\n"
        "print(any(name.startswith('missionc.backends.clot.paper.') for name in sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == str(opened)


def test_check_loads_nothing_that_flies() -> None:
    script = (
        "import sys\nfrom missionc.cli.app import main\nassert main(['check', 'missions/wildfire.mission']) == 0\n"
        "print([name for name in sys.modules if name.startswith(('missionc.simul', 'missionc.cli.commands.simulate'))])"
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"


def test_importing_the_package_loads_nothing_of_it_but_its_version() -> None:
    script = "import sys, missionc; print([name for name in sys.modules if name.startswith('missionc.')])"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "['missionc.version']"


def test_no_two_modules_need_one_another_even_for_their_types() -> None:
    modules = {named(path): path for path in MODULES}
    needs = {
        name: within(ast.parse(path.read_text(encoding="utf-8")), modules) - {name} for name, path in modules.items()
    }
    assert sum(map(len, needs.values())) > len(modules)
    while leaves := {name for name, needed in needs.items() if not needed & needs.keys()}:
        needs = {name: needed for name, needed in needs.items() if name not in leaves}
    assert {name: needed & needs.keys() for name, needed in needs.items()} == {}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_turns_data_into_code(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert imported(tree) & FORBIDDEN_MODULES == set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            assert not (isinstance(node.func, ast.Name) and node.func.id in FORBIDDEN_CALLS), f"line {node.lineno}"
            for keyword in node.keywords:
                assert keyword.arg != "shell", f"line {node.lineno}"
                assert not (keyword.arg == "cache" and "lark" in imported(tree)), f"line {node.lineno}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_is_longer_than_six_hundred_lines(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 600


def named(path: Path) -> str:
    """The name a module is imported by."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(tree: ast.Module, modules: Collection[str]) -> set[str]:
    """Which of these modules are imported, wherever in the module that stands."""
    needed: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            needed |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            needed |= whole if whole <= set(modules) else {*whole, node.module}
    return needed & set(modules)


def imported(tree: ast.Module) -> set[str]:
    """The top-level names of everything a module imports."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.partition(".")[0])
    return names
