"""The documentation page of a diagnostic code, ``docs/errors/MCnnn.md``."""

from __future__ import annotations

from missionc.base.diagnostics.code import Code
from missionc.base.resources import folder


def explain(code: Code) -> str:
    """Page of a code, Markdown.

    Raises:
        FileNotFoundError: the installation is incomplete.
    """
    return (folder("docs/errors") / f"{code.name}.md").read_text(encoding="utf-8")
