"""Protocol server: receives JSON-RPC messages, and answers them with the functions of the other modules.

Every change message contains the complete text: it is small, and client and server cannot disagree on its lines. A
malformed message is answered as the protocol requires, or skipped.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias, cast

from lsprotocol import types
from pygls.exceptions import JsonRpcException, JsonRpcInternalError, JsonRpcInvalidRequest, JsonRpcParseError
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol
from pygls.protocol.json_rpc import JsonRPCNotification
from pygls.uris import to_fs_path

from missionc.base.source import Source
from missionc.tools.language_server.code_lenses import lenses
from missionc.tools.language_server.completion import completion
from missionc.tools.language_server.hover import hints, hover
from missionc.tools.language_server.open_text import LIMITS, Checks, OpenText, diagnostics, name_of
from missionc.tools.language_server.scene.scene import Json, scene
from missionc.tools.language_server.text_edits import (
    LEGEND,
    definition,
    fixes,
    folds,
    formatting,
    highlights,
    links,
    references,
    renamable,
    rename,
    semantic_tokens,
)
from missionc.tools.language_server.workspace_symbols import WorkspaceSymbols, symbols
from missionc.version import __version__

LONGEST = 1 << 28
"""Maximum size of a message, bytes; a longer one is skipped before memory is reserved for it."""

LENGTH = re.compile(rb"Content-Length: (\d+)\r\n\Z")


class Incoming:
    """Input stream of the server: header lines and then the bytes of each message."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def readline(self) -> bytes:
        """Read the next line; after an invalid message, from the next length header on. Empty at the end of the
        input.
        """
        line = self._stream.readline()
        match = LENGTH.search(line)
        if match is None:
            return line
        digits = match[1].lstrip(b"0")
        return match[0] if len(digits) < 10 and int(digits or b"0") <= LONGEST else b"\r\n"

    def read(self, count: int) -> bytes:
        return self._stream.read(count)


class Protocol(LanguageServerProtocol):
    """Protocol that answers every request, even an unreadable one."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        try:
            if "jsonrpc" in data and "method" in data:
                data.setdefault("params", None)  # may be absent
                if not isinstance(data["method"], str):
                    raise JsonRpcInvalidRequest
            return super().structure_message(data)
        except JsonRpcException as wrong:
            if "method" in data and "id" in data:
                request_id = data["id"] if isinstance(data["id"], int | str) else None
                self.refuse(JsonRpcInvalidRequest() if isinstance(wrong, JsonRpcInternalError) else wrong, request_id)
            return JsonRPCNotification(
                method="", params=None, jsonrpc=""
            )  # without a version, so that no handler acts on it

    def refuse(self, error: JsonRpcException, request_id: int | str | None = None) -> None:
        """Answer a message with an error.

        Args:
            error: error to send.
            request_id: id of the message; null if it has no readable one.
        """
        self._send_data({"jsonrpc": self.VERSION, "id": request_id, "error": error.to_response_error()})


class Server(LanguageServer):
    """State of the language server: open texts and their checks."""

    protocol: Protocol

    def __init__(self) -> None:
        full = types.TextDocumentSyncKind.Full
        super().__init__("missionc", __version__, text_document_sync_kind=full, protocol_cls=Protocol)
        self.open: dict[str, OpenText] = {}
        self.checks = Checks(self.publish)
        self.symbols = WorkspaceSymbols()
        self.commands: frozenset[str] = frozenset()

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Report an error to the client; input that is not a message is answered as the protocol requires."""
        if source is not JsonRpcException:
            super().report_server_error(error, source)
        else:
            unread = isinstance(error, ValueError | RecursionError)
            self.protocol.refuse(JsonRpcParseError() if unread else JsonRpcInvalidRequest())

    def put(self, uri: str, version: int) -> None:
        """Store the client's current text of a document, and start its check.

        Args:
            uri: URI of the document.
            version: version number in the protocol.
        """
        known = self.open.get(uri)
        written = self.workspace.get_text_document(uri).source
        before = known.mission if known else None
        self.open[uri] = OpenText(uri, version, Source(name_of(uri), written), self.encoding, before)
        self.checks.ask(self.open[uri])

    async def settled(self, uri: str) -> OpenText | None:
        """Open text after its check; None if it was closed."""
        await self.checks.settled(uri)
        return self.open.get(uri)

    @property
    def encoding(self) -> str:
        """Encoding in whose units the client counts columns."""
        return types.PositionEncodingKind(self.workspace.position_encoding or "utf-16")

    def folders(self) -> list[Path]:
        """Paths of the local folders that the client has open."""
        uris = [*self.workspace.folders] or [self.workspace.root_uri or ""]
        return [Path(path) for uri in uris if uri.startswith("file:") and (path := to_fs_path(uri))]

    def publish(self, text: OpenText) -> None:
        findings = text.found.findings if text.found else ()
        self.text_document_publish_diagnostics(
            types.PublishDiagnosticsParams(text.uri, diagnostics(text, findings), text.version)
        )


def serve() -> None:
    """Answer requests on standard input and output until the client disconnects."""
    if sys.stdin is None:
        return  # closed: no more requests will arrive
    logging.getLogger("pygls").setLevel(logging.CRITICAL)  # the client gets every error, with its source
    gc.freeze()
    gc.set_threshold(50_000)
    made().start_io(cast(BinaryIO, Incoming(sys.stdin.buffer)))


