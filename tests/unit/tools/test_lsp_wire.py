"""What a client sends that is no request, or asks of what cannot be: answered or passed over, and the next is heard."""

from __future__ import annotations

import io
import json
from threading import Event
from typing import Any

import pytest

pytest.importorskip("pygls")

from pygls.io_ import run

from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.tools.language_server.open_text import name_of
from missionc.tools.language_server.server import LONGEST, Incoming, Server, made
from tests.support.small_missions import SMALL

URI = "file:///tmp/a.mission"
PLACE = {"textDocument": {"uri": URI}, "position": {"line": 0, "character": 1}}
INVALID, INVALID_REQUEST, METHOD_NOT_FOUND, PARSE_ERROR = -32602, -32600, -32601, -32700


class Sent:
    """Where a server writes, kept as values."""

    def __init__(self) -> None:
        self.messages: list[dict[str, Any]] = []

    def write(self, data: bytes) -> None:
        self.messages.append(json.loads(data.partition(b"\r\n\r\n")[2]))

    def close(self) -> None:
        return


@pytest.fixture
def sent() -> Sent:
    return Sent()


@pytest.fixture
def server(sent: Sent) -> Server:
    server = made()
    server.checks.close()  # what is found in a text is asked of it elsewhere
    server.protocol.set_writer(sent)
    asked(server, "initialize", {"processId": None, "rootUri": None, "capabilities": {}}, 0)
    return server


def says(server: Server, **message: object) -> None:
    """Give the server a message as it comes."""
    text = json.dumps({"jsonrpc": "2.0", **message})
    server.protocol.handle_message(json.loads(text, object_hook=server.protocol.structure_message))


def asked(server: Server, method: str, params: object, number: object) -> None:
    says(server, id=number, method=method, params=params)


def opened(server: Server, uri: str, text: str = SMALL) -> None:
    item = {"uri": uri, "languageId": "mission", "version": 1, "text": text}
    says(server, method="textDocument/didOpen", params={"textDocument": item})


@pytest.mark.parametrize(
    "position",
    [
        {"line": -1, "character": 0},
        {"line": 0, "character": -1},
        {"line": None, "character": None},
        {"line": 10**30, "character": 0},
        {"line": "0", "character": []},
        {},
        None,
        5,
    ],
)
@pytest.mark.parametrize("method", ["hover", "definition", "completion", "rename", "documentHighlight"])
def test_a_place_that_is_none_is_answered_with_an_error_and_the_next_request_is_heard(
    method: str, position: object, server: Server, sent: Sent
) -> None:
    opened(server, URI)
    asked(server, f"textDocument/{method}", {**PLACE, "position": position, "newName": "b"}, 7)
    assert [(each["id"], each["error"]["code"]) for each in sent.messages if "error" in each] == [(7, INVALID)]
    asked(server, "textDocument/hover", PLACE, 8)
    assert "result" in next(each for each in sent.messages if each.get("id") == 8)


@pytest.mark.parametrize("params", [None, 5, [1, 2], "x", {}, {"textDocument": 5}, {"textDocument": {"uri": None}}])
def test_parameters_of_another_type_are_answered_with_an_error(params: object, server: Server, sent: Sent) -> None:
    asked(server, "textDocument/hover", params, "seven")
    assert [each["id"] for each in sent.messages if "error" in each] == ["seven"]


def test_a_notification_that_cannot_be_read_is_passed_over(server: Server, sent: Sent) -> None:
    before = list(sent.messages)
    says(server, method="textDocument/didOpen", params={"textDocument": {"uri": 5}})
    says(server, method="textDocument/didClose", params=None)
    assert sent.messages == before


@pytest.mark.parametrize(
    "uri", ["file:///a\0b", "file:///a%00b", "file:///a\ud800b", "file:///a%ff", "", "x:y", "no uri"]
)
def test_a_text_of_any_name_is_opened_checked_and_asked_about(uri: str, server: Server, sent: Sent) -> None:
    opened(server, uri, SMALL + 'include "b.mission"\n')
    asked(server, "textDocument/hover", {**PLACE, "textDocument": {"uri": uri}}, 3)
    assert "result" in next(each for each in sent.messages if each.get("id") == 3)
    assert check(Source(name_of(uri), SMALL + 'include "b.mission"\n')).findings


def test_what_was_never_opened_has_no_answer_but_one(server: Server, sent: Sent) -> None:
    asked(server, "textDocument/hover", PLACE, 4)
    assert next(each for each in sent.messages if each.get("id") == 4)["result"] is None


def framed(body: bytes) -> bytes:
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (b'{"jsonrpc": "2.0",', PARSE_ERROR),
        (b'"\xff"', PARSE_ERROR),
        (b"[" * 20_000 + b"]" * 20_000, PARSE_ERROR),
        (b'{"jsonrpc": "2.0", "id": ' + b"9" * 5000 + b"}", PARSE_ERROR),
        (b"[1, 2]", INVALID_REQUEST),
        (b"null", INVALID_REQUEST),
        (b'{"id": 1, "method": "shutdown"}', INVALID_REQUEST),
        (b'{"jsonrpc": "2.0", "id": 1, "method": 5}', INVALID_REQUEST),
        (b'{"jsonrpc": "2.0", "id": [], "method": "textDocument/hover"}', INVALID),
        (b'{"jsonrpc": "2.0", "id": 1, "method": "nothing"}', METHOD_NOT_FOUND),
    ],
)
def test_a_message_that_is_no_request_is_answered_with_an_error_and_the_next_one_is_heard(
    body: bytes, code: int, server: Server, sent: Sent
) -> None:
    before = len(sent.messages)
    incoming = Incoming(io.BytesIO(framed(body) + framed(b'{"jsonrpc": "2.0", "id": 9, "method": "shutdown"}')))
    run(Event(), incoming, server.protocol, error_handler=server.report_server_error)
    refused, heard = sent.messages[before:]
    assert refused["error"]["code"] == code
    assert refused["id"] in (None, 1)
    assert heard == {"jsonrpc": "2.0", "id": 9, "result": None}


@pytest.mark.parametrize(
    "before",
    [
        b"Content-Length: " + b"9" * 30 + b"\r\n\r\n{}",
        f"Content-Length: {LONGEST + 1}\r\n\r\n".encode(),
        b"Content-Length: -5\r\n\r\n{}",
        b"Content-Length: x\r\n\r\n{}",
        b"hello\r\n\r\n",
        b"\xff\xfe\0",
        b"",
    ],
)
def test_after_what_was_no_message_the_next_one_is_found(before: bytes) -> None:
    incoming = Incoming(io.BytesIO(before + b"Content-Length: 2\r\n\r\n{}"))
    lines = [incoming.readline()]
    while lines[-1] != b"Content-Length: 2\r\n":
        lines.append(incoming.readline())
    assert not any(line.startswith(b"Content-Length: 9") for line in lines)
    assert (incoming.readline(), incoming.read(2), incoming.readline()) == (b"\r\n", b"{}", b"")
