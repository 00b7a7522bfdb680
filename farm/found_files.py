"""Files of findings: a mission with its defect in the first lines, or JSON for cases of several texts.

in   Kind, Case, Fault
out  a file with the violated promise, from which the case can be repeated
"""

from __future__ import annotations

import json
import re
import textwrap
from dataclasses import asdict, dataclass
from pathlib import Path

from farm.trial import MISSION, Case, Fault, Kind

ROOT = Path(__file__).resolve().parents[1]
FOUND = ROOT / "tests" / "corpus" / "found"
"""Folder of findings; a test requires that all of them are fixed."""

TOLD = re.compile(r"^# (promise|trial|settings): (.*(?:\n#  .*)*)\n", re.MULTILINE)
WIDTH = 118


@dataclass(frozen=True, slots=True)
class Found:
    """Saved finding.

    Args:
        trial: seed and number of the trial.
    """

    kind: str
    case: Case
    promise: str
    trial: tuple[int, int]


def keep(folder: Path, kind: Kind, case: Case, fault: Fault, trial: tuple[int, int]) -> Path:
    """Write a finding to a folder under a new name."""
    folder.mkdir(parents=True, exist_ok=True)
    if kind.of_text and set(case.files) == {MISSION}:
        path = _free(folder, fault.signature, ".mission")
        path.write_text(_head(kind, case, fault, trial) + case.files[MISSION], encoding="utf-8")
        return path
    document = {"promise": fault.promise, "seen": fault.seen, "kind": kind.name, "trial": trial, "case": asdict(case)}
    path = _free(folder, fault.signature, ".json")
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def read(path: Path) -> Found:
    """Read a finding from its file."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        document = json.loads(text)
        seed, number = document["trial"]
        return Found(document["kind"], Case(**document["case"]), document["promise"], (seed, number))
    told = {word: re.sub(r"\n#\s+", " ", value) for word, value in TOLD.findall(text)}
    kind, seed, number = told["trial"].split()
    body = TOLD.sub("", text)
    case = Case({MISSION: body}, json.loads(told["settings"]))
    return Found(kind, case, told["promise"], (int(seed), int(number)))


def kept_in(folder: Path) -> list[Path]:
    """Files of all findings in a folder."""
    return sorted([*folder.glob("*.mission"), *folder.glob("*.json")])


def _head(kind: Kind, case: Case, fault: Fault, trial: tuple[int, int]) -> str:
    told = {
        "promise": " ".join(fault.promise.split()),
        "trial": f"{kind.name} {trial[0]} {trial[1]}",
        "settings": json.dumps(case.settings, ensure_ascii=False),
    }
    lines = [
        "\n#   ".join(textwrap.wrap(f"{word}: {value}", WIDTH, break_long_words=False, break_on_hyphens=False))
        for word, value in told.items()
    ]
    return "".join(f"# {line}\n" for line in lines)


def _free(folder: Path, signature: str, ending: str) -> Path:
    plain = re.sub(r"\W+", "_", signature.replace(".py", "")).strip("_").lower()[:80].rstrip("_")
    names = [plain, *(f"{plain}_{number}" for number in range(2, 1000))]
    return next(path for name in names if not (path := folder / f"{name}{ending}").exists())
