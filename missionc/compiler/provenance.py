"""Provenance of outputs: the mission's files, and the options that change the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, assert_never

from missionc.backends.options import DESCRIBED, Described, Options, Recorded
from missionc.backends.registry import AUTO, BACKENDS, is_published
from missionc.backends.setting import flag_of
from missionc.base.extensions import Kind, installed
from missionc.base.source import Source
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Compiled
from missionc.ir import Holds, Mission
from missionc.ir.dynamics import KINDS
from missionc.ir.language.walk_formulas import formulas, formulas_bottom_up
from missionc.ir.predicates import PlacePredicate
from missionc.output.export.form_names import FORMATS
from missionc.output.folder.file_names import MANIFEST, MISSION, NEAR_MISS, PROOF, input_name

if TYPE_CHECKING:
    from missionc.output.folder.manifest import Option


POSES = "from"
"""Name of the option for the file of measured poses, which is one of the inputs."""


def inputs(checked: Checked) -> tuple[tuple[str, bytes], ...]:
    """Content of every file of the mission, with its name relative to the mission's folder."""
    folder = Path(checked.file).parent
    return tuple(
        (poses_name(checked) if source is checked.poses else input_name(source.name, folder), source.content)
        for source in checked.sources
    )


def poses_name(checked: Checked) -> str:
    """Name of the file of measured poses, made unique among the mission's files."""
    assert checked.poses is not None
    folder = Path(checked.file).parent
    taken = {input_name(source.name, folder) for source in checked.sources if source is not checked.poses}
    name = input_name(PurePath(checked.poses.name).name, PurePath())
    while name in taken:
        name = f"measured-{name}"
    return name


def input_name_of(checked: Checked, source: Source) -> str:
    """Name of a file of the mission, relative to the mission's folder."""
    return input_name(source.name, Path(checked.file).parent)


def data(checked: Checked) -> frozenset[str]:
    """Names of the mission's files that contain data instead of mission text, such as maps."""
    return frozenset(name for name, _ in inputs(checked)) - {name for name, _ in texts(checked)}


def texts(checked: Checked) -> tuple[tuple[str, str], ...]:
    """Names and texts of the files that contain mission text."""
    folder = Path(checked.file).parent
    return tuple((input_name(each.name, folder), each.text) for each in checked.sources if each.data is None)


def given(checked: Checked, options: Options) -> tuple[tuple[str, Option], ...]:
    """Command-line options that change the plan; for a mission in flight, also its stretched duration."""
    options = replace(options, stretch=max(options.stretch, checked.stretch))
    engines = checked.choice.engines if checked.choice is not None else ()
    hears = frozenset({"preset"} if is_published(engines, options) else ()).union(
        *(BACKENDS[name].options for name in engines)
    )
    named = [(each.name, each.text(options)) for each in DESCRIBED.values() if _is_recorded(each, options, hears)]
    named.extend([("backend", AUTO)] if len(engines) > 1 else [])
    named.extend([("vehicle", checked.vehicle)] if checked.vehicle else [])
    if checked.poses is not None:
        named.append((POSES, poses_name(checked)))
    return (*named, *((f"{flag_of(name)} {name}", text) for name, text in sorted(checked.overrides.items())))


def _is_recorded(option: Described, options: Options, hears: frozenset[str]) -> bool:
    match option.recorded:
        case Recorded.ALWAYS:
            return True
        case Recorded.BY_ITS_BACKENDS:
            return option.name in hears
        case Recorded.WHERE_GIVEN:
            return option.name in hears and getattr(options, option.name) != option.default
        case Recorded.NEVER:
            return False
        case _:
            assert_never(option.recorded)


def packages(mission: Mission, backend: str = "", exports: tuple[str, ...] = ()) -> tuple[tuple[str, str], ...]:
    """Extension packages that a mission and its plan use, by name and version."""
    predicates = (each.predicate for each in formulas_bottom_up(formulas(mission)) if isinstance(each, Holds))
    words = {
        Kind.PREDICATE: {each.word for each in predicates if isinstance(each, PlacePredicate)},
        Kind.DYNAMICS: {agent.dynamics.word for agent in mission.agents} - set(KINDS.built_in),
        Kind.EXPORT: set(exports) - set(FORMATS.built_in),
        Kind.BACKEND: {backend} - {"", *BACKENDS.built_in},
    }
    used = any(words.values())  # the metadata of packages is read for them alone
    found = [each for each in installed() if each.name in words.get(each.kind, ())] if used else []
    return tuple(sorted({(each.package, each.version) for each in found}))


def asked_for(exports: tuple[str, ...]) -> tuple[tuple[str, Option], ...]:
    """Command-line options that only select output files."""
    return (("export", ",".join(dict.fromkeys(exports))),) if exports else ()


def with_manifest(compiled: Compiled, options: Options) -> Compiled:
    """The compilation of a mission without a plan, with a manifest added if it has files.

    With a proof, the mission is included, so that the folder alone suffices for its check.
    """
    files, mission = dict(compiled.files), compiled.checked.mission
    if not files or mission is None:
        return compiled
    from missionc.output.folder.manifest import Provenance, without_plan  # loads the writers of plans

    if files == dict(compiled.near_miss_files):
        return replace(compiled, listing=((MANIFEST, without_plan(mission.name, NEAR_MISS, files).encode()),))
    origin = Provenance(inputs(compiled.checked), given(compiled.checked, options), packages=packages(mission))
    own = tuple((f"{MISSION}/{name}", content) for name, content in origin.inputs)
    text = without_plan(mission.name, PROOF, files | dict(own), origin)
    return replace(compiled, listing=(*own, (MANIFEST, text.encode())))
