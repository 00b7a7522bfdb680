"""What is loaded when: the front end stays light, and data never becomes code."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Collection
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from missionc.cli.command_names import BUILT_IN as COMMANDS

ROOT = Path(__file__).resolve().parents[3]
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
    ["check", "--format", "json", "missions/wildfire.mission"],
    ["fmt", "--check", "missions/wildfire.mission"],
    ["explain"],
    ["explain", "MC301"],
    ["explain", "missions/wildfire.mission"],
    ["explain", "missions/wildfire.mission", "--format", "json"],
    ["init", "--list"],
    ["--version"],
    ["--help"],
    *([command, "--help"] for command in COMMANDS),
)

COMPLETED = ("ch", "check --vehicle c", "compile --backend ", "export build c", "explain MC30")
"""Beginnings of command lines that a shell completes."""


def test_what_needs_no_arrays_loads_none(tmp_path: Path) -> None:
    """All in one process, which remembers the first command that loaded a library."""
    code = (
        "import sys\nfrom missionc.cli.app import main\nloaded = {}\n"
        f"for words in {[*QUICK, ['init', str(tmp_path / 'first')]]}:\n"
        "    assert main(words) == 0, words\n"
        f"    for name in {ARRAYS | HEAVY} & set(sys.modules):\n"
        "        loaded.setdefault(name, ' '.join(words))\n"
        "print(f'\\n{loaded}')"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.splitlines()[-1] == "{}"


def test_completion_loads_no_arrays() -> None:
    code = (
        "import os\nfrom missionc.cli.app import commands\n"
        f"for words in {COMPLETED}:\n"
        "    os.environ['COMP_WORDS'], os.environ['COMP_CWORD'] = f'missionc {words}', str(len(words.split(' ')))\n"
        "    os.environ['_MISSIONC_COMPLETE'] = 'bash_complete'\n"
        "    try:\n        commands.main(args=[], prog_name='missionc')\n"
        "    except SystemExit:\n        pass\n"
        "    else:\n        raise AssertionError(words)"
    )
    loaded = loaded_by(code)
    assert "missionc" in loaded
    assert loaded & (ARRAYS | HEAVY) == set()


def test_geometry_is_loaded_where_no_place_answers(tmp_path: Path) -> None:
    mission = tmp_path / "covered.mission"
    mission.write_text(COVERED, encoding="utf-8")
    code = f"from missionc.cli.app import main\nassert main(['check', {str(mission)!r}]) == 1"
    assert loaded_by(code) >= {"numpy", "shapely"}


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


def test_plans_need_no_torch_and_are_the_same_with_it() -> None:
    pytest.importorskip("torch")
    code = (
        "import hashlib\nfrom missionc import Source, compile\n"
        f"for mission, backend in {[(ALONE, 'smt'), (TOGETHER, 'clot')]}:\n"
        "    made = compile(Source('a.mission', mission), backend=backend, seed=1)\n"
        "    assert 'plan.json' in made.files, made.outcome\n"
        "    print(hashlib.sha256(made.files['trajectories.csv']).hexdigest(), 'torch' in sys.modules)"
    )
    without, beside = (
        subprocess.run(
            [sys.executable, "-c", first + code], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout
        for first in ("import sys\nsys.modules['torch'] = None\n", "import sys, torch\n")
    )
    assert without == beside


def test_the_algorithms_of_the_paper_are_loaded_where_they_are_asked_for() -> None:
    """Both in one process: first without them, then with them."""
    pytest.importorskip("torch")
    code = (
        "import sys\nfrom missionc import Options, Source, compile\n"
        f"for mission, preset in {[(TOGETHER, 'sketch'), (ALONE, 'search')]}:\n"
        "    made = compile(Source('a.mission', mission), backend='clot', seed=1, options=Options(preset=preset))\n"
        "    assert 'plan.json' in made.files, made.outcome\n"
        "    print(preset, any(name.startswith('missionc.backends.clot.paper.') for name in sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-2:] == ["sketch False", "search True"]


def test_check_loads_nothing_that_flies() -> None:
    script = (
        "import sys\nfrom missionc.cli.app import main\nassert main(['check', 'missions/wildfire.mission']) == 0\n"
        "foreign = ('missionc.flight.simulation', 'missionc.cli.commands.simulate')\n"
        "print([name for name in sys.modules if name.startswith(foreign)])"
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"


def test_importing_the_package_loads_its_version_and_what_loads_the_rest_late() -> None:
    script = "import sys, missionc; print([name for name in sys.modules if name.startswith('missionc.')])"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "['missionc.base', 'missionc.base.late_names', 'missionc.version']"


def test_no_two_modules_need_one_another_even_for_their_types() -> None:
    modules = {named(path): path for path in MODULES}
    needs = {name: within(tree(path), modules) - {name} for name, path in modules.items()}
    assert sum(map(len, needs.values())) > len(modules)
    while leaves := {name for name, needed in needs.items() if not needed & needs.keys()}:
        needs = {name: needed for name, needed in needs.items() if name not in leaves}
    assert {name: needed & needs.keys() for name, needed in needs.items()} == {}


def test_no_module_turns_data_into_code() -> None:
    faults = [fault for path in MODULES for fault in data_into_code(path)]
    assert not faults, "\n".join(faults)


def data_into_code(path: Path) -> list[str]:
    """Every place of a module that loads or runs data as code, with its line."""
    libraries = imported(tree(path))
    faults = [f"{path}:1: imports {name}" for name in libraries & FORBIDDEN_MODULES]
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in FORBIDDEN_CALLS:
                faults.append(f"{path}:{node.lineno}: calls {node.func.id}")
            forbidden = {"shell", "cache"} if "lark" in libraries else {"shell"}
            given = {keyword.arg for keyword in node.keywords} & forbidden
            faults += [f"{path}:{node.lineno}: gives {name}=" for name in sorted(given)]
    return faults


def test_no_module_is_longer_than_six_hundred_lines() -> None:
    assert MODULES
    long = [str(path) for path in MODULES if len(path.read_text(encoding="utf-8").splitlines()) > 600]
    assert not long, "\n".join(long)


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def named(path: Path) -> str:
    """The name a module is imported by."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(module: ast.Module, modules: Collection[str]) -> set[str]:
    """Which of these modules are imported, wherever in the module that stands."""
    needed: set[str] = set()
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            needed |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            needed |= whole if whole <= set(modules) else {*whole, node.module}
    return needed & set(modules)


def imported(module: ast.Module) -> set[str]:
    """The top-level names of everything a module imports."""
    names: set[str] = set()
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.partition(".")[0])
    return names


def test_each_name_that_scripts_outside_the_package_import_exists() -> None:
    scripts = [*(ROOT / "bench").rglob("*.py"), *(ROOT / "docs").glob("*.py"), *(ROOT / "examples").rglob("*.py")]
    imports = [
        (path, node.module, name.name)
        for path in scripts
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "missionc"
        for name in node.names
    ]
    assert imports
    missing = [
        f"{path.relative_to(ROOT)}: {module}.{name}"
        for path, module, name in imports
        if module and not hasattr(import_module(module), name) and find_spec(f"{module}.{name}") is None
    ]
    assert not missing
