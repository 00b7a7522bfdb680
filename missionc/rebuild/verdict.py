"""The check of one document: it says what the folder's files come to, or it does not and why."""

from __future__ import annotations

from missionc.verify.certificate import Check

DOCUMENT = "document"


def verdict(name: str, reason: str | None) -> Check:
    """Of a file or an entry of the manifest; ``reason`` is empty or absent where nothing is wrong with it."""
    return Check(DOCUMENT, name, 0.0, "", 0.0, not reason, detail=reason or "it says what the folder's files come to")
