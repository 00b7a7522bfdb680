"""The verdict on one document: it agrees with the folder's files, or the reason why not."""

from __future__ import annotations

from missionc.verification.certificate import Check

DOCUMENT, UNJUDGED = "document", "unjudged document"
"""Names of checks for rebuilt documents, and for those that cannot be rebuilt here."""


def verdict(name: str, reason: str | None) -> Check:
    """Check of a file or an entry of the manifest; ``reason`` is empty or None if it is correct."""
    return Check(
        DOCUMENT, name, 0.0, "", 0.0, not reason, detail=reason or "its contents match the files of the folder"
    )


def unjudged(name: str, reason: str) -> Check:
    """Check of a file that cannot be verified here."""
    return Check(UNJUDGED, name, 0.0, "", 0.0, False, detail=reason)
