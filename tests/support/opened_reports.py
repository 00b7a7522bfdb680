"""Reports in a browser: the contents of the page, with its messages and requests."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Opened:
    page: Any
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def text(self, selector: str) -> str:
        return str(self.page.inner_text(selector))

    def settle(self) -> None:
        """Wait for two frames, so that the page is drawn."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def picture(self) -> str:
        """Current picture of the map."""
        self.settle()
        return str(self.page.evaluate("() => document.getElementById('map').toDataURL()"))

    def unfold(self, *lanes: int) -> None:
        """Unfold the rows of these lanes."""
        for lane in lanes:
            self.page.click(f".lane[data-lane='{lane}'] .fold")
        self.settle()

    def now(self) -> float:
        self.settle()
        return float(self.page.evaluate("() => document.getElementById('now').value"))


def opened(browser: Any, file: Path, content: bytes, **options: Any) -> Opened:
    file.write_bytes(content)
    page = browser.new_page(viewport={"width": 1280, "height": 900}, **options)
    found = Opened(page)
    page.on("console", lambda message: found.said.append(message.text))
    page.on("pageerror", lambda error: found.said.append(str(error)))
    page.on("request", lambda request: found.asked.append(request.url))
    page.goto(file.as_uri())
    found.settle()
    return found
