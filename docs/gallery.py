"""The gallery: a page and a picture for each mission in ``missions/gallery``, generated from the missions.

python docs/gallery.py          compiles every mission, draws its plan into docs/images/gallery, writes docs/gallery.md
python docs/gallery.py NAME...  likewise, of these missions; the page is of all
python docs/gallery.py --page   writes the page alone

``tests/unit/project/test_gallery.py`` reports a page that is out of date.
"""

from __future__ import annotations

import io
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from missionc import ir
from missionc.backends.api import Budget
from missionc.base.diagnostics.model import Diagnostic
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Verified
from missionc.ir.language.walk_formulas import formulas_bottom_up, goals
from missionc.output.plot.plot import plot

ROOT = Path(__file__).resolve().parent.parent
MISSIONS = ROOT / "missions" / "gallery"
PAGE = ROOT / "docs" / "gallery.md"
PICTURES = ROOT / "docs" / "images" / "gallery"
WIDTH, COLOURS = 800, 256
"""Width of a picture in pixels, and its number of colours."""
SECONDS = 300
COLUMNS = 4
"""Number of thumbnails in a row."""

PLANNED = {
    "smt": "Planned on roadmaps",
    "clot": "Planned in continuous space",
    "hybrid": "Planned with both",
}
"""Headings in order, by chosen backend."""

ABOUT = """# Gallery

This page shows example missions for real situations, each in one file of [`missions/gallery`](../missions/gallery).
Copy and change a mission that resembles your task.

Search terms: examples, search and rescue, surveillance, warehouse, inspection, formation flight, relay network.

Each picture (`missionc compile FILE --plot`) shows a plan, with a ring at each start, a filled mark
at each end, obstacles in grey. A small picture links to the section of its mission, the picture in the section to
the mission file or, on the site, to the report.
"""

NOTE = "<!-- Made by `make gallery` from the missions. Change those, not this. -->"


def files() -> list[Path]:
    """All missions of the gallery, by name."""
    return sorted(MISSIONS.glob("*.mission"))


def page(missions: list[Path]) -> str:
    """Text of the page about them."""
    checked = {path: driver.check(path) for path in missions}
    parts = [ABOUT + "\n" + NOTE, thumbnails(missions), overview(checked)]
    for backend, heading in PLANNED.items():
        chosen = [path for path, each in checked.items() if each.choice and each.choice.backend == backend]
        if chosen:
            parts += [f"## {heading}", *map(section, chosen)]
    return "\n\n".join(parts) + "\n"


def thumbnails(missions: list[Path]) -> str:
    """Table of all pictures with links to their sections."""
    cells = [f"[![{title(path)}](images/gallery/{path.stem}.png)](#{anchor(path)})" for path in missions]
    cells += [""] * (-len(cells) % COLUMNS)
    rows = [f"| {' | '.join(cells[at : at + COLUMNS])} |" for at in range(0, len(cells), COLUMNS)]
    return "\n".join([rows[0], "|---" * COLUMNS + "|", *rows[1:]])


def title(path: Path) -> str:
    """Title of a mission's section."""
    return path.stem.replace("_", " ").capitalize()


def anchor(path: Path) -> str:
    """Anchor of a mission's section."""
    return path.stem.replace("_", "-")


def overview(checked: dict[Path, Checked]) -> str:
    """Table of all missions with links to their files, sizes and language elements."""
    rows = ["| mission | agents | duration | elements of the language |", "|---|---|---|---|"]
    for path, each in checked.items():
        mission = each.mission
        assert mission is not None, path
        length = f"{mission.step * mission.steps:g} s in steps of {mission.step:g} s"
        file = f"[{title(path)}](../missions/gallery/{path.name})"
        rows.append(f"| {file} | {len(mission.agents)} | {length} | {', '.join(shows(mission))} |")
    return "\n".join(rows)


def section(path: Path) -> str:
    """Section of one mission: name, opening comment and picture."""
    return "\n\n".join(
        [
            f"### {title(path)}",
            opening(path.read_text(encoding="utf-8")),
            f"[![{title(path)}: the plan](images/gallery/{path.stem}.png)](../missions/gallery/{path.name})",
        ]
    )


