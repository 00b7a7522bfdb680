"""Verification of the manifest's entries: computed from the folder if possible, otherwise checked for plausibility.

Backend, seed, versions, command and early end cannot be computed from a folder: for this provenance, only types and
ranges are checked.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from missionc.backends.api import CutShort
from missionc.backends.options import DESCRIBED, Recorded, Whole
from missionc.base.extensions import NAME, REGISTRIES, Kind, installed
from missionc.compiler.front_end import Checked
from missionc.compiler.provenance import POSES, inputs
from missionc.ir.vehicle_profiles import profiles
from missionc.output.folder.file_names import (
    ALTERNATIVES,
    MANIFEST,
    MISSION,
    MOST_ALTERNATIVES,
    PAST,
    REPORT,
    SAFE_END,
    SIMULATION,
    WHOLE_FLIGHT,
    file_names,
    polynomials_file,
    stop_file,
    way_file,
)
from missionc.output.folder.manifest import PACKAGES
from missionc.output.with_alternatives import OPTION
from missionc.tools.replay.read_folder import CERTIFICATE, PLAN, VEHICLE, FolderFiles, OutputFolder, options
from missionc.tools.replay.rebuild.export_files import FOLDER
from missionc.tools.replay.rebuild.verdict import verdict
from missionc.verification.certificate import Check
from missionc.verification.compare_documents import is_version, shown
from missionc.verification.flight.verify_safe_end import has_safe_end
from missionc.verification.flight.way_missions import is_whole
from missionc.verification.impossibility.check_refutation import CNF, DRAT
from missionc.verification.impossibility.cover_document import COVER

KEYS = ("schema", "mission", "backend", "seed", "cut_short", "inputs", "files", "versions", "options")
KEYS_OF_PROOF = ("schema", "mission", "holds", "inputs", "files", "versions", "options")
"""Keys in the manifest of a folder with a proof instead of a plan."""
PROOFS = (CNF, DRAT, COVER)
LARGEST_SEED = 2**63 - 1


def check_manifest(opened: OutputFolder) -> Iterator[Check]:
    """Yield the checks of a manifest: its entries, its inputs, and each file that no compiler writes."""
    yield verdict(MANIFEST, _head(opened))
    yield from _inputs(opened, opened.checked)
    known = _known(opened)
    for name in opened.files:
        if name not in known and not name.startswith((FOLDER, f"{MISSION}/")):
            yield verdict(name, "unexpected file for this mission")


def check_manifest_of_proof(found: FolderFiles, checked: Checked, mission: str) -> Iterator[Check]:
    """Yield the same checks for a folder with a proof that no plan exists.

    Args:
        found: contents of the folder.
        checked: its mission.
        mission: name of the mission.
    """
    head = _keys(found.manifest, KEYS_OF_PROOF) or _wrong(
        found.manifest, {"mission": found.manifest["mission"] == mission}
    )
    yield verdict(MANIFEST, head)
    yield from _inputs(found, checked)
    for name in found.files:
        if name not in PROOFS and not name.startswith(f"{MISSION}/"):
            yield verdict(name, "unexpected file in a proof folder")


def _head(opened: OutputFolder) -> str:
    """Error in the first wrong entry of a plan's manifest; empty if there is none."""
    manifest = opened.manifest
    strange = _keys(manifest, KEYS)
    if strange:
        return strange
    seed, cut_short = manifest["seed"], manifest["cut_short"]
    sound = {
        "mission": manifest["mission"] == opened.mission.name,
        "backend": _is_planner(manifest["backend"], opened),
        "seed": isinstance(seed, int) and not isinstance(seed, bool) and 0 <= seed <= LARGEST_SEED,
        "cut_short": cut_short is None or cut_short in [each.value for each in CutShort],
    }
    return _wrong(manifest, sound)


def _is_planner(name: object, opened: OutputFolder) -> bool:
    """Return whether a value is the name of the backend in the plan."""
    return isinstance(name, str) and NAME.fullmatch(name) is not None and opened.plan_document.get("backend") == name


def _keys(manifest: Mapping[str, object], keys: Sequence[str]) -> str:
    strange = [key for key in manifest if key not in keys] or [key for key in keys if key not in manifest]
    return f"unexpected or missing key {shown(strange[0])}" if strange else ""


