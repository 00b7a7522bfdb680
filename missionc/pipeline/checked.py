"""The result of a check: the findings and each tree that was made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from missionc import ir
from missionc.base.late_dataclass import dataclass
from missionc.base.notebook import printed, shown
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.diagnostics.model import Diagnostic, has_errors
from missionc.diagnostics.render import counts, render_text
from missionc.kernel.nodes import Kernel
from missionc.lower.choose_backend import Choice
from missionc.syntax import ast

if TYPE_CHECKING:  # whoever checks a mission of which nothing was flown loads no arrays
    from missionc.progression.past_document import Past
    from missionc.progression.stretches import Remaining


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """What the front end made of a mission: every finding, and each tree it came to.

    ``findings`` are in file order. The trees are None from the first stage with
    errors on; where ``ok``, all are there.
    """

    file: str
    findings: tuple[Diagnostic, ...]
    sources: tuple[Source, ...] = ()
    unread: tuple[str, ...] = ()
    """Files that are included and could not be read, by the names under which they would be sources."""
    overrides: Mapping[str, str] = field(default_factory=dict)
    vehicle: str = ""
    """The profile that flies the teams which name none; empty for none."""
    stretch: float = 1.0
    """How many times as long as written it lasts."""
    poses: Source | None = None
    """Where its agents were measured to stand."""
    program: ast.Program | None = None
    mission: ir.Mission | None = None
    choice: Choice | None = None
    kernel: Kernel | None = None
    seconds: tuple[tuple[str, Seconds], ...] = ()
    past: Past | None = None
    """What was flown of it already, where that is so: ``mission`` and ``kernel`` are then the rest of it."""
    rest: Remaining | None = None
    """That rest, with what of the mission can no longer be kept."""
    stops: tuple[tuple[str, str], ...] = ()
    """The text of the polynomials that each agent flies until the rest begins, by the agent's name."""

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings may be."""
        return not has_errors(list(self.findings))

    @property
    def valid_mission(self) -> ir.Mission:
        """The mission, if there is no error."""
        assert self.mission is not None
        return self.mission

    @property
    def valid_kernel(self) -> Kernel:
        """The kernel, if there is no error."""
        assert self.kernel is not None
        return self.kernel

    def __str__(self) -> str:
        return below(self.findings, f"{self.file}: {counts(self.findings)}")

    _repr_pretty_ = printed
    _repr_html_ = shown


def below(findings: tuple[Diagnostic, ...], *lines: str) -> str:
    """Findings with their words in the text, and then these lines."""
    text = render_text(list(findings), False)
    return "\n".join(([text] if text else []) + list(lines))