def opening(text: str) -> str:
    """Opening comment of a mission, as one paragraph."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    return " ".join(lines)


def shows(mission: ir.Mission) -> Iterator[str]:
    """Notable features in it, in terms of the language."""
    operators, predicates = set(), set()
    for formula in formulas_bottom_up(goal.formula for goal in goals(mission)):
        match formula:
            case ir.Apply(operator=operator) if operator.name not in ("and", "or", "not", "always", "eventually"):
                operators.add(operator.name)
            case ir.Holds(ir.Touches()):
                predicates.add("touches")
            case ir.Holds(ir.Inside(body=True)):
                predicates.add("inside")
            case ir.Holds(ir.Connected()):
                predicates.add("connected")
            case ir.Holds(ir.Compare()):
                predicates.add("comparisons of states")
            case _:
                pass
    yield from (f"`{word}`" for word in sorted(operators | predicates) if " " not in word)
    yield from sorted(word for word in predicates if " " in word)
    kinds = sorted({formation.kind for formation in mission.formations})
    yield from (f"formation `{kind}`" for kind in kinds)
    yield from sorted({f"{agent.dynamics.word.replace('_', ' ')}s" for agent in mission.agents})
    yield from sorted({f"vehicle `{each.vehicle.name}`" for each in mission.agents if each.vehicle is not ir.PLAIN})
    if mission.dimension == 3:
        yield "a volume"
    if any(isinstance(obstacle.motion, ir.Path) for obstacle in mission.obstacles):
        yield "a moving obstacle"
    if any(obstacle.growth for obstacle in mission.obstacles):
        yield "an uncertain obstacle"
    if mission.tolerances:
        yield "`tolerate delay`"
    if mission.preferences:
        yield "`prefer`"
    if mission.solve.roadmap is not None:
        yield "a given roadmap"
    if mission.objective is not ir.Objective.NONE:
        yield f"`{mission.objective}`"


def picture(path: Path, seed: int = 0) -> bytes | str:
    """Plan of a mission as a small PNG, or the reason why there is none."""
    checked = driver.check(path)
    compiled = driver.plan(checked, PlanRequest(Budget(time.monotonic() + SECONDS, seed=seed)))
    if checked.mission is None or not isinstance(compiled.outcome, Verified):
        return "; ".join(finding.message for finding in compiled.findings)
    plan = compiled.outcome.plan
    roadmaps = compiled.outcome.report.roadmaps if checked.mission.solve.roadmap is not None else ()
    drawn = plot(checked.mission, plan.trace, plan.backend, "png", roadmaps=roadmaps)
    return drawn.message if isinstance(drawn, Diagnostic) else smaller(drawn)


def smaller(png: bytes) -> bytes:
    """Picture with fewer pixels and colours."""
    from PIL import Image

    image = Image.open(io.BytesIO(png)).convert("RGB")
    height = round(image.height * WIDTH / image.width)
    resized = image.resize((WIDTH, height), Image.Resampling.LANCZOS)
    # The default choice is by area, and thin lines would lose their colours.
    reduced = resized.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    buffer = io.BytesIO()
    reduced.save(buffer, format="png", optimize=True)
    return buffer.getvalue()


def main(words: list[str]) -> int:
    PAGE.write_text(page(files()), encoding="utf-8")
    if "--page" in words:
        return 0
    PICTURES.mkdir(parents=True, exist_ok=True)
    failed = 0
    for path in files():
        if words and path.stem not in words:
            continue
        begin = time.monotonic()
        drawn = picture(path)
        if isinstance(drawn, str):
            failed += 1
            print(f"{path.stem}: picture not drawn: {drawn}")
            continue
        (PICTURES / f"{path.stem}.png").write_bytes(drawn)
        print(f"{path.stem}: {time.monotonic() - begin:.1f} s, {len(drawn) / 1000:.0f} kB")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
