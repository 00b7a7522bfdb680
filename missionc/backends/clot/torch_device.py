"""Devices and threads of torch: where the batches of Algorithm 1 are computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache

import torch
from torch import Tensor

from missionc.backends.options import Options
from missionc.base.diagnostics.code import NO_DEVICE
from missionc.base.diagnostics.model import Diagnostic


def available(name: str) -> bool:
    """Whether torch has a device of that name (``cpu``, ``cuda``) here."""
    return name == "cpu" or (name == "cuda" and torch.cuda.is_available())


def device_missing(options: Options) -> Diagnostic | None:
    """What to say where the options ask for a device that is not there."""
    if available(options.device):
        return None
    return Diagnostic(
        NO_DEVICE,
        f"torch has no device `{options.device}` here",
        None,
        notes=("the GPU, its driver or the build of torch for it is missing",),
        help="delete `--device` to use the CPU",
    )


@contextmanager
def one_thread() -> Iterator[None]:
    """Within, torch uses one thread; after it, as many as before."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def enough_memory() -> Iterator[None]:
    """Within, what torch says where memory runs out is said as Python says it.

    Raises:
        MemoryError: torch was refused memory, on whichever device.
    """
    try:
        yield
    except RuntimeError as error:
        if isinstance(error, torch.OutOfMemoryError) or "allocate memory" in str(error):
            raise MemoryError from error
        raise


def seeded(seed: int, device: torch.device) -> torch.Generator:
    """A generator on the device. Any whole number is a seed."""
    return torch.Generator(device).manual_seed(seed % 2**63)


def places(numbers: Sequence[int], device: torch.device) -> Tensor:
    """Numbers to index with, (numbers,), on the device: a list would be copied there, and waited for, at every use."""
    return _places(tuple(numbers), device)


@lru_cache(maxsize=4096)
def _places(numbers: tuple[int, ...], device: torch.device) -> Tensor:
    return torch.tensor(numbers, dtype=torch.int64, device=device)
