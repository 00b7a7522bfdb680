"""Background checks of open texts, and the diagnostics published from their findings.

Checks run one at a time in parallel with requests, and a check of an outdated version is cancelled. A finding in an
included file is shown at the name of the file, with its position in that file as related information.
"""

from __future__ import annotations

import asyncio
import logging
import re
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from posixpath import basename

from lsprotocol import types

from missionc.base.diagnostics.code import UNUSED_NAME, Severity
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.resources import folder
from missionc.base.source import Span
from missionc.compiler.front_end import Checked, check
from missionc.tools.language_server.open_text import LIMITS, OpenText

SEVERITIES = {Severity.ERROR: types.DiagnosticSeverity.Error, Severity.WARNING: types.DiagnosticSeverity.Warning}
_INCLUDE = re.compile(r'^[ \t]*include\s+"[^"\n]*"', re.MULTILINE)


def diagnostics(text: OpenText, findings: Sequence[Diagnostic]) -> list[types.Diagnostic]:
    return [_diagnostic(text, finding) for finding in findings]


def _diagnostic(text: OpenText, finding: Diagnostic) -> types.Diagnostic:
    span = finding.primary.span if finding.primary else Span(text.source, 0, 0)
    labels = [label for label in finding.labels if label.message]
    elsewhere = span.source.name != text.source.name
    related = [(label.span, label.message) for label in labels]
    if elsewhere:
        related.insert(0, (span, finding.message))
    elif finding.primary and finding.primary.message:
        related.insert(0, (span, finding.primary.message))
    return types.Diagnostic(
        range=text.places.range(_named(text, span) if elsewhere else span),
        message=finding.words,
        severity=SEVERITIES[finding.severity],
        code=finding.code.name,
        code_description=types.CodeDescription((folder("docs/errors") / f"{finding.code.name}.md").as_uri()),
        source="missionc",
        related_information=[_related(text, *place) for place in related] or None,
        tags=[types.DiagnosticTag.Unnecessary] if finding.code is UNUSED_NAME else None,
    )


def _related(text: OpenText, span: Span, message: str) -> types.DiagnosticRelatedInformation:
    places = text.places_in(span.source)
    return types.DiagnosticRelatedInformation(types.Location(text.uri_of(span.source), places.range(span)), message)


def _named(text: OpenText, place: Span) -> Span:
    """First span in this text that names the file of ``place``; else the first ``include``, or the start."""
    named = re.search(rf'"(?:[^"\n]*/)?{re.escape(basename(place.source.name))}"', text.source.text)
    match = named or _INCLUDE.search(text.source.text)
    return Span(text.source, *match.span()) if match else Span(text.source, 0, 0)


PATIENCE = 0.5
"""Maximum seconds that an answer waits for the check of the current version."""

log = logging.getLogger(__name__)


class SupersededError(Exception):
    """Error: the text of a running check has a newer version."""


class Checks:
    """Background checks of open texts.

    Args:
        publish: function that is called in the loop's thread with each checked text that is still current.
    """

    def __init__(self, publish: Callable[[OpenText], None]) -> None:
        self._publish = publish
        self._newest: dict[str, OpenText] = {}
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="check")
        self._closed = False
        self._running: dict[asyncio.Task[None], OpenText] = {}

    def ask(self, text: OpenText) -> None:
        """Start a check of a text, and cancel that of an older version."""
        if self._closed:
            return
        self._newest[text.uri] = text
        task = asyncio.ensure_future(self._run(text))
        self._running[task] = text
        task.add_done_callback(self._running.pop)

    async def settled(self, uri: str) -> None:
        """Wait until the newest version of a text is checked, or until the maximum time."""
        until = time.monotonic() + PATIENCE
        while (left := until - time.monotonic()) > 0:
            running = [task for task, text in self._running.items() if text is self._newest.get(uri)]
            if not running:
                return
            await asyncio.wait(running, timeout=left)

    def forget(self, uri: str) -> None:
        self._newest.pop(uri, None)

    def close(self) -> None:
        self._closed = True
        self._newest.clear()
        self._worker.shutdown(wait=False, cancel_futures=True)

    async def _run(self, text: OpenText) -> None:
        try:
            checked = await asyncio.get_running_loop().run_in_executor(self._worker, self._check, text)
        except SupersededError:
            return
        except Exception:
            log.exception("internal error: this text cannot be checked")
            return
        if self._is_newest(text):
            text.found = checked
            self._publish(text)

    def _check(self, text: OpenText) -> Checked:
        def before(stage: str) -> None:
            if not self._is_newest(text):
                raise SupersededError

        before("reading")
        return check(text.source, limits=LIMITS, before=before)

    def _is_newest(self, text: OpenText) -> bool:
        return self._newest.get(text.uri) is text
