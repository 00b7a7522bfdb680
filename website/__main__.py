"""``python -m website [--play] [FOLDER]``: the documentation as a site, ``build/site`` by default.

With ``--play`` the gallery's missions are planned, which takes minutes, and its pictures lead to their reports. Nothing
is fetched, now or when the site is read. The exit status is 1 where the generator warns, or a link leads nowhere.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import entry_points
from pathlib import Path

from website.links import check
from website.live import HOME
from website.pages import ROOT, missions
from website.stage import stage


def main(words: list[str]) -> int:
    if "mission" not in entry_points(group="pygments.lexers").names:
        print("missions would have no colour; install this checkout: pip install -e '.[docs]'", file=sys.stderr)
        return 1
    folders = [word for word in words if word != "--play"]
    site = Path(folders[0]) if folders else ROOT / "build" / "site"
    gallery = tuple(name for name in missions() if name.startswith("gallery/")) if "--play" in words else ()
    site.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="site-", dir=site.parent) as folder:
        try:
            settings = stage(Path(folder), HOME + gallery)
        except ValueError as nowhere:
            print(nowhere, file=sys.stderr)
            return 1
        # Its own process: the generator runs in the working directory and prints to standard output.
        built = subprocess.run(  # noqa: S603
            [sys.executable, "-m", "zensical", "build", "--strict", "--config-file", settings.name],
            cwd=settings.parent,
            capture_output=True,
            text=True,
            check=False,
        )
        said = built.stdout + built.stderr
        if built.returncode or "No issues found" not in said:
            print(said, file=sys.stderr)
            return 1
        # For servers only, and only at the root of one: its links are absolute.
        (settings.parent / "site" / "404.html").unlink()
        shutil.rmtree(site, ignore_errors=True)
        (settings.parent / "site").rename(site)
    found = check(site)
    for problem in (*found.broken, *found.loaded):
        print(problem, file=sys.stderr)
    pages = len(list(site.rglob("*.html")))
    print(f"{site / 'index.html'}: {pages} pages, {found.count} links within, {len(found.outward)} outward")
    for link in sorted(found.outward):
        print(f"  not fetched: {link}")
    return 1 if found.broken or found.loaded else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
