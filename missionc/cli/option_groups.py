"""Option groups: the sections into which the help of a command with many options is divided."""

from __future__ import annotations

import click

COMMON = "Common options"
FURTHER = {
    "Search options": (
        "--solver --require-solver --preset --samples --device --margin --stretch --alternatives "
        " --certify --explain-limit"
    ),
    "Disturbances": (
        "--wind --mass-error --start-error --clock-error --noise --latency --packet-loss --missed-start --battery-sag "
        "--weak-motor --downwash --lose"
    ),
    "Live monitoring": "--live --udp --mcap --topic --wait --skew --leap --plan --page --pace",
    "Output options": (
        "--export --plot --plot-kind --at --plot-width --trace --keep --compare --format --quiet --verbose --timings "
        "--emit"
    ),
    "Advanced options": (
        "--set --limit --memory-limit --processes --checkpoint --resume --jobs --cluster --journal --engine"
    ),
}
"""Flags of each help section after the common options."""

GROUPS = {flag: group for group, flags in FURTHER.items() for flag in flags.split()}


class GroupedCommand(click.Command):
    """Command whose help lists its options in sections."""

    def format_options(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a help section for each group that has options."""
        rows: dict[str, list[tuple[str, str]]] = {group: [] for group in (COMMON, *FURTHER)}
        for parameter in self.get_params(context):
            record = parameter.get_help_record(context)
            if record is not None and isinstance(parameter, click.Option):
                group = next((GROUPS[flag] for flag in parameter.opts if flag in GROUPS), COMMON)
                rows[group].append(record)
        for group, records in rows.items():
            if records:
                with formatter.section(group):
                    formatter.write_dl(records)
