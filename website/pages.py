"""The pages of the site: in which order they are read, and where each lies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from missionc.base.diagnostics.code import FAMILIES

ROOT = Path(__file__).resolve().parents[1]
MADE = "made/"
"""Sources that begin so are in no file: ``generated`` makes them."""


@dataclass(frozen=True, slots=True)
class Page:
    """A page by its title in the navigation, its source, and where it lies on the site.

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
    """Pages under one heading, which may be a page itself: the first."""

    title: str
    parts: tuple[Page | Section, ...]


def navigation() -> tuple[Page | Section, ...]:
    """All pages. One whose source is not there is left out; a test finds those of ``docs/`` that are in no place."""
    return _there(
        (
            Page("Home", "docs/index.md"),
            Section(
                "Learn",
                (
                    Page("A mission, step by step", "docs/tutorial.md"),
                    Page("A team in formation", "docs/tutorial_formations.md"),
                    Page("From a plan to a flight", "docs/tutorial_flying.md"),
                    Section(
                        "How to",
                        (
                            Page("A relay", "docs/howto_relay.md"),
                            Page("A light show", "docs/howto_light_show.md"),
                            Page("A patrol", "docs/howto_patrol.md"),
                            Page("A map from ROS", "docs/howto_ros_map.md"),
                            Page("From plan to flight", "docs/howto_flight.md"),
                            Page("Read an infeasibility report", "docs/howto_refusal.md"),
                        ),
                    ),
                    Page("Gallery", "docs/gallery.md"),
                    Page("The studio", "docs/studio.md"),
                    Page("Editors", "docs/editors.md"),
                    Page("VS Code", "editors/vscode/README.md", "vscode.md"),
                    Section("Missions", (Page("All missions", "made/missions/index.md"), *_missions())),
                    Page("Programs in Python", "made/examples.md"),
                    Page("FAQ", "docs/faq.md"),
                    Page("Comparison", "docs/comparison.md"),
                ),
            ),
            Section(
                "Reference",
                (
                    Page("The mission language", "docs/language.md"),
                    Page("Semantics", "docs/semantics.md"),
                    Page("Glossary", "docs/glossary.md"),
                    Page("Command line", "docs/commands.md"),
                    Page("Exit status, JSON and SARIF", "docs/json.md"),
                    Page("Presets, limits and checkpoints", "docs/planning.md"),
                    Page("Settings of the backends", "docs/settings.md"),
                    Section(
                        "Outputs",
                        (
                            Page("The plan folder", "docs/outputs.md"),
                            Page("The report", "docs/report.md"),
                            Page("Verification and the certificate", "docs/verify.md"),
                            Page("Exports", "docs/exports.md"),
                            Page("Flights in simulation", "docs/simulate.md"),
                            Page("Sweeps", "docs/sweep.md"),
                            Page("Live monitoring", "docs/live.md"),
                            Page("Replan in flight", "docs/replan.md"),
                            Page("Flights in a closed loop", "docs/fly.md"),
                            Page("Infeasible missions", "docs/impossible.md"),
                        ),
                    ),
                    Section("Errors", (Page("All codes", "made/errors/index.md"), *_families())),
                    Section("Python", (Page("From Python", "docs/python.md"), Page("API", "made/api.md"))),
                    Page("Extensions", "docs/extending.md"),
                ),
            ),
            Section(
                "Inside",
                (
                    Page("Architecture", "docs/architecture.md"),
                    Page("The roadmap backend", "docs/roadmaps.md"),
                    Page("The transport backend", "docs/transport.md"),
                    Page("The task layer", "docs/tasks.md"),
                    Page("The theory", "docs/theory.md"),
                    Page("Both papers, row by row", "docs/papers.md"),
                    Page("Performance", "docs/performance.md"),
                    Section(
                        "Decisions",
                        (
                            Page("Decisions by topic", "docs/decisions/README.md", "decisions/index.md"),
                            *_each("decisions"),
                        ),
                    ),
                    Page("Contributing", "CONTRIBUTING.md"),
                    Page("Tests", "tests/README.md", "tests.md"),
                    Page("The farm", "docs/farm.md"),
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
    """Where a source of the repository lies on the site: pages, and the files that stand for generated ones."""
    found = {page.source: page.path for page in flat(navigation()) if not page.source.startswith(MADE)}
    found |= {f"missions/{name}.mission": f"missions/{name}.md" for name in missions()}
    found |= {"missions": "missions/index.md", "missions/gallery": "missions/index.md"}
    return found | {"docs/errors": "errors/index.md", "examples": "examples.md", "CHANGELOG.md": "changes.md"}


def missions() -> list[str]:
    """The missions of the repository: paths in ``missions/``, without what they end in."""
    folder = ROOT / "missions"
    return sorted(path.relative_to(folder).with_suffix("").as_posix() for path in folder.rglob("*.mission"))


def _missions() -> tuple[Page, ...]:
    return tuple(Page(name.rpartition("/")[2], f"{MADE}missions/{name}.md") for name in missions())


def _families() -> tuple[Section, ...]:
    """The pages of the codes, by what they are about."""
    return tuple(
        Section(f"MC{digit}xx: {about}", _each("errors", f"MC{digit}*.md")) for digit, about in FAMILIES.items()
    )


def _each(folder: str, pattern: str = "[0-9]*.md") -> tuple[Page, ...]:
    """Pages of a folder, by their first heading."""
    pages = sorted((ROOT / "docs" / folder).glob(pattern))
    return tuple(Page(heading(page), f"docs/{folder}/{page.name}", f"{folder}/{page.name}") for page in pages)


def heading(page: Path) -> str:
    """The first heading of a Markdown file."""
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
