"""Texts of the compiler's intermediate representations, for ``--emit``."""

from __future__ import annotations

from missionc.backends.roadmap_graph import show_roadmaps
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.cli.summary import tried_lines
from missionc.compiler.front_end import Checked
from missionc.compiler.graphs import first_roadmaps, planned_on
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.frontend.checks.check_horizons import show_horizons
from missionc.frontend.resolve.show_ir import show_ir
from missionc.frontend.syntax.show_tree import show as show_program
from missionc.ir.kernel.show import show as show_kernel
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.unroll_past import looking_ahead


def of_checked(checked: Checked, stages: tuple[str, ...], request: PlanRequest) -> list[tuple[str, str]]:
    """Name and text of each stage before planning that the mission reached.

    Args:
        checked: result of the front end.
        stages: names of the requested stages.
        request: request for a plan.
    """
    texts: dict[str, str] = {}
    if checked.program:
        texts["ast"] = show_program(checked.program)
    if checked.mission and checked.kernel:
        texts["ir"] = show_ir(checked.mission)
        texts["horizons"] = show_horizons(checked.mission)
        texts["kernel"] = show_kernel(checked.kernel, checked.mission)
        if "cost-graph" in stages:
            from missionc.backends.clot.cost_graph.cost_graph import (
                build,  # rarely used, and slow to load
            )
            from missionc.backends.clot.cost_graph.show_cost_graph import show_cost_graph

            ahead = looking_ahead(checked.mission, checked.kernel, Limits().formula_nodes)
            if not isinstance(ahead, TooLarge):
                texts["cost-graph"] = show_cost_graph(build(ahead), checked.mission)
        if "roadmap" in stages:
            built = first_roadmaps(checked, request.budget.seed, request.options.preset)
            texts["roadmap"] = f"{built.message}\n" if isinstance(built, Diagnostic) else show_roadmaps(built)
    if checked.choice and checked.mission and checked.ok and "settings" in stages:
        from missionc.backends.settings import settings_table

        texts["settings"] = settings_table(checked.mission, checked.choice.engines, request.options)
    if checked.choice:
        texts["backend"] = checked.choice.explanation + "\n"
    if checked.choice and checked.ok and "strategy" in stages:
        from missionc.compiler.strategy import show_strategy

        texts["strategy"] = show_strategy(checked, request)
    return [(stage, texts[stage]) for stage in stages if stage in texts]


def of_compiled(compiled: Compiled, stages: tuple[str, ...], request: PlanRequest) -> list[tuple[str, str]]:
    """Name and text of each completed stage; the roadmap is that of the plan, if there is one.

    Args:
        compiled: compilation.
        stages: names of the requested stages.
        request: request for a plan.
    """
    outcome, planned = compiled.outcome, planned_on(compiled)
    texts = dict(
        of_checked(compiled.checked, tuple(each for each in stages if each != "roadmap" or not planned), request)
    )
    if planned:
        texts["roadmap"] = show_roadmaps(planned)
    if isinstance(outcome, Verified):
        texts |= {"plan": dict(outcome.files)["plan.json"].decode("utf-8")}
    if not isinstance(outcome, InvalidMission):
        if "backend" in texts:
            texts["backend"] += "".join(f"{line}\n" for line in tried_lines(outcome.report))
        texts |= dict(outcome.report.texts)
    return [(stage, texts[stage]) for stage in stages if stage in texts]
