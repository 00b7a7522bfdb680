"""Pages in one folder for the generator. Their content is unchanged; two formal things change.

Fences: what follows the language in ```` ```mission watch.mission wrong ```` is for our tests. A file's name becomes
the title of the block, the rest is dropped.

Links: what leads out of ``docs/`` leads to the page that stands for it on the site. A picture that leads to a mission
leads to its report, where the site plays one.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path, PurePosixPath

from website.generated import made
from website.live import HOME, place, write_reports
from website.pages import MADE, ROOT, Page, Section, flat, navigation, places

_FENCE = re.compile(r"^```(?P<language>\w+)(?P<words>[^\n`]*)$", re.MULTILINE)
_BLOCK = re.compile(r"^```.*?^```[ \t]*$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(?<=\]\()(?!https?:|#)(?P<target>[^)#\s]+)(?=[)#])")


def stage(folder: Path, played: tuple[str, ...] = HOME) -> Path:
    """Write pages, pictures, reports and the generator's settings to an empty folder.

    Args:
        folder: folder whose contents are removed.
        played: missions whose reports the site plays.

    Returns:
        the settings.

    Raises:
        ValueError: a link leads to a file that is not on the site, or a mission to be played has no plan.
    """
    shutil.rmtree(folder, ignore_errors=True)
    docs = folder / "docs"
    shutil.copytree(ROOT / "docs" / "images", docs / "images")
    shutil.copytree(ROOT / "website" / "assets", docs / "assets")
    write_reports(played, docs)
    parts = navigation()
    for page in flat(parts):
        if page.source.startswith(MADE):
            text = made(page.path)
        else:
            text = _linked(page, (ROOT / page.source).read_text(encoding="utf-8"), played)
        path = docs / page.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(_FENCE.sub(_titled, text), encoding="utf-8")
    settings = (ROOT / "website" / "zensical.toml").read_text(encoding="utf-8")
    file = folder / "zensical.toml"
    settings = settings.replace('"ROOT', f'"{ROOT.as_posix()}').replace(
        "[project]", f"[project]\nnav = {_toml(parts)}", 1
    )
    file.write_text(settings, encoding="utf-8")
    return file


def _titled(fence: re.Match[str]) -> str:
    name = re.search(r"\b\w+\.\w+\b", fence["words"])
    if "title=" in fence["words"]:
        return fence[0]
    if not name:
        return f"```{fence['language']}"
    more = "more of " if " fragment " in fence["words"] else ""
    return f'```{fence["language"]} title="{more}{name[0]}"'


def _linked(page: Page, text: str, played: tuple[str, ...]) -> str:
    known = places()
    reports = {f"missions/{name}.mission": place(name) for name in played}
    home = (ROOT / page.source).parent

    def relinked(link: re.Match[str]) -> str:
        target = Path(os.path.normpath(home / link["target"])).relative_to(ROOT).as_posix()
        of_picture = link.string[: link.start()].endswith(")](")
        if of_picture and target in reports:
            leads_to = reports[target]
        elif target.startswith("docs/images/"):
            leads_to = target.removeprefix("docs/")
        elif target in known:
            leads_to = known[target]
        else:
            raise ValueError(f"{page.source}: `{link['target']}` is not on the site")
        return os.path.relpath(leads_to, PurePosixPath(page.path).parent)

    # Only prose: a fence may show Markdown.
    said, at = [], 0
    for block in _BLOCK.finditer(text):
        said += [_LINK.sub(relinked, text[at : block.start()]), block[0]]
        at = block.end()
    return "".join([*said, _LINK.sub(relinked, text[at:])])


def _toml(parts: tuple[Page | Section, ...]) -> str:
    """Navigation in the format of the generator's settings."""
    rows = []
    for part in parts:
        value = json.dumps(part.path) if isinstance(part, Page) else _toml(part.parts)
        rows.append(f"{{ {json.dumps(part.title, ensure_ascii=False)} = {value} }}")
    return f"[{', '.join(rows)}]"
