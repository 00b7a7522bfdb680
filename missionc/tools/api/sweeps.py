"""Public function for sweeps: compiles one mission for many parameter values and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from missionc.backends.options import DESCRIBED
from missionc.base.continuous_time import ContinuousTime
from missionc.base.limits import Limits
from missionc.base.memory import DEFAULT_LIMIT
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler.described import PLANNER_OPTIONS, described, planner_options
from missionc.frontend.builder.origins import MissionLike, source_of
from missionc.tools.api.disturbances import DISTURBANCES, amounts_of
from missionc.tools.sweep.carry_out_sweep import SweepRequest, SweepResult, carry_out_sweep
from missionc.tools.sweep.run_grid import Grid, read_varied
from missionc.tools.sweep.run_request import TIME_LIMIT, Flights, Settings
from missionc.tools.sweep.run_sweep import on_this_machine, processors


@described((*PLANNER_OPTIONS, *DISTURBANCES))
def sweep(
    mission: MissionLike,
    vary: Mapping[str, str | Iterable[object]],
    *,
    seeds: int = 1,
    output: str | Path | None = None,
    keep: bool = False,
    jobs: int | None = None,
    compare: str | Path | None = None,
    trials: int = 0,
    overrides: Mapping[str, str] | None = None,
    backend: str = "auto",
    vehicle: str = "",
    limits: Limits | None = None,
    time_limit: float = TIME_LIMIT,
    memory_limit: int = DEFAULT_LIMIT,
    continuous_time: ContinuousTime = ContinuousTime.WANTED,
    **given: Any,
) -> SweepResult:
    """Compile a mission for all combinations of parameter values and all seeds, each run in its own process.

    Args:
        mission: path of a file, ``Source``, or ``Mission``.
        vary: values by parameter: ``{"N": [3, 5, 8], "R": "1..2/0.25"}``.
        seeds: number of seeds, from 0 on.
        output: folder of the results; ``build/NAME-sweep`` by default. An interrupted sweep there is continued.
        keep: if true, write the folder of each plan.
        jobs: number of parallel processes; by default the number of processors.
        compare: folder of an older sweep to compare with.
        trials: number of simulated flights of each plan.
        overrides: values of the other parameters, as in ``compile``.
        backend, vehicle, limits, continuous_time: as in ``compile``.
        time_limit: as in ``compile``, for each run.
        memory_limit: as in ``compile``, for each run.

    Raises:
        TypeError: an option or disturbance is unknown.
        ValueError: a value cannot be varied, or an option has an invalid value.
    """
    source = source_of(mission)
    file = source if isinstance(source, Source) else Path(source)
    texts = [(name, each if isinstance(each, str) else ",".join(map(str, each))) for name, each in vary.items()]
    varied = read_varied(texts, list(overrides or {}))
    if isinstance(varied, list):
        raise ValueError(f"{varied[0].code.name}: {varied[0].message}; {varied[0].help}")
    options = planner_options("sweep", {name: value for name, value in given.items() if name in DESCRIBED}, None)
    amounts, lost = amounts_of("sweep", {name: value for name, value in given.items() if name not in DESCRIBED})
    settings = Settings(
        {},
        dict(overrides or {}),
        limits or Limits(),
        backend,
        vehicle,
        options,
        Seconds(time_limit),
        memory_limit,
        continuous_time,
        Flights(trials, amounts, lost) if trials else None,
        keep,
    )
    name = Path(file.name).stem
    return carry_out_sweep(
        SweepRequest(
            file,
            Grid(varied, seeds),
            settings,
            Path(output) if output else Path("build") / f"{name}-sweep",
            lambda: on_this_machine(jobs or processors()),
            Path(compare) if compare else None,
        )
    )
