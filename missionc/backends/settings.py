"""Settings of all backends by name: checked values of ``--set NAME=VALUE``, and the table for ``--emit``.

    in   names and values, as text
    out  values by full name, ``smt.roadmap.nodes``
    says MC415 MC416 MC417

The group may be omitted from a name that is unique in the backend: ``smt.nodes``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from missionc.backends.clot.run.presets import tuned_settings
from missionc.backends.clot.settings import ClotSettings
from missionc.backends.options import Options
from missionc.backends.setting import Pairs, Setting, settings_of
from missionc.backends.smt.settings import SmtSettings, smt_settings
from missionc.base.diagnostics.code import OTHER_BACKEND_SETTING, SETTING_OUT_OF_RANGE, UNKNOWN_BACKEND_SETTING
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.suggest import nearest
from missionc.ir import Mission
from missionc.ir.wording import all_listed

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

DEFAULTS: Mapping[str, DataclassInstance] = {"smt": SmtSettings(), "clot": ClotSettings()}
"""Default settings of each backend that has settings."""

USED = {"smt": ("smt",), "clot": ("clot",), "hybrid": ("smt", "clot")}
"""Names of the settings values that each backend reads."""


def given(value: Mapping[str, object] | DataclassInstance) -> dict[str, str]:
    """Names and values, as text, of a mapping or of the non-default settings of a settings value."""
    if isinstance(value, Mapping):
        return {name: str(each) for name, each in value.items()}
    backend = next(name for name, default in DEFAULTS.items() if isinstance(value, type(default)))
    return {f"{backend}.{each.name}": str(each.value) for each in settings_of(value) if each.value != each.default}


def with_settings(
    mission: Mission, texts: Mapping[str, str], engines: Sequence[str] | None
) -> tuple[Mission, list[Diagnostic]]:
    """Mission with these settings, and findings about invalid settings.

    Args:
        texts: values by setting name; if two names denote one setting, the last value applies.
        engines: backends that may plan the mission; None for any.
    """
    values, wrong = read_settings(texts, engines or tuple(USED))
    return replace(mission, solve=replace(mission.solve, settings=values)), wrong


def read_settings(texts: Mapping[str, str], engines: Sequence[str]) -> tuple[Pairs, list[Diagnostic]]:
    """Setting values by full name, in the order of the names, and findings about invalid settings."""
    known = {f"{name}.{each.name}": each for name, value in DEFAULTS.items() for each in settings_of(value)}
    values: dict[str, float] = {}
    wrong: list[Diagnostic] = []
    for name, text in texts.items():
        whole = _whole_name(name, known)
        if isinstance(whole, Diagnostic):
            wrong.append(whole)
        elif (number := known[whole].read(text)) is None:
            wrong.append(_out_of_range(whole, known[whole], text))
        elif not any(whole.partition(".")[0] in USED[engine] for engine in engines):
            wrong.append(_of_another(whole, engines))
        else:
            values[whole] = number
    return tuple(sorted(values.items())), wrong


def _whole_name(name: str, known: Iterable[str]) -> str | Diagnostic:
    called = {each: (each, f"{each.partition('.')[0]}.{each.rpartition('.')[2]}") for each in known}
    found = [name] if name in called else [each for each, names in called.items() if name in names]
    if len(found) == 1:
        return found[0]
    own = [names for names in called.values() if names[0].startswith(f"{name.partition('.')[0]}.")]
    near = nearest(name, chain.from_iterable(own or called.values()))
    meant = " or ".join(f"`{each}`" for each in (found or (near,)) if isinstance(each, str))
    says = f"ambiguous setting `{name}`" if found else f"unknown setting `{name}`"
    way_out = f"write {meant}" if meant else "list the settings with `--set help`"
    return Diagnostic(UNKNOWN_BACKEND_SETTING, says, None, help=way_out)


def settings_table(mission: Mission, engines: Sequence[str], options: Options) -> str:
    """Settings that apply to a mission's planning as TOML, with unit, meaning, range and default as comments."""
    values: dict[str, DataclassInstance] = {
        "smt": smt_settings(mission),
        "clot": tuned_settings(mission, options),
    }
    used = dict.fromkeys(name for engine in engines for name in USED[engine])
    return "\n".join(_table(name, values[name]) for name in used)


def default_table() -> str:
    """All settings of all backends with their defaults, in the format of ``settings_table``."""
    return "\n".join(_table(name, value) for name, value in DEFAULTS.items())


def _table(backend: str, value: DataclassInstance) -> str:
    lines: list[str] = []
    group = ""
    for each in settings_of(value):
        if each.group != group:
            lines += [f"\n[{backend}.{each.group}]" if lines else f"[{backend}.{each.group}]"]
            group = each.group
        default = "" if each.value == each.default else f"; default {written(each.default)}"
        lines.append(f"{each.name.rpartition('.')[2]} = {written(each.value)}  # {each.says}; {each.range}{default}")
    return "\n".join(lines) + "\n"


def written(value: float) -> str:
    """Value as text for TOML and ``--set``."""
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _out_of_range(name: str, setting: Setting, text: object) -> Diagnostic:
    return Diagnostic(
        SETTING_OUT_OF_RANGE,
        f"`{name}` must be {setting.range}, not `{text}`",
        None,
        notes=(f"the default is {written(setting.default)}",),
        help=f"write, for example, `--set {name}={written(setting.default)}`",
    )


def _of_another(name: str, engines: Sequence[str]) -> Diagnostic:
    backend = name.partition(".")[0]
    engine = all_listed([f"`{each}`" for each in engines])
    plan = "plans" if len(engines) == 1 else "plan"
    return Diagnostic(
        OTHER_BACKEND_SETTING,
        f"`{name}` is a setting of `{backend}`, but {engine} {plan} this mission",
        None,
        help=f"plan with `--backend {backend}`",
    )