def made(server: Server | None = None) -> Server:
    """Server with handlers for all requests.

    Args:
        server: server to add the handlers to; a new one if None.
    """
    server = server or Server()
    _texts(server)
    for request in AT_ONCE:
        _answer_at_once(server, *request)
    for request in CHECKED:
        _answer_checked(server, *request)
    _views(server)
    return server


def _texts(server: Server) -> None:
    @server.feature(types.INITIALIZE)
    def initialize(params: types.InitializeParams) -> None:
        """Read the client's commands from its options: ``{"commands": ["missionc.compile"]}``."""
        options = params.initialization_options
        named = options.get("commands") if isinstance(options, dict) else getattr(options, "commands", None)
        server.commands = frozenset(each for each in named or () if isinstance(each, str))

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def did_open(params: types.DidOpenTextDocumentParams) -> None:
        server.put(params.text_document.uri, params.text_document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def did_change(params: types.DidChangeTextDocumentParams) -> None:
        server.put(params.text_document.uri, params.text_document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    def did_save(params: types.DidSaveTextDocumentParams) -> None:
        """Check other open texts that may include the saved one."""
        for text in list(server.open.values()):
            server.put(text.uri, text.version)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def did_close(params: types.DidCloseTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.open.pop(uri, None)
        server.checks.forget(uri)
        server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    @server.feature(types.SHUTDOWN)
    def shutdown(params: Any) -> None:
        server.checks.close()


Answer: TypeAlias = Callable[[OpenText, Any], object]
"""Function from a text and the parameters of a request to the result."""

AT_ONCE: tuple[tuple[str, Answer, object], ...] = (
    (types.TEXT_DOCUMENT_HOVER, lambda text, asked: hover(text, asked.position), None),
    (types.TEXT_DOCUMENT_DEFINITION, lambda text, asked: definition(text, asked.position), None),
    (
        types.TEXT_DOCUMENT_REFERENCES,
        lambda text, asked: references(text, asked.position, asked.context.include_declaration),
        [],
    ),
    (types.TEXT_DOCUMENT_FOLDING_RANGE, lambda text, _: folds(text), []),
    (types.TEXT_DOCUMENT_DOCUMENT_LINK, lambda text, _: links(text), []),
    (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, lambda text, _: semantic_tokens(text), None),
    (types.TEXT_DOCUMENT_COMPLETION, lambda text, asked: completion(text, asked.position), []),
    (types.TEXT_DOCUMENT_FORMATTING, lambda text, _: formatting(text), []),
    (types.TEXT_DOCUMENT_PREPARE_RENAME, lambda text, asked: renamable(text, asked.position), None),
    (types.TEXT_DOCUMENT_RENAME, lambda text, asked: rename(text, asked.position, asked.new_name), None),
)
"""Requests that are answered without a check: method, function, and result if the text is not open."""

CHECKED: tuple[tuple[str, Answer, object], ...] = (
    (types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, lambda text, asked: highlights(text, asked.position), []),
    (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, lambda text, _: symbols(text), []),
    (types.TEXT_DOCUMENT_INLAY_HINT, lambda text, asked: hints(text, asked.range), []),
    (types.TEXT_DOCUMENT_CODE_ACTION, lambda text, asked: fixes(text, asked.range), []),
)
"""Requests that are answered after the check of the text: method, function, and result if the text is not open."""

OPTIONS = {
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: LEGEND,
    types.TEXT_DOCUMENT_CODE_ACTION: types.CodeActionOptions([types.CodeActionKind.QuickFix]),
    types.TEXT_DOCUMENT_RENAME: types.RenameOptions(prepare_provider=True),
}


def _answer_at_once(server: Server, method: str, answer: Answer, absent: object) -> None:
    @server.feature(method, OPTIONS.get(method))
    def at_once(params: Any) -> object:
        text = server.open.get(params.text_document.uri)
        return answer(text, params) if text else absent


def _answer_checked(server: Server, method: str, answer: Answer, absent: object) -> None:
    @server.feature(method, OPTIONS.get(method))
    async def checked(params: Any) -> object:
        text = await server.settled(params.text_document.uri)
        return answer(text, params) if text else absent


def _views(server: Server) -> None:
    @server.feature(types.WORKSPACE_SYMBOL)
    async def answer_workspace(params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
        """Workspace symbols, computed in a separate thread since files are read."""
        search, texts = server.symbols.search, dict(server.open)
        return await asyncio.to_thread(search, params.query, server.folders(), texts, server.encoding)

    @server.feature(types.TEXT_DOCUMENT_CODE_LENS)
    async def answer_lenses(params: types.CodeLensParams) -> list[types.CodeLens]:
        text = await server.settled(params.text_document.uri)
        if text is None:
            return []
        path = Path(text.source.name)
        around = [folder for folder in server.folders() if path.is_relative_to(folder)]
        return lenses(text, server.commands, dict.fromkeys([*around, path.parent]))

    @server.feature("missionc/scene")
    async def answer_scene(params: Any) -> Json | None:
        """Map of a text with its version, computed in a separate thread since areas are slow."""
        text = server.open.get(params.textDocument.uri)
        if text is None:
            return None
        drawn = await asyncio.to_thread(scene, text.source, text.outline.declarations, LIMITS)
        return {"version": text.version, "whole": text.outline.whole, "scene": drawn}

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def did_change_files(params: types.DidChangeWatchedFilesParams) -> None:
        """Make the client refresh its code lenses after a plan has changed."""
        wanted = server.client_capabilities.workspace
        if wanted and wanted.code_lens and wanted.code_lens.refresh_support:
            server.workspace_code_lens_refresh(None)
