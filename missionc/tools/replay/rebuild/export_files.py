"""Check of exports: each is computed again from the verified polynomials, and compared file by file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.output.export.formats import FORMATS, Exported, Flight, flight
from missionc.tools.replay.read_folder import OutputFolder, option
from missionc.tools.replay.rebuild.verdict import verdict
from missionc.verification.certificate import Check
from missionc.verification.compare_documents import same_text

FOLDER, OPTION = "export/", "export"


def check_exports(opened: OutputFolder) -> Iterator[Check]:
    """Yield a check for each file of an export in the folder or in its manifest."""
    lying: dict[str, dict[str, bytes]] = {}
    for name, content in opened.files.items():
        if name.startswith(FOLDER):
            form, _, file = name.removeprefix(FOLDER).partition("/")
            lying.setdefault(form, {})[file] = content
    requested_forms = [form for form in (option(opened.manifest, OPTION) or "").split(",") if form]
    if not lying and not requested_forms:
        return
    flown = flight(opened.mission, opened.kernel, opened.trace, opened.flights, opened.ways, opened.in_flight)
    for form in dict.fromkeys((*requested_forms, *lying)):
        yield from _form(form, flown, lying.get(form, {}), form in requested_forms)


def _form(form: str, flown: Flight, lying: Mapping[str, bytes], requested: bool) -> Iterator[Check]:
    name = f"{FOLDER}{form}"
    if form not in FORMATS:
        yield verdict(name, "unknown export")
        return
    if not requested:
        yield verdict(name, "the options in the manifest do not include this export")
        return
    made = FORMATS[form].export(flown)
    if isinstance(made, Exported):
        yield from _files(name, lying, made.files)
    elif made.code is EXTRA_MISSING and lying:
        yield verdict(name, f"it cannot be rebuilt for comparison: {made.message}; {made.help}")
    elif lying:
        yield verdict(name, f"this flight has no such export: {made.message}")


def _files(folder: str, lying: Mapping[str, bytes], made: Mapping[str, bytes]) -> Iterator[Check]:
    for file in sorted({*lying, *made}):
        if file not in made:
            reason = "not a file of this export"
        elif file not in lying:
            reason = "it is missing"
        else:
            reason = "" if _same(lying[file], made[file]) else "it does not match the verified polynomials"
        yield verdict(f"{folder}/{file}", reason)


def _same(lying: bytes, made: bytes) -> bool:
    """Return whether two files are equal; numbers in texts may differ by rounding."""
    if lying == made:
        return True
    try:
        return same_text(lying.decode("utf-8"), made.decode("utf-8"))
    except UnicodeDecodeError:
        return False
