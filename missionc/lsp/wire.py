"""The wire protocol: JSON-RPC messages from a client; malformed ones are answered as the protocol says, or skipped."""

from __future__ import annotations

import re
from typing import Any, BinaryIO

from pygls.exceptions import JsonRpcException, JsonRpcInternalError, JsonRpcInvalidRequest
from pygls.protocol import LanguageServerProtocol
from pygls.protocol.json_rpc import JsonRPCNotification

LONGEST = 1 << 28
"""Bytes of one message; a longer one is a client's mistake, and nothing is made ready for it."""

LENGTH = re.compile(rb"Content-Length: (\d+)\r\n\Z")


class Incoming:
    """Standard input as the server reads it: line by line to a message's length, and then so many bytes."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def readline(self) -> bytes:
        """A line; after something that was no message, from the next message's length on. Nothing at the end."""
        line = self._stream.readline()
        match = LENGTH.search(line)
        if match is None:
            return line
        digits = match[1].lstrip(b"0")
        return match[0] if len(digits) < 10 and int(digits or b"0") <= LONGEST else b"\r\n"

    def read(self, count: int) -> bytes:
        return self._stream.read(count)


class Protocol(LanguageServerProtocol):
    """The protocol, with an answer to each request, also to one that cannot be read."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        try:
            if "jsonrpc" in data and "method" in data:
                data.setdefault("params", None)  # it may be left out
                if not isinstance(data["method"], str):
                    raise JsonRpcInvalidRequest
            return super().structure_message(data)
        except JsonRpcException as wrong:
            if "method" in data and "id" in data:
                request_id = data["id"] if isinstance(data["id"], int | str) else None
                self.refuse(JsonRpcInvalidRequest() if isinstance(wrong, JsonRpcInternalError) else wrong, request_id)
            return JsonRPCNotification(
                method="", params=None, jsonrpc=""
            )  # of no version, so that no handler acts on it

    def refuse(self, error: JsonRpcException, request_id: int | str | None = None) -> None:
        """Answer a message with an error; its id is null if the message states none that can be read."""
        self._send_data({"jsonrpc": self.VERSION, "id": request_id, "error": error.to_response_error()})