def _wrong(manifest: Mapping[str, object], sound: Mapping[str, bool]) -> str:
    """Error in the first invalid entry, including versions and options; empty if there is none.

    Args:
        manifest: parsed manifest.
        sound: validity of entries that are already checked, by key.
    """
    wrong = next((key for key, right in sound.items() if not right), None)
    if wrong is not None:
        return f"invalid `{wrong}`: {shown(manifest[wrong])}"
    foreign = manifest.get("backend", "") not in ("", *REGISTRIES[Kind.BACKEND].built_in)
    return _versions(manifest["versions"], foreign) or _options(manifest["options"])


PACKAGE = re.compile(r"[A-Za-z0-9]([\w.-]*[A-Za-z0-9])?", re.ASCII)
"""Pattern of package names."""


def _versions(versions: object, foreign: bool) -> str:
    """Error in the first implausible package version; empty if there is none.

    Args:
        versions: entry of the manifest.
        foreign: whether the backend belongs to an extension, which need not be installed.
    """
    if not isinstance(versions, dict) or not {"missionc", "python"} <= set(versions):
        return "its `versions` do not name the compiler"
    known = {"missionc", "python", *PACKAGES, *(each.package for each in installed())}
    for name, number in versions.items():
        if not (name in known or (foreign and PACKAGE.fullmatch(name))) or not is_version(number):
            return f"invalid version of {shown(name)}: {shown(number)}"
    return ""


OPTIONS: Mapping[str, Callable[[str], bool]] = {
    **{each.name: each.kind.admits for each in DESCRIBED.values() if each.recorded is not Recorded.NEVER},
    VEHICLE: lambda text: text in profiles(),
    POSES: bool,
    OPTION: lambda text: Whole(2, MOST_ALTERNATIVES).admits(text),
    "backend": lambda text: text == "auto",
    "export": lambda text: bool(text) and len(set(text.split(","))) == text.count(",") + 1,
}
"""Validity test of each option's value, by command-line name; parameters are checked with the mission."""


def _options(given: object) -> str:
    if not isinstance(given, dict):
        return "its `options` are not a record"
    for name, text in given.items():
        if not isinstance(text, str) or not (
            name.startswith(("-D ", "--set ")) or (name in OPTIONS and OPTIONS[name](text))
        ):
            return f"invalid option {shown(name)}: {shown(text)}"
    return ""


def _inputs(found: OutputFolder | FolderFiles, checked: Checked) -> Iterator[Check]:
    """Yield the checks that the mission was read from exactly these files, and that their hashes are stated."""
    listed, stated = found.manifest["files"], found.manifest["inputs"]
    read = {f"{MISSION}/{name}": content for name, content in inputs(checked)}
    assert isinstance(listed, dict)
    assert isinstance(stated, dict)
    for name, content in read.items():
        same = found.files.get(name) == content
        yield verdict(name, "" if same else "its content is not the UTF-8 text of the mission")
    for name in [f"{MISSION}/{name}" for name in stated] + [name for name in listed if name.startswith(f"{MISSION}/")]:
        if name not in read:
            yield verdict(name, "the mission does not include it")
    for name in read:
        if stated.get(name.removeprefix(f"{MISSION}/")) != listed.get(name):
            yield verdict(name, "the manifest's `inputs` state another SHA-256 of it")


def _known(opened: OutputFolder) -> set[str]:
    """Names of all files that a folder of this mission may contain, apart from exports and the mission."""
    names = file_names(opened.mission.agents)
    flights = (polynomials_file(names[agent.name]) for agent in opened.mission.agents)
    further = (file for file in opened.files if file.startswith(tuple(f"{name}/" for name in opened.alternatives)))
    table = (ALTERNATIVES,) if OPTION in options(opened.manifest) else ()
    stops = (stop_file(names[agent.name]) for agent in opened.mission.agents) if PAST in opened.files else ()
    past = {PAST, *stops} if PAST in opened.files else set()
    whole = (WHOLE_FLIGHT,) if is_whole(opened.mission) else ()
    ends = (SAFE_END,) if has_safe_end(opened.mission) else ()
    ways = (way_file(stage.value, names[name]) for stage, texts in opened.ways.items() for name in texts)
    return {
        PLAN,
        "trajectories.csv",
        CERTIFICATE,
        REPORT,
        SIMULATION,
        *past,
        *flights,
        *whole,
        *ends,
        *ways,
        *table,
        *further,
    }
