"""Verdicts on documents: a document agrees with the files of its folder, or differs for a stated reason."""

from __future__ import annotations

from missionc.verification.certificate import Check

DOCUMENT, UNJUDGED = "document", "unjudged document"
"""Names of the checks of rebuilt documents, and of those that cannot be rebuilt here."""


def verdict(name: str, reason: str | None) -> Check:
    """Check of a file or an entry of the manifest.

    Args:
        name: name of the file or entry.
        reason: the difference in words; empty or None if there is none.
    """
    return Check(
        DOCUMENT, name, 0.0, "", 0.0, not reason, detail=reason or "its contents match the files of the folder"
    )


def unjudged(name: str, reason: str) -> Check:
    """Failed check of a file that cannot be verified here, for a reason in words."""
    return Check(UNJUDGED, name, 0.0, "", 0.0, False, detail=reason)
