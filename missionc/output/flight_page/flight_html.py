"""The page of a flight that goes on, as HTML: the report's map, its lanes and its look, in other company."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

from missionc.output.report.render_page import SCRIPTS, asset, scripts

POLICY = (
    "default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""What a browser may do with the page: run the one script, and ask its own server."""

ASSETS = Path(__file__).resolve().parent / "assets"
OF_ONE_PLAN = frozenset(
    {"svg_canvas.js", "charts.js", "words.js", "margins.js", "plans.js", "suggestions.js", "export.js", "main.js"}
)
"""Scripts of the report that are about a plan, and of no use to a flight that goes on."""
OF_REPORT = tuple(name for name in SCRIPTS if name not in OF_ONE_PLAN)
OWN = ("flight_model.js", "flight_lanes.js", "flight_status.js", "flight_main.js")
"""In the order in which they are put together, after those of the report."""


def flight_html() -> tuple[bytes, str]:
    """The page, whatever the mission, and the policy that it is to be sent with."""
    script = "\n".join([scripts(OF_REPORT), *map(_own, OWN)])
    parts = {"STYLE": asset("style.css") + _own("flight.css"), "SCRIPT": script}
    pieces = _own("flight.html").split("%%")
    page = "".join(parts[piece] if number % 2 else piece for number, piece in enumerate(pieces))
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    return page.encode("utf-8"), POLICY.format(digest)


def _own(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")
