"""Benchmark of the language server's latency in missions of 30, 120 and 500 lines.

    python bench/lsp_latency.py [KEYS]

Types into the middle of the mission, a key every 200 ms, and waits for the diagnostics of each version; a second time,
it also requests completion, symbols, hints, highlights and fixes after every key, as an editor does. Every other key
changes a number, in turn of a requirement, a named formula, a region and an obstacle, so that the mission is valid and
is checked completely. The other keys write a requirement, which has a syntax error until its last letter. Prints
percentiles in milliseconds, from the sent change to the received diagnostics, including protocol and processes; those
of valid missions separately; and the server's mean processor time for one of those, which other programs affect less.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from itertools import pairwise, product
from pathlib import Path
from queue import Queue

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench"))

from check_time import mission  # noqa: E402

URI = "file:///somewhere/typed.mission"
SIZES = (30, 120, 500)
"""Numbers of lines of the missions."""
TYPED = "require typed: every drone: always[0, 7 s] (safe or not survivor)"
CHANGED = (
    f"obstacle typed_rock = disc at (9.5, 0.5) radius 0.2\nregion typed_spot = disc at (5, 9.5) radius 0.3\n"
    f"let typed_near = distance(typed_spot) <= 5 m\n{TYPED.replace('safe', 'typed_near')}"
)
NUMBERS = ("7 s", "5 m", "0.3", "0.2")
"""Replacement numbers for CHANGED, in turn."""
BETWEEN = 0.2
"""Seconds between keys of a quick typist."""


class Editor:
    """Minimal editor for the benchmark."""

    def __init__(self, command: list[str]) -> None:
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        self.server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
        self.said: Queue[dict[str, object]] = Queue()
        threading.Thread(target=self._listen, daemon=True).start()
        self.send({"id": 1, "method": "initialize", "params": {"processId": None, "rootUri": None, "capabilities": {}}})
        self.read(lambda message: message.get("id") == 1)
        self.send({"method": "initialized", "params": {}})

    def send(self, message: dict[str, object]) -> None:
        assert self.server.stdin is not None
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.server.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.server.stdin.flush()

    def _listen(self) -> None:
        """Read continuously, as editors do, since a blocked server waits."""
        stream = self.server.stdout
        assert stream is not None
        length = 0
        while line := stream.readline():
            name, _, value = line.strip().partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
            elif not name:
                self.said.put(json.loads(stream.read(length)))

    def read(self, wanted) -> dict[str, object]:
        while not wanted(message := self.said.get()):
            pass
        return message

    def shows(self, version: int) -> None:
        """Wait for the diagnostics of a version."""
        self.read(lambda message: message.get("params", {}).get("version") == version)

    def processor(self) -> float:
        """Processor seconds of the server."""
        fields = Path(f"/proc/{self.server.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def close(self) -> None:
        self.send({"id": 2, "method": "shutdown"})
        self.read(lambda message: message.get("id") == 2)
        self.send({"method": "exit"})
        self.server.wait(10)


def typed(size: int, count: int) -> list[str]:
    """Text after each key: edits and new requirements in the middle, alternating."""
    lines = mission(size).splitlines()
    head, tail = "\n".join(lines[: size // 2]), "\n".join(lines[size // 2 :])
    written = [TYPED[: 1 + key // 2 % len(TYPED)] if key % 2 else whole(key) for key in range(count)]
    return [f"{head}\n{words}\n{tail}\n" for words in written]


def whole(key: int) -> str:
    number = NUMBERS[key // 2 % len(NUMBERS)]
    value, unit = number.partition(" ")[::2]
    factor = 1 + key // 8 % 10 / 10
    return CHANGED.replace(number, f"{float(value) * factor:.0f} {unit}" if unit else f"{float(value) * factor:g}")


def ask(editor: Editor, size: int, version: int) -> None:
    """Send the requests of VS Code after a change of the text."""
    document = {"textDocument": {"uri": URI}}
    everything = {"start": {"line": 0, "character": 0}, "end": {"line": size + 5, "character": 0}}
    here = {"line": size // 2, "character": 12}
    for number, (method, more) in enumerate(
        {
            "completion": {"position": here},
            "documentSymbol": {},
            "inlayHint": {"range": everything},
            "documentHighlight": {"position": here},
            "codeAction": {"range": everything, "context": {"diagnostics": []}},
        }.items()
    ):
        asked = {"id": 10 * version + number, "method": f"textDocument/{method}", "params": {**document, **more}}
        editor.send(asked)


def measure(size: int, keys: int, busy: bool) -> tuple[list[float], list[float]]:
    """Seconds from each change to its diagnostics, and processor seconds of the server until the next one."""
    editor = Editor([sys.executable, "-m", "missionc", "lsp"])
    item = {"uri": URI, "languageId": "mission", "version": 0, "text": mission(size)}
    editor.send({"method": "textDocument/didOpen", "params": {"textDocument": item}})
    editor.shows(0)
    took: list[float] = []
    used = [editor.processor()]
    for version, text in enumerate(typed(size, keys), start=1):
        begin = time.perf_counter()
        document = {"uri": URI, "version": version}
        params = {"textDocument": document, "contentChanges": [{"text": text}]}
        editor.send({"method": "textDocument/didChange", "params": params})
        if busy:
            ask(editor, size, version)
        editor.shows(version)
        took.append(time.perf_counter() - begin)
        time.sleep(max(0.0, BETWEEN - took[-1]))
        used.append(editor.processor())
    editor.close()
    return took, [after - before for before, after in pairwise(used)]


def main(keys: int) -> None:
    heads = f"{'median':>7} {'95 %':>7} {'worst':>7}  whole: {'median':>7} {'95 %':>7}"
    print(f"{'mission':<24} {heads}   processor   milliseconds, {keys} keys")
    for size, busy in product(SIZES, (False, True)):
        name = f"{size} lines{', asked besides' if busy else ''}"
        took, used = measure(size, keys, busy)
        every = " ".join(f"{1000 * share(took, part):7.0f}" for part in (0.5, 0.95, 1))
        of_whole = " ".join(f"{1000 * share(took[::2], part):7.0f}" for part in (0.5, 0.95))
        mean = 1000 * sum(used[::2]) / len(used[::2])
        print(f"{name:<24} {every}         {of_whole}   {mean:9.0f}")


def share(times: list[float], part: float) -> float:
    """Quantile ``part`` of the times."""
    return sorted(times)[min(int(part * len(times)), len(times) - 1)]


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 130)
