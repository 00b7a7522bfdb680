"""Libraries that read files of other programs: loaded if there is such a file, and silent on standard error."""

from __future__ import annotations

import logging
from importlib import import_module
from typing import Any

from missionc.base.source import Source, Span
from missionc.diagnostics.code import EXTRA_MISSING
from missionc.maps.feature import MapError


def library(module: str, package: str, source: Source, asked: Span) -> Any:
    """A module of the extra ``maps``.

    Raises:
        MapError: it is not installed.
    """
    log = logging.getLogger(module.partition(".")[0])
    if not log.handlers:
        log.addHandler(logging.NullHandler())  # without a handler a warning of it goes to standard error
    try:
        return import_module(module)
    except ImportError:
        message = f"`{source.name}` needs the package {package}, which is not installed"
        raise MapError(EXTRA_MISSING, message, asked, "install it with `pip install 'missionc[maps]'`") from None
