"""Session of the studio: one open page, its mission text, its requests, and its language server.

    says MC002 MC004 MC702

Messages are those of JSON-RPC. The session answers methods that begin with ``studio/``. The language server of the
page, which knows the one open text, answers all others, and sends the map after each change.

Only ``studio/save`` writes the text of the page to a file. The page colours the compiler's own keywords.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from lsprotocol.converters import get_converter
from pygls.exceptions import JsonRpcException

from missionc import Diagnostic, Limits, Source
from missionc.backends.registry import BACKENDS
from missionc.base.diagnostics.code import OUTPUT_EXISTS, UNREADABLE
from missionc.base.diagnostics.defect import defect
from missionc.base.diagnostics.render import counts
from missionc.base.source import Span
from missionc.base.units import UNITS
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import read
from missionc.frontend.syntax.read_file import loader, too_large
from missionc.frontend.syntax.tokens import DECLARATIONS, STATES, WORDS
from missionc.output.folder.ownership import cannot_write
from missionc.output.folder.write_folder import write_file
from missionc.tools.language_server.open_text import LIMITS, OpenText, diagnostics
from missionc.tools.language_server.scene.scene import Json, scene
from missionc.tools.language_server.server import Server, made
from missionc.tools.studio.compilation import Compilation
from missionc.tools.studio.mission_lists import SHELVES, SUFFIX, Shelf, listed, taken
from missionc.tools.studio.planner import Ended
from missionc.tools.studio.text_file import TextFile, opened_text
from missionc.tools.studio.workplace import Workplace

if TYPE_CHECKING:
    from cattrs import Converter


COLOURS = {
    "a declaration": "definitionKeyword",
    "a shape": "typeName",
    "an operator": "operatorKeyword",
    "a quantifier": "operatorKeyword",
    "a formula": "bool",
    "the mission's last step": "bool",
    "a measure": "propertyName",
    "a preposition": "modifier",
    "a motion": "modifier",
    "a yaw mode": "modifier",
    "a kind of graph": "typeName",
    "a part of `time`": "propertyName",
    "a part of a team": "propertyName",
    "a part of a formation": "propertyName",
    "a part of `flight`": "propertyName",
    "a part of `from`": "propertyName",
    "a part of `prefer`": "propertyName",
    "a part of `tolerate`": "propertyName",
}
"""CodeMirror's tag for each kind of word, by its description in the language's table of words."""


def session_words() -> Json:
    """Data for colouring: ``kinds`` by word and short form, ``free`` words that may be names, and declaring words."""
    spelt = [(spelling, word) for word in WORDS for spelling in (word.text, word.letter) if spelling.isalpha()]
    return {
        "kinds": {spelling: COLOURS[word.says] for spelling, word in spelt},
        "free": [word.text for word in WORDS if not word.reserved],
        "declaring": sorted(DECLARATIONS),
        "units": list(UNITS),
        "states": list(STATES),
    }


LONGEST = 200
"""Maximum size of a file name, bytes."""
ANOTHER_NAME = "another name, in this folder"


@dataclass(slots=True)
class OpenMission:
    """Text of a page.

    Args:
        home: the only folder that is read and written.
        file: text and its path.
        limits: maximum sizes of a mission.
    """

    home: Path
    file: TextFile
    limits: Limits

    @property
    def uri(self) -> str:
        """URI of the text in the language server."""
        return self.file.path.as_uri()

    def described(self) -> Json:
        """Text and its state for the page, as JSON."""
        return {
            "uri": self.uri,
            "name": self.file.path.name,
            "text": self.file.text,
            "saved": self.file.saved,
            "named": self.file.named,
            "folder": str(self.home),
        }

    def open(self, shelf: Shelf, name: str) -> Json | Diagnostic:
        """Open another mission instead of this one; return its data or the error.

        Args:
            shelf: list of missions.
            name: name on the shelf.
        """
        file = taken(shelf, name, self.home, self.limits)
        if isinstance(file, Diagnostic):
            return file
        self.file = file
        return self.described()

    def reload(self) -> Json | Diagnostic:
        """Load the text from its file again; return its data or the error."""
        file = opened_text(self.file.path, self.limits)
        if isinstance(file, Diagnostic):
            return file
        self.file = file
        return self.described()

    def save(self, text: str, name: str, replace: bool) -> Json | Diagnostic:
        """Save the text under its own name or another one in the folder.

        Args:
            text: current text.
            name: name of the file; empty for its own.
            replace: whether to replace an existing or changed file.

        Returns:
            The data of the saved text, or an error. With ``problem``, nothing is saved, and the user is asked about a
            missing name (``unnamed``), an existing file (``exists``), or a file that another program has changed
            (``changed``). ``beside`` are the included files of a text from the gallery that were saved as well.
        """
        size = len(text.encode("utf-8"))
        if size > self.limits.file_bytes:
            return too_large(UNREADABLE, self.file.path.name, size, self.limits.file_bytes)
        if not name and not self.file.named:
            return {"problem": "unnamed"}
        path = self.file.path if not name else self.home / (name if name.endswith(SUFFIX) else f"{name}{SUFFIX}")
        if name and (wrong := refused_name(self.home, path)):
            return wrong
        if path == self.file.path and self.file.named:
            if not replace and self.file.changed(self.limits):
                return {"problem": "changed"}
        elif not replace and os.path.lexists(path):
            return {"problem": "exists"}
        beside = {} if self.file.path.parent == self.home else self._included(text)
        saved = self.file.save(path, text)
        if isinstance(saved, Diagnostic):
            return saved
        self.file = saved
        missing = {name: content for name, content in beside.items() if not os.path.lexists(self.home / name)}
        for name, content in missing.items():
            wrong = write_file(self.home / name, content)
            if wrong:
                return wrong
        return {"problem": "", "beside": list(missing), **self.described()}

    def _included(self, text: str) -> dict[str, bytes]:
        """Contents by relative path of the files that a text from the gallery includes, which are saved with it."""
        path = self.file.path
        find = loader(path, str(path), self.limits)
        found: dict[str, bytes] = {}

        def load(written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic:
            included = find(written, span, data=data)
            if isinstance(included, Source):
                found[os.path.relpath(included.name, path.parent)] = included.content
            return included

        read(Source(str(path), text), self.limits, load)
        return found


def refused_name(home: Path, path: Path) -> Diagnostic | None:
    """Error for a path to which a text must not be saved, or None.

    Args:
        home: folder of the user's missions.
        path: path of the file.
    """
    name = path.name
    plain = path.parent == home and name.isprintable() and not name.startswith(".") and "\\" not in name
    if not plain or len(os.fsencode(name)) > LONGEST:
        return cannot_write(path, f"expected a file name without a folder, which ends in `{SUFFIX}`", ANOTHER_NAME)
    if Path(os.path.realpath(path)).parent != Path(os.path.realpath(home)):
        return cannot_write(path, "it is a link that leads out of the folder", ANOTHER_NAME)
    return None


class StudioLsp(Server):
    """Language server of one page.

    Args:
        allowed: function that returns whether a text is the open one; others and their includes are not read.
        show: called with each version of the text and its scene, in the loop's thread.
    """

    def __init__(self, allowed: Callable[[str], bool], show: Callable[[OpenText, Json | None], None]) -> None:
        super().__init__()
        self._allowed, self._show = allowed, show
        self._tasks: set[asyncio.Task[None]] = set()
        made(self)

    def put(self, uri: str, version: int) -> None:
        if not self._allowed(uri):
            return
        super().put(uri, version)
        task = asyncio.ensure_future(self._draw(self.open[uri]))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _draw(self, text: OpenText) -> None:
        """Compute the scene of a text in a thread, and show it unless there is a newer version by then."""

        def made_scene() -> Json | None:
            return scene(text.source, text.outline.declarations, LIMITS)

        drawn = await asyncio.to_thread(made_scene)
        if self.open.get(text.uri) is text:
            self._show(text, drawn)


log = logging.getLogger(__name__)

OWN = "studio/"
LEFT_OUT = ("exit", "shutdown")
"""Methods that would end the language server, which ends with its page instead."""
UNKNOWN_METHOD, WRONG_PARAMETERS, DEFECT = -32601, -32602, -32603
"""Error codes of JSON-RPC."""


class WrongRequest(Exception):
    """Error: a page sent a request that the studio's own pages never send.

    Args:
        code: error code of JSON-RPC.
    """

    def __init__(self, code: int = WRONG_PARAMETERS) -> None:
        super().__init__(code)
        self.code = code


class Session:
    """Context manager during which a page is answered.

    Args:
        send: called with each message to the page, in the loop's thread.
    """

    def __init__(self, workplace: Workplace, send: Callable[[str], None]) -> None:
        self._workplace, self._send = workplace, send
        self._open = OpenMission(workplace.home, workplace.first, LIMITS)
        self._lsp = StudioLsp(lambda uri: uri == self._open.uri, self._show)
        self._lsp.protocol.set_writer(_Writer(send), include_headers=False)
        self._compilation = Compilation(workplace, self._tell, self._end)
        self._compiled: OpenText | None = None
        self._answers: dict[str, Callable[[Json], Any]] = {
            "studio/begin": lambda params: {**self._open.described(), "words": session_words()},
            "studio/lists": lambda params: {shelf: listed(shelf, workplace.home) for shelf in SHELVES},
            "studio/open": self._open_other,
            "studio/reload": lambda params: self._open.reload(),
            "studio/save": self._save,
            "studio/compile": self._compile,
            "studio/stop": self._stop,
            "studio/keep": self._keep,
        }

    def __enter__(self) -> Self:
        self._compilation.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        self._lsp.checks.close()
        self._compilation.__exit__(*exception)

    def receive(self, data: str | bytes) -> None:
        """Answer one message of the page; invalid ones are ignored."""
        try:
            message = json.loads(data)
        except (ValueError, RecursionError):
            return
        method = message.get("method") if isinstance(message, dict) else None
        if isinstance(method, str) and method.startswith(OWN):
            self._answer(method, message)
        elif isinstance(message, dict) and method not in LEFT_OUT:
            self._hand_on(data)

    def _hand_on(self, data: str | bytes) -> None:
        """Pass a message to the language server."""
        protocol = self._lsp.protocol
        try:
            protocol.handle_message(json.loads(data, object_hook=protocol.structure_message))
        except Exception as error:
            self._lsp.report_server_error(error, JsonRpcException)

    def _answer(self, method: str, message: Json) -> None:
        number, params = message.get("id"), message.get("params")
        try:
            if method not in self._answers:
                raise WrongRequest(UNKNOWN_METHOD)
            result = self._answers[method](params if isinstance(params, dict) else {})
        except WrongRequest as wrong:
            self._refuse(number, wrong.code, f"unknown method or invalid parameters: {method}")
        except Exception as error:
            log.exception("failed to answer a request of the page")
            self._refuse(number, DEFECT, defect(error).words)
        else:
            self._say({"id": number, "result": _refusal(result) if isinstance(result, Diagnostic) else result})

    def _refuse(self, number: object, code: int, message: str) -> None:
        self._say({"id": number, "error": {"code": code, "message": message}})

    def _open_other(self, params: Json) -> Json | Diagnostic:
        shelf = next((shelf for shelf in SHELVES if shelf == params.get("shelf")), None)
        if shelf is None:
            raise WrongRequest
        return self._open.open(shelf, _text(params, "name"))

    def _save(self, params: Json) -> Json | Diagnostic:
        return self._open.save(_text(params, "text"), _text(params, "name"), params.get("replace") is True)

    def _compile(self, params: Json) -> Json:
        """Start compiling the language server's current text.

        Raises:
            WrongRequest: there is no open text.
        """
        text = self._lsp.open.get(self._open.uri)
        if text is None:
            raise WrongRequest
        names = [item.name.text for item in text.outline.declarations if isinstance(item, ast.MissionName)]
        choice = text.found.choice if text.found else None
        self._compiled = text
        backend = choice.backend if choice else BACKENDS.built_in[0]
        self._compilation.start(text.source, names[0] if names else "mission", backend)
        return {}

    def _stop(self, params: Json) -> Json:
        self._compilation.stop()
        return {}

    def _keep(self, params: Json) -> Json:
        kept = self._compilation.keep(params.get("replace") is True)
        if isinstance(kept, Diagnostic):
            return {"problem": "exists" if kept.code is OUTPUT_EXISTS else "refused", "says": kept.words}
        return {"problem": "" if kept else "refused", "says": f"plan saved in {kept}" if kept else "no plan to save"}

    def _show(self, text: OpenText, drawn: Json | None) -> None:
        whole = text.outline.whole
        self._tell_page("studio/scene", {"uri": text.uri, "version": text.version, "whole": whole, "scene": drawn})

    def _tell(self, line: str) -> None:
        self._tell_page("studio/progress", {"line": line})

    def _end(self, ended: Ended, report: str) -> None:
        text = self._compiled
        findings = list(ended.findings)
        shown = diagnostics(text, findings) if text else []
        self._tell_page(
            "studio/ended",
            {
                "status": ended.status,
                "version": text.version if text else 0,
                "says": "" if findings else ended.says,
                "counts": counts(findings),
                "lines": list(ended.lines),
                "report": report,
                "findings": _converter().unstructure(shown),
            },
        )

    def _tell_page(self, method: str, params: Json) -> None:
        self._say({"method": method, "params": params})

    def _say(self, message: Json) -> None:
        self._send(json.dumps({"jsonrpc": "2.0", **message}))


@cache
def _converter() -> Converter:
    """Converter from protocol objects to plain values."""
    return get_converter()


class _Writer:
    """Output stream of the language server, which sends messages to the page."""

    def __init__(self, send: Callable[[str], None]) -> None:
        self._send = send

    def write(self, data: bytes) -> None:
        self._send(data.decode("utf-8"))

    def close(self) -> None:
        """Do nothing: the page closes its own socket."""


def _text(params: Json, name: str) -> str:
    value = params.get(name, "")
    if not isinstance(value, str):
        raise WrongRequest
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        raise WrongRequest from None
    return value


def _refusal(finding: Diagnostic) -> Json:
    return {"problem": "refused", "says": finding.words, "code": finding.code.name}
