"""SARIF 2.1.0 renderer of diagnostics, for code hosts and editors.

    in   Diagnostic
    out  one log, as plain values

The log depends on the findings only: it contains no time and no machine name. File names are relative to the working
directory; a file outside the working directory has its full path.
"""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote

from missionc.base.diagnostics.code import INTERNAL, Code, explain
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.source import Span
from missionc.version import __version__

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "ROOT"
"""Identifier of the working directory in the log; file names are relative to it."""

Record = dict[str, object]


def render_sarif(findings: list[Diagnostic]) -> Record:
    """SARIF log with one run, and a rule for each diagnostic code that occurs (SARIF 2.1.0, sections 3.14 to 3.58)."""
    codes = sorted({finding.code for finding in findings}, key=lambda code: code.name)
    driver = {"name": "missionc", "version": __version__, "rules": [_rule(code) for code in codes]}
    run = {
        "tool": {"driver": driver},
        "invocations": [{"executionSuccessful": INTERNAL not in codes}],
        "originalUriBaseIds": {ROOT: {"description": {"text": "The folder in which missionc was run."}}},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, codes.index(finding.code)) for finding in findings],
    }
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(code: Code) -> Record:
    page = explain(code)
    return {
        "id": code.name,
        "shortDescription": {"text": code.title},
        "help": {"text": page, "markdown": page},
        "defaultConfiguration": {"level": "warning" if code.warning else "error"},
    }


def _result(finding: Diagnostic, rule: int) -> Record:
    result: Record = {
        "ruleId": finding.code.name,
        "ruleIndex": rule,
        "level": finding.severity.value,
        "message": {"text": finding.words},
        "locations": [_location(finding.primary)] if finding.primary else [],
    }
    if finding.labels:
        result["relatedLocations"] = [{"id": number, **_location(each)} for number, each in enumerate(finding.labels)]
    if finding.fix:
        result["fixes"] = [_fix(finding.fix, finding.help)]
    return result


def _fix(fix: Fix, help_: str) -> Record:
    replacement = {"deletedRegion": _region(fix.span), "insertedContent": {"text": fix.replacement}}
    change = {"artifactLocation": _artifact(fix.span.source.name), "replacements": [replacement]}
    return {"description": {"text": help_}, "artifactChanges": [change]}


def _location(label: Label) -> Record:
    place = {"artifactLocation": _artifact(label.span.source.name), "region": _region(label.span)}
    message = {"message": {"text": label.message}} if label.message else {}
    return {"physicalLocation": place, **message}


def _region(span: Span) -> Record:
    """SARIF region of a span; lines and columns are counted from 1, and ``endColumn`` is exclusive."""
    line, column = span.source.place(span.start)
    end_line, end_column = span.source.place(span.end)
    return {"startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column}


def _artifact(name: str) -> Record:
    """SARIF location of a file: a relative URI, or an absolute URI outside the working directory."""
    path = Path(os.path.normpath(name))
    here = Path.cwd()
    if path.is_absolute() and path.is_relative_to(here):
        path = path.relative_to(here)
    if path.is_absolute() or ".." in path.parts:
        return {"uri": "file://" + quote(os.fsencode(os.path.normpath(here / path)))}
    return {"uri": quote(os.fsencode(path.as_posix())), "uriBaseId": ROOT}
