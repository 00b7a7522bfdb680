"""The moving picture in the README: a mission's report played in a browser.

python docs/moving_picture.py plans missions/wildfire.mission and writes docs/images/report.gif
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from missionc.compiler import driver

ROOT = Path(__file__).resolve().parent.parent
MISSION = ROOT / "missions" / "wildfire.mission"
PICTURE = ROOT / "docs" / "images" / "report.gif"
FRAMES, MILLISECONDS, COLOURS = 40, 150, 64
WINDOW, WIDTH = (1200, 800), 720
"""Size of the page's window, and width of the picture, pixels."""


def frames(report: Path) -> list[Image.Image]:
    """Screenshots of the page at evenly spaced moments of the plan."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WINDOW[0], "height": WINDOW[1]}, color_scheme="light")
        page.goto(report.as_uri())
        last = float(page.locator("#now").get_attribute("max") or 0)
        shown = [frame(page, last * number / (FRAMES - 1)) for number in range(FRAMES)]
        browser.close()
    return shown


def frame(page: Page, seconds: float) -> Image.Image:
    """Screenshot of the page at a moment, in the picture's size."""
    page.evaluate("t => { location.hash = `t=${t}` }", round(seconds, 2))
    page.wait_for_timeout(120)
    image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    return image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)


def as_gif(shown: list[Image.Image]) -> bytes:
    """Endless GIF of the frames with a common palette."""
    strip = Image.new("RGB", (shown[0].width, sum(each.height for each in shown[:: len(shown) // 4])))
    for row, each in enumerate(shown[:: len(shown) // 4]):
        strip.paste(each, (0, row * each.height))
    palette = strip.quantize(COLOURS, Image.Quantize.MEDIANCUT)
    reduced = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in shown]
    buffer = io.BytesIO()
    reduced[0].save(
        buffer, "gif", save_all=True, append_images=reduced[1:], duration=MILLISECONDS, loop=0, optimize=True
    )
    return buffer.getvalue()


def main() -> int:
    report = dict(driver.compile(MISSION).files).get("report.html")
    if report is None:
        print(f"{MISSION.name}: no plan, so no picture was drawn", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        path.write_bytes(report)
        gif = as_gif(frames(path))
    PICTURE.write_bytes(gif)
    print(f"{PICTURE.relative_to(ROOT)}: {FRAMES} frames, {len(gif) / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
