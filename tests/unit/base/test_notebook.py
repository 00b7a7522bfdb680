"""What a notebook shows of a value, and the example notebook from its first cell to its last."""

from __future__ import annotations

import base64
import html
import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
import pytest

import missionc
from missionc.backends.api import Attempt, NotFound, Reason, Report
from missionc.base.notebook import paths
from missionc.base.palette import LIGHT
from missionc.base.source import Source
from missionc.base.trace import Judgement, Trace
from missionc.base.units import Seconds
from missionc.compiler.results import Compiled
from tests.support.small_missions import CONFLICT, SMALL, WRONG, parked

ROOT = Path(__file__).resolve().parents[3]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


class Terminal:
    """What IPython prints to where there is no HTML."""

    def __init__(self) -> None:
        self.said = ""

    def text(self, words: str) -> None:
        self.said += words


def printed(value: Any) -> str:
    terminal = Terminal()
    value._repr_pretty_(terminal, False)
    return terminal.said


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return missionc.compile(Source("small.mission", SMALL))


def test_a_compilation_is_its_report_in_a_frame(compiled: Compiled) -> None:
    assert isinstance(compiled.outcome, missionc.Verified)
    shown = compiled._repr_html_()
    framed = re.fullmatch(r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts" [^>]*><pre.*</pre></iframe>', shown, re.S)
    assert framed
    assert html.unescape(framed[1]) == dict(compiled.outcome.files)["report.html"].decode("utf-8")
    assert compiled.outcome._repr_html_() == shown
    assert "small: planned by smt, 2 agents, 6 steps of 1 s, seed 0\n  visit  satisfied" in shown


def test_where_no_frame_is_shown_a_compilation_says_what_it_came_to(compiled: Compiled) -> None:
    assert printed(compiled) == str(compiled)
    assert str(compiled).startswith("small: planned by smt, 2 agents, 6 steps of 1 s, seed 0\n  visit  satisfied")


def test_a_plan_draws_everybody_s_path(compiled: Compiled) -> None:
    assert isinstance(compiled.outcome, missionc.Verified)
    plan = compiled.outcome.plan
    shown = plan._repr_html_()
    drawn = ET.fromstring(base64.b64decode(shown.partition("base64,")[2].partition('"')[0]))
    lines = drawn.findall("{http://www.w3.org/2000/svg}polyline")
    assert len(lines) == 2
    assert all(len(line.attrib["points"].split()) == 7 for line in lines)
    assert "visit  satisfied" in shown


def test_a_path_goes_up_where_y_grows_and_stays_inside_the_picture() -> None:
    drawn = ET.fromstring(paths([[[0.0, 0.0], [3.0, 1.0]], [[2.0, 2.0], [2.0, 2.0]]]))
    first = drawn.find("{http://www.w3.org/2000/svg}polyline")
    assert first is not None
    (x, y), (to_x, to_y) = (tuple(map(float, point.split(","))) for point in first.attrib["points"].split())
    assert 0 < x < to_x < float(drawn.attrib["width"])
    assert 0 < to_y < y < float(drawn.attrib["height"])


def test_regions_obstacles_and_axes_lie_below_the_paths() -> None:
    rock = "obstacle rock = disc at (3.4, 0.8) radius 0.4 m\n"
    moat = "region moat = (box (0, 2.4) to (1, 4)) - (disc at (0.5, 3) radius 0.3)\n"
    text = SMALL + rock + moat
    outcome = missionc.compile(Source("a.mission", text)).outcome
    assert isinstance(outcome, missionc.Verified)
    assert outcome.plan.ground is not None
    drawn = ET.fromstring(paths(outcome.plan.trace.position.tolist(), outcome.plan.ground()))
    names = [each.text for each in drawn.findall("{http://www.w3.org/2000/svg}text")]
    assert {"goal", "rock", "moat", "0", "4"} <= set(names)
    kinds = [each.tag.removeprefix("{http://www.w3.org/2000/svg}") for each in drawn]
    assert kinds[0] == "rect"
    assert max(number for number, kind in enumerate(kinds) if kind == "path") < kinds.index("polyline")
    assert {each.attrib["fill"] for each in drawn if each.tag.endswith("path")} >= {LIGHT["region"]["goal"]}
    assert sum(each.tag.endswith("circle") and each.attrib.get("fill") == LIGHT["obstacle"] for each in drawn) == 1


def test_nobody_who_moves_is_drawn_too() -> None:
    assert b"polyline" in paths([[[1.0, 1.0], [1.0, 1.0]]])


def test_findings_are_shown_with_the_words_they_are_about() -> None:
    checked = missionc.check(Source("a.mission", WRONG.replace("] gaol", "] gaol # <b>")))
    shown = checked._repr_html_()
    assert shown.startswith("<pre")
    assert "^^^^" in shown
    assert "<b>" not in shown
    assert "gaol # &lt;b&gt;" in shown
    assert printed(checked).endswith("a.mission: 1 error")
    (finding,) = checked.findings
    assert printed(finding).startswith("error[MC")
    assert str(finding) in str(checked)


def test_a_refused_compilation_shows_its_findings() -> None:
    shown = missionc.compile(Source("a.mission", WRONG))._repr_html_()
    assert "error[MC101]" in shown
    assert "iframe" not in shown


@pytest.mark.usefixtures("coarse_covers")
def test_an_impossible_one_shows_the_conflict_what_would_do_and_the_nearest_miss() -> None:
    found = missionc.compile(Source("a.mission", CONFLICT), explain_limit=60)
    shown = found._repr_html_()
    assert "error[MC609]" in shown
    assert found.explained is not None
    assert found.explained.relaxations[0].says in html.unescape(shown)
    assert shown.count("<iframe srcdoc=") == 1
    assert html.escape(dict(found.files)["near_miss.html"].decode("utf-8")) in shown


def test_a_judged_trace_shows_its_verdict(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(parked())
    judged = missionc.monitor(Source("small.mission", SMALL), tmp_path / "a.csv")
    assert str(judged).startswith("small: violated\n  visit  violated   robustness ")


def test_findings_in_a_list_are_printed_as_words_too() -> None:
    from IPython.lib.pretty import pretty

    checked = missionc.check(Source("a.mission", WRONG))
    assert "error[MC101]: unknown name `gaol`" in pretty(list(checked.findings))
    assert pretty(checked) == str(checked)


def test_showing_a_value_loads_nothing_of_a_notebook_and_no_large_library() -> None:
    script = (
        "import sys, missionc\nchecked = missionc.check('missions/wildfire.mission')\nchecked._repr_html_()\n"
        "print({name.partition('.')[0] for name in sys.modules} & {'IPython', 'matplotlib', 'scipy', 'z3', 'jinja2'})"
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "set()"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_a_notebook_is_stored_without_what_it_shows(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert set(json.loads(path.read_text(encoding="utf-8"))["metadata"]) == {"kernelspec", "language_info"}
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


def test_the_example_notebook_runs_and_shows_what_it_promises(monkeypatch: pytest.MonkeyPatch) -> None:
    from nbclient import NotebookClient

    (path,) = NOTEBOOKS
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=240, resources={"metadata": {"path": str(path.parent)}}).execute()
    shown = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert all(output.output_type != "error" for output in shown)
    pages = [output.data["text/html"] for output in shown if "text/html" in output.get("data", {})]
    words = "".join(output.data.get("text/plain", "") if "data" in output else output.text for output in shown)
    assert sum(page.startswith("<iframe srcdoc=") for page in pages) == 1
    assert sum(page.startswith("<img ") for page in pages) == 1
    assert "wildfire.mission: no findings" in words
    assert "2 drones: Impossible\n" in words
    assert "error[MC609]: `relay`, `rescue` cannot be satisfied together" in words
    assert "error[MC101]: unknown name `surviver`" in words


def test_an_outcome_without_a_plan_says_what_it_is() -> None:
    found = missionc.compile(Source("a.mission", CONFLICT)).outcome
    assert isinstance(found, missionc.Impossible)
    head, statement = str(found).split("\n")
    names = ", ".join(f"`{name}`" for name in found.conflict)
    assert head == f"{names} cannot be satisfied together, for any motion of these agents"
    assert statement.strip() == found.statement
    assert html.unescape(found._repr_html_()).count(str(found)) == 1
    assert printed(found) == str(found)


def test_an_outcome_that_leaves_it_open_says_how_near_it_came() -> None:
    still = np.zeros((1, 3, 2))
    trace = Trace(Seconds(0.5), still, still, still[..., 0])
    visit = Judgement("visit", False, -1.25, 2, ("drone[0]",))
    found = NotFound(Reason.TIME, "12 attempts", Report(), Attempt((visit,), (), trace))
    assert str(found).split("\n") == [
        f"undecided: {Reason.TIME.value}",
        "  12 attempts",
        "  the best candidate violates `visit` by 1.25 m, at 1 s by drone[0]",
    ]
    assert printed(found) == str(found)
    assert "12 attempts" in found._repr_html_()
    assert str(NotFound(Reason.TIME, Reason.TIME.value, Report())) == f"undecided: {Reason.TIME.value}"
