"""A session: one open page, its requests, and the language server's that goes with it.

Messages are those of JSON-RPC. What begins with ``studio/`` is answered here, everything else by the language server,
of which the page has one to itself. The text of the page is written nowhere but by ``studio/save``.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, Self

from lsprotocol.converters import get_converter
from pygls.exceptions import JsonRpcException

from missionc.backends.offers import OFFERS
from missionc.cli.studio.compilation import Compilation
from missionc.cli.studio.mission_lists import SHELVES, listed
from missionc.cli.studio.open_mission import OpenMission
from missionc.cli.studio.studio_lsp import StudioLsp
from missionc.cli.studio.words import words
from missionc.cli.studio.workplace import Workplace
from missionc.cli.watch.planner_process import Ended
from missionc.diagnostics.code import OUTPUT_EXISTS
from missionc.diagnostics.defect import defect
from missionc.diagnostics.model import Diagnostic
from missionc.diagnostics.render import counts
from missionc.lsp.background_checks import diagnostics
from missionc.lsp.open_text import LIMITS, OpenText
from missionc.lsp.scene.scene import Json
from missionc.syntax import ast

if TYPE_CHECKING:
    from cattrs import Converter

log = logging.getLogger(__name__)

OWN = "studio/"
LEFT_OUT = ("exit", "shutdown")
"""What ends a language server, which ends with its page."""
UNKNOWN_METHOD, WRONG_PARAMETERS, DEFECT = -32601, -32602, -32603
"""Codes of JSON-RPC."""


class WrongRequest(Exception):
    """A request that no page of ours sends; ``code`` is that of JSON-RPC."""

    def __init__(self, code: int = WRONG_PARAMETERS) -> None:
        super().__init__(code)
        self.code = code


class Session:
    """A context in which a page is answered; ``send`` takes each message to it, in the loop's thread."""

    def __init__(self, workplace: Workplace, send: Callable[[str], None]) -> None:
        self._workplace, self._send = workplace, send
        self._open = OpenMission(workplace.home, workplace.first, LIMITS)
        self._lsp = StudioLsp(lambda uri: uri == self._open.uri, self._show)
        self._lsp.protocol.set_writer(_Writer(send), include_headers=False)
        self._compilation = Compilation(workplace, self._tell, self._end)
        self._compiled: OpenText | None = None
        self._answers: dict[str, Callable[[Json], Any]] = {
            "studio/begin": lambda params: {**self._open.described(), "words": words()},
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
        """Answer one message; what is none is passed over."""
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
        """Have the language server answer."""
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
            self._refuse(number, wrong.code, f"{method} is not answered so")
        except Exception as error:
            log.exception("a request of a page cannot be answered")
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
        """Begin to compile the text as the language server has it."""
        text = self._lsp.open.get(self._open.uri)
        if text is None:
            raise WrongRequest
        names = [item.name.text for item in text.outline.declarations if isinstance(item, ast.MissionName)]
        choice = text.found.choice if text.found else None
        self._compiled = text
        backend = choice.backend if choice else next(iter(OFFERS))
        self._compilation.start(text.source, names[0] if names else "mission", backend)
        return {}

    def _stop(self, params: Json) -> Json:
        self._compilation.stop()
        return {}

    def _keep(self, params: Json) -> Json:
        kept = self._compilation.keep(params.get("replace") is True)
        if isinstance(kept, Diagnostic):
            return {"problem": "exists" if kept.code is OUTPUT_EXISTS else "refused", "says": kept.words}
        return {"problem": "" if kept else "refused", "says": f"the plan is in {kept}" if kept else "there is no plan"}

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
    """What makes plain values of the protocol's."""
    return get_converter()


class _Writer:
    """What the language server writes to."""

    def __init__(self, send: Callable[[str], None]) -> None:
        self._send = send

    def write(self, data: bytes) -> None:
        self._send(data.decode("utf-8"))

    def close(self) -> None:
        """The page's socket is closed by the page."""


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
