"""Devices and threads of torch for the batches of Algorithm 1."""

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
    """Return whether torch has a device of that name (``cpu``, ``cuda``) here."""
    return name == "cpu" or (name == "cuda" and torch.cuda.is_available())


def device_missing(options: Options) -> Diagnostic | None:
    """Diagnostic if the selected device is missing."""
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
    """Use one torch thread within the context, and restore the number afterwards."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def enough_memory() -> Iterator[None]:
    """Convert torch's out-of-memory errors to Python's within the context.

    Raises:
        MemoryError: torch could not allocate memory on some device.
    """
    try:
        yield
    except RuntimeError as error:
        if isinstance(error, torch.OutOfMemoryError) or "allocate memory" in str(error):
            raise MemoryError from error
        raise


def seeded(seed: int, device: torch.device) -> torch.Generator:
    """Random generator on the device. Any integer is a seed."""
    return torch.Generator(device).manual_seed(seed % 2**63)


def places(numbers: Sequence[int], device: torch.device) -> Tensor:
    """Index tensor, (numbers,), on the device; a list would be copied there, with a wait, at every use."""
    return _places(tuple(numbers), device)


@lru_cache(maxsize=4096)
def _places(numbers: tuple[int, ...], device: torch.device) -> Tensor:
    return torch.tensor(numbers, dtype=torch.int64, device=device)
