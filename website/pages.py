"""Pages of the site in reading order, with their places."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from missionc.base.diagnostics.code import FAMILIES

ROOT = Path(__file__).resolve().parents[1]
MADE = "made/"
"""Prefix of sources without a file: ``generated`` makes them."""


@dataclass(frozen=True, slots=True)
class Page:
    """Page with its title in the navigation, its source, and its place on the site.

    ``source`` is relative to the repository, or begins with ``MADE``.
    """

    title: str
    source: str
    place: str = ""

    @property
    def path(self) -> str:
        return self.place or self.source.removeprefix(MADE).removeprefix("docs/").lower()


@dataclass(frozen=True, slots=True)
class Section:
    """Pages under one heading, which may be a page itself: the first one."""

    title: str
    parts: tuple[Page | Section, ...]


def navigation() -> tuple[Page | Section, ...]:
    """All pages, without missing ones; a test finds pages in ``docs/`` that are not listed."""
    return _there(
        (
            Page("Home", "docs/index.md"),
            Section(
                "Tutorials",
                (
                    Page("First mission", "docs/tutorial.md"),
                    Page("Formations", "docs/tutorial_formations.md"),
                    Page("Flying Crazyflies", "docs/tutorial_flying.md"),
                    Page("Gallery of missions", "docs/gallery.md"),
                    Section("Missions", (Page("All missions", "made/missions/index.md"), *_missions())),
                    Page("Programs in Python", "made/examples.md"),
                ),
            ),
            Section(
                "How-to guides",
                (
                    Page("Keep a relay connected", "docs/howto_relay.md"),
                    Page("Plan a light show", "docs/howto_light_show.md"),
                    Page("Plan a patrol", "docs/howto_patrol.md"),
                    Page("Use a map from ROS", "docs/howto_ros_map.md"),
                    Page("Fly a plan", "docs/howto_flight.md"),
                    Page("Read an infeasibility report", "docs/howto_refusal.md"),
                    Page("Replan in flight", "docs/replan.md"),
                    Page("Use the studio", "docs/studio.md"),
                    Page("Set up an editor", "docs/editors.md"),
                    Page("VS Code", "editors/vscode/README.md", "vscode.md"),
                    Page("FAQ", "docs/faq.md"),
                ),
            ),
            Section(
                "Reference",
                (
                    Page("Mission language", "docs/language.md"),
                    Page("Semantics", "docs/semantics.md"),
                    Page("Command line", "docs/commands.md"),
                    Page("Exit status, JSON and SARIF", "docs/json.md"),
                    Page("Settings of the backends", "docs/settings.md"),
                    Section("Python", (Page("missionc from Python", "docs/python.md"), Page("API", "made/api.md"))),
                    Section(
                        "Files",
                        (
                            Page("Plan folder", "docs/outputs.md"),
                            Page("Report", "docs/report.md"),
                            Page("Exports", "docs/exports.md"),
                        ),
                    ),
                    Section(
                        "Flights and sweeps",
                        (
                            Page("Simulation", "docs/simulate.md"),
                            Page("Closed-loop flights", "docs/fly.md"),
                            Page("Live monitoring", "docs/live.md"),
                            Page("Parameter sweeps", "docs/sweep.md"),
                        ),
                    ),
                    Section("Errors", (Page("All codes", "made/errors/index.md"), *_families())),
                    Page("Extensions", "docs/extending.md"),
                    Page("Glossary", "docs/glossary.md"),
                ),
            ),
            Section(
                "Explanation",
                (
                    Page("How planning works", "docs/planning.md"),
                    Page("Roadmap backend", "docs/roadmaps.md"),
                    Page("Transport backend", "docs/transport.md"),
                    Page("Task layer", "docs/tasks.md"),
                    Page("Verification and the certificate", "docs/verify.md"),
                    Page("Infeasible missions", "docs/impossible.md"),
                    Page("Theory", "docs/theory.md"),
                    Page("Both papers, row by row", "docs/papers.md"),
                    Page("Performance", "docs/performance.md"),
                    Page("Comparison with other tools", "docs/comparison.md"),
                ),
            ),
            Section(
                "Contributing",
                (
                    Page("How to contribute", "CONTRIBUTING.md"),
                    Page("Architecture", "docs/architecture.md"),
                    Page("Tests", "tests/README.md", "tests.md"),
                    Page("Random trials: the farm", "docs/farm.md"),
                    Section(
                        "Decisions",
                        (
                            Page("Decisions by topic", "docs/decisions/README.md", "decisions/index.md"),
                            *_each("decisions"),
                        ),
                    ),
                    Page("Security", "SECURITY.md"),
                    Page("Changes", "made/changes.md"),
                ),
            ),
        )
    )


def flat(parts: tuple[Page | Section, ...]) -> list[Page]:
    """Every page of a navigation, in order."""
    return [page for part in parts for page in ([part] if isinstance(part, Page) else flat(part.parts))]


def places() -> dict[str, str]:
    """Place of each source on the site: pages, and files that correspond to generated ones."""
    found = {page.source: page.path for page in flat(navigation()) if not page.source.startswith(MADE)}
    found |= {f"missions/{name}.mission": f"missions/{name}.md" for name in missions()}
    found |= {"missions": "missions/index.md", "missions/gallery": "missions/index.md"}
    return found | {"docs/errors": "errors/index.md", "examples": "examples.md", "CHANGELOG.md": "changes.md"}


def missions() -> list[str]:
    """Missions of the repository: paths in ``missions/`` without their suffix."""
    folder = ROOT / "missions"
    return sorted(path.relative_to(folder).with_suffix("").as_posix() for path in folder.rglob("*.mission"))


def _missions() -> tuple[Page, ...]:
    return tuple(Page(name.rpartition("/")[2], f"{MADE}missions/{name}.md") for name in missions())


def _families() -> tuple[Section, ...]:
    """Pages of the codes, by topic."""
    return tuple(
        Section(f"MC{digit}xx: {about}", _each("errors", f"MC{digit}*.md")) for digit, about in FAMILIES.items()
    )


def _each(folder: str, pattern: str = "[0-9]*.md") -> tuple[Page, ...]:
    """Pages in a folder, by their first heading."""
    pages = sorted((ROOT / "docs" / folder).glob(pattern))
    return tuple(Page(heading(page), f"docs/{folder}/{page.name}", f"{folder}/{page.name}") for page in pages)


def heading(page: Path) -> str:
    """First heading of a Markdown file."""
    first = next(line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("# "))
    return first[2:].strip()


def _there(parts: tuple[Page | Section, ...]) -> tuple[Page | Section, ...]:
    kept: list[Page | Section] = []
    for part in parts:
        match part:
            case Section(title, inner):
                kept.append(Section(title, _there(inner)))
            case Page(source=source) if source.startswith(MADE) or (ROOT / source).exists():
                kept.append(part)
    return tuple(kept)
