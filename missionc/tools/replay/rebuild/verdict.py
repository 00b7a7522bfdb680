"""The verdict on one document: it agrees with what the folder's files come to, or the reason why not."""

from __future__ import annotations

from missionc.verification.certificate import Check

DOCUMENT, UNJUDGED = "document", "unjudged document"
"""The names of checks: of a document that was made once more, and of one that cannot be made here."""


def verdict(name: str, reason: str | None) -> Check:
    """The check of a file or an entry of the manifest; ``reason`` is empty or absent where nothing is wrong with it."""
    return Check(
        DOCUMENT, name, 0.0, "", 0.0, not reason, detail=reason or "its contents match the files of the folder"
    )


def unjudged(name: str, reason: str) -> Check:
    """The check of a file of which nobody can say here whether it is right."""
    return Check(UNJUDGED, name, 0.0, "", 0.0, False, detail=reason)
