"""Flags for work in several processes or on a cluster, and the workers that they select."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING

import click

from missionc.cli.options import Count

if TYPE_CHECKING:
    from missionc.base.diagnostics.model import Diagnostic
    from missionc.tools.sweep.run_sweep import Pool

MOST_JOBS = 1024

jobs = click.option(
    "--jobs", type=Count(1, MOST_JOBS), metavar="J", help="Run J processes in parallel on this machine."
)

cluster = click.option(
    "--cluster", metavar="ADDRESS", help="Run on a Dask cluster: tcp://HOST:PORT, a scheduler file, or local:WORKERS."
)


def understood(count: int | None, address: str | None) -> None:
    """Check that ``--jobs`` and ``--cluster`` are compatible and the address is valid.

    Args:
        count: value of ``--jobs``, or None.
        address: value of ``--cluster``, or None.

    Raises:
        click.UsageError: the flags are incompatible, or the address is invalid.
    """
    from missionc.tools.sweep import run_sweep

    if address is not None and count is not None:
        raise click.UsageError("`--jobs` and `--cluster` exclude each other; remove one of them")
    if address is not None and not run_sweep.understood(address):
        raise click.UsageError(
            f"`{address}` is not the address of a cluster; write tcp://HOST:PORT, a scheduler file, or local:8"
        )


def opened_cluster(count: int | None, address: str | None) -> AbstractContextManager[Pool | Diagnostic]:
    """Context manager with the pool of workers, or with a finding; by default one worker per processor.

    Args:
        count: value of ``--jobs``, or None.
        address: value of ``--cluster``, or None.

    Raises:
        click.UsageError: the flags are incompatible, or the address is invalid.
    """
    from missionc.tools.sweep import run_sweep

    understood(count, address)
    if address is None:
        return run_sweep.on_this_machine(count or run_sweep.processors())
    absent = run_sweep.missing()
    return nullcontext(absent) if absent else run_sweep.on_cluster(address)
