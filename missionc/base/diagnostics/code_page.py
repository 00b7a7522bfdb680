"""The documentation page of a diagnostic code, ``docs/errors/MCnnn.md``."""

from __future__ import annotations

from missionc.base.diagnostics.code import Code
from missionc.base.resources import folder


def explain(code: Code) -> str:
    """Documentation page of a diagnostic code, as Markdown.

    Raises:
        FileNotFoundError: the installation lacks the page.
    """
    return (folder("docs/errors") / f"{code.name}.md").read_text(encoding="utf-8")
