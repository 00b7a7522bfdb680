"""Figures for papers: what is in them, how wide they are, that text is text, and what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import missionc
from missionc import ir
from missionc.base.diagnostics.code import NO_SUCH_MOMENT
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Trace
from missionc.cli.app import main
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import Kernel
from missionc.output.plot.figure_request import KINDS, WIDTHS, FigureRequest
from missionc.output.plot.figures import figure
from missionc.output.plot.plot_strip import positions

pytest.importorskip("matplotlib")

PAIR = """mission pair
time  step 1 s, horizon 4 s
world (0, 0) to (8, 6)
region goal = box (5, 2) to (7, 4)
region pit  = box (7, 5) to (8, 6)
obstacle wall = box (3, 0) to (4, 1)
separation 0.5 m
team drone[2] {
  dynamics single_integrator(speed <= 2 m/s)
  start    at (1, 2), (1, 4)
}
graph radio = proximity 20 m
require there: some drone: eventually[0, 4 s] goal
require aside: every drone: always[0, 4 s] not pit
"""


@cache
def planned() -> tuple[ir.Mission, Kernel, Trace]:
    compiled = missionc.compile(missionc.Source("pair.mission", PAIR))
    assert isinstance(compiled.outcome, Verified), compiled.findings
    assert compiled.checked.mission is not None
    assert compiled.checked.kernel is not None
    return compiled.checked.mission, compiled.checked.kernel, compiled.outcome.plan.trace


def drawn(request: FigureRequest, suffix: str = "svg") -> bytes:
    picture = figure(request, *planned(), "smt", suffix)
    assert isinstance(picture, bytes)
    return picture


def texts(picture: bytes) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", picture.decode())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_the_same_plan_gives_the_same_bytes(kind: str, suffix: str) -> None:
    request = FigureRequest(kind, width="single")
    assert drawn(request, suffix) == drawn(request, suffix)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("width", WIDTHS)
def test_a_figure_is_as_wide_as_was_asked_for(kind: str, width: str) -> None:
    found = re.search(rb'<svg[^>]* width="([0-9.]+)pt"', drawn(FigureRequest(kind, width=width)))
    assert found
    assert float(found[1]) / 72 * 2.54 == pytest.approx(WIDTHS[width], abs=0.01)


def test_a_strip_has_a_map_for_each_moment_with_links() -> None:
    picture = drawn(FigureRequest(at=(0.0, 1.5, 4.0)))
    assert picture.count(b'id="axes_') == 3
    assert {"0 s", "1.5 s", "4 s", "goal", "wall", "drone[0]", "link"} <= set(texts(picture))
    assert picture.count(b'id="link"') == 3
    assert b'id="formation"' not in picture


def test_a_strip_draws_the_edges_of_formations() -> None:
    mission, kernel, trace = planned()
    edge = ir.FormationEdge(0, 1, 2.0)
    shape = ir.Formation("pair", "chain", (0, 1), (edge,), 0.1, False, mission.regions[0].span)  # type: ignore[arg-type]
    picture = figure(FigureRequest(at=(0.0, 2.0)), replace(mission, formations=(shape,)), kernel, trace, "smt", "svg")
    assert isinstance(picture, bytes)
    assert picture.count(b'id="formation"') == 2
    assert "formation" in texts(picture)


def test_a_snapshot_at_a_step_shows_the_state_of_that_step() -> None:
    mission, _, trace = planned()
    times = np.linspace(0.0, float(mission.step * mission.steps), mission.steps + 1)
    assert positions(mission, trace, times) == pytest.approx(trace.position[:, : mission.steps + 1])


def test_charts_name_what_they_are_about() -> None:
    robust = texts(drawn(FigureRequest("robustness")))
    assert {"there", "aside", "lower bound", "robustness (m)", "time (s)"} <= set(robust)
    distances = texts(drawn(FigureRequest("distances")))
    assert any(text.startswith("separation: minimum ") and text.endswith("required 0.5 m") for text in distances)
    assert any(text.startswith("clearance: minimum ") for text in distances)


def test_a_timeline_has_a_lane_for_who_satisfies_a_requirement() -> None:
    mission, _, trace = planned()
    picture = drawn(FigureRequest("timeline"))
    x, y = trace.position[..., 0], trace.position[..., 1]
    arrived = np.logical_or.reduce((x >= 5) & (x <= 7) & (y >= 2) & (y <= 4), axis=1)
    names = set(texts(picture))
    assert "there" in names
    assert names & {agent.name for agent in mission.agents if arrived[agent.index]}
    assert b'id="lane"' in picture


def test_a_pdf_has_its_fonts_embedded_as_text() -> None:
    picture = drawn(FigureRequest(width="single"), "pdf")
    assert picture.startswith(b"%PDF")
    assert b"/FontFile2" in picture
    assert b"/Type3" not in picture


def test_a_moment_after_the_end_is_refused() -> None:
    found = figure(FigureRequest(at=(1.0, 5.0)), *planned(), "smt", "svg")
    assert isinstance(found, Diagnostic)
    assert found.code is NO_SUCH_MOMENT
    assert "0 to 4" in found.help


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--at", "1"], "`--at` needs a plot"),
        (["--plot-width", "single"], "`--plot-width` needs a plot"),
        (
            ["--plot", "a.svg", "--at", "1", "--plot-kind", "timeline"],
            "`--at` needs a map, not `--plot-kind timeline`; remove one of them",
        ),
        (["--plot", "a.svg", "--at", "1,x"], "`x` is not a time; write seconds, such as `--at 0,2,5.5`"),
        (["--plot", "a.svg", "--at", "-1"], "`-1` is not a time; write seconds, such as `--at 0,2,5.5`"),
        (["--plot", "a.svg", "--at", ",".join(map(str, range(30)))], "`--at` has 30 times; give at most 24"),
        (["--plot", "a.svg", "--plot-kind", "cube"], "'cube' is not one of"),
        (["--plot", "a.gif"], "`a.gif` has no picture format; end the name with one of .svg, .png, .pdf"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pair.mission").write_text(PAIR)
    assert main(["compile", "pair.mission", *words]) == 2
    assert said in capsys.readouterr().err
    assert not Path("build").exists()
