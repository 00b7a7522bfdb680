"""HTML of the report page from its parts: one text without external references.

Text by the author is JSON in a block that browsers do not run, with all HTML characters escaped. The content security
policy allows only the page's own script, and no loading at all.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from missionc.base.palette import DARK, LIGHT, MARKS

POLICY = "default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""Content security policy of the page: it runs only its own script, and loads nothing."""

ASSETS = Path(__file__).resolve().parent / "assets"
SCRIPTS = (
    "unpack.js",
    "colours.js",
    "model.js",
    "shapes.js",
    "camera.js",
    "labels.js",
    "world_view.js",
    "motion_view.js",
    "phases.js",
    "map_view.js",
    "svg_canvas.js",
    "gestures.js",
    "scene.js",
    "tracks.js",
    "charts.js",
    "timeline.js",
    "words.js",
    "margins.js",
    "stages.js",
    "address.js",
    "plans.js",
    "suggestions.js",
    "loop_flights.js",
    "player.js",
    "export.js",
    "layout.js",
    "main.js",
)
"""Scripts of the page in order; each uses the names of the scripts before it."""

ESCAPED = {ord(letter): f"\\u{ord(letter):04x}" for letter in "<>&'\u2028\u2029"}


def page(title: str, data: dict[str, Any]) -> str:
    """HTML text of the report page."""
    script = scripts(SCRIPTS)
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    parts = {
        "POLICY": POLICY.format(digest),
        "TITLE": html.escape(title),
        "STYLE": asset("style.css"),
        "DATA": embedded(data),
        "SCRIPT": script,
    }
    pieces = asset("page.html").split("%%")
    return "".join(parts[piece] if number % 2 else piece for number, piece in enumerate(pieces))


def scripts(names: Sequence[str]) -> str:
    """Concatenated scripts, after the palette that they use."""
    palette = embedded({"light": LIGHT, "dark": DARK, "marks": MARKS})
    return "\n".join([f"const PALETTE = {palette};", *map(asset, names)])


def embedded(data: object) -> str:
    """JSON text of the data in which nothing can end the script block."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"), sort_keys=True)
    return text.translate(ESCAPED)


def asset(name: str) -> str:
    """Text of a file that is a part of the page."""
    return (ASSETS / name).read_text(encoding="utf-8")
