"""GraphML parser for roadmaps: nodes and edges with attributes and their locations in the file.

    in   Source
    out  Graphml, or the first error
    says MC031

A file may come from anyone. Expat reads it in one pass, after the check of file sizes. A document type, and with it
every entity, is an error, and nothing recurses.

Source:
    Brandes et al., "GraphML Progress Report" (2002); graphml.graphdrawing.org/specification.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias
from xml.parsers import expat

from missionc.base.diagnostics.code import NOT_GRAPHML
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Source, Span

DEEPEST = 64
"""Maximum nesting depth of XML elements."""

SPACE = "\n"
"""Separator between the namespace of an element and its name."""

Data: TypeAlias = dict[str, tuple[str, Span]]
"""Attributes of a node or edge by name: the text of each, and its location."""

KNOWN = frozenset({"graphml", "graph", "node", "edge", "key", "data", "default", "desc"})


@dataclass(slots=True)
class GraphmlNode:
    name: str
    span: Span
    data: Data = field(default_factory=dict)


@dataclass(slots=True)
class GraphmlEdge:
    source: str
    target: str
    one_way: bool
    span: Span
    data: Data = field(default_factory=dict)


@dataclass(slots=True)
class Graphml:
    """Graph of a GraphML file; ``keys`` has the declaration of each attribute of a ``node``, an ``edge`` or ``all``."""

    nodes: list[GraphmlNode] = field(default_factory=list)
    edges: list[GraphmlEdge] = field(default_factory=list)
    keys: dict[tuple[str, str], Span] = field(default_factory=dict)


def read_graphml(source: Source) -> Graphml | Diagnostic:
    """The single graph of a GraphML file, or the first error."""
    reader = _Reader(source)
    try:
        reader.parser.Parse(reader.content, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code) or "unexpected end of the file"
        return _wrong(reader.place(reader.parser.ErrorByteIndex), f"invalid XML: {reason}")
    except _WrongError as wrong:
        return wrong.finding
    if not reader.has_graph:
        return _wrong(Span(source, 0, 0), "no graph found")
    return reader.graph


class _WrongError(Exception):
    def __init__(self, span: Span, reason: str) -> None:
        super().__init__(reason)
        self.finding = _wrong(span, reason)


@dataclass(slots=True)
class _Key:
    """Declared attribute of a GraphML file: its name, its owner (``node``, ``edge`` or ``all``), and its default."""

    name: str
    owner: str
    span: Span
    default: tuple[str, Span] | None = None


class _Reader:
    """Expat handlers that build the graph of a GraphML file."""

    def __init__(self, source: Source) -> None:
        self.source, self.content = source, source.text.encode("utf-8", "replace")
        self.graph, self.has_graph = Graphml(), False
        self.keys: dict[str, _Key] = {}
        self.directed = False
        self.open: list[str] = []
        self.owner: GraphmlNode | GraphmlEdge | None = None
        self.given: dict[int, set[str]] = {}
        self.key = ""
        self.text: list[str] = []
        self.began = Span(source, 0, 0)
        self.reached = 0, 0
        """Last position in the file that was converted: offset in bytes, and in characters."""
        self.parser = expat.ParserCreate("utf-8", SPACE)
        self.parser.StartDoctypeDeclHandler = self.doctype
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.characters

    def place(self, byte: int) -> Span:
        """Span from a byte position to the end of the tag that begins there, or of one character."""
        text = self.source.text
        before, characters = self.reached if self.reached[0] <= byte else (0, 0)
        # Places come in order: only the text since the last one is decoded.
        start = characters + len(self.content[before:byte].decode("utf-8", "ignore"))
        self.reached = byte, start
        start = max(0, min(start, len(text) - 1))
        tag = text.find(">", start) + 1 if text[start : start + 1] == "<" else 0
        end = tag if tag and text.find("\n", start, tag) < 0 else start + 1
        return Span(self.source, start, min(end, len(text)))

    def refuse(self, reason: str) -> _WrongError:
        return _WrongError(self.place(self.parser.CurrentByteIndex), reason)

    def doctype(self, *_: object) -> None:
        raise self.refuse("a document type is not allowed")

    def start(self, name: str, attributes: Mapping[str, str]) -> None:
        element, inside = name.rpartition(SPACE)[2], self.open[-1] if self.open else ""
        self.open.append(element)
        if len(self.open) > DEEPEST:
            raise self.refuse(f"elements are nested more than {DEEPEST} deep")
        if inside in ("data", "default", "desc") or "data" in self.open[:-1]:
            return  # attributes for drawing in other programs
        if (element == "graphml") != (inside == "") or element not in KNOWN:
            raise self.refuse(f"unexpected element `{element[:40]}`")
        match element:
            case "graph":
                if self.has_graph:
                    raise self.refuse("more than one graph")
                self.has_graph, self.directed = True, attributes.get("edgedefault") != "undirected"
            case "key":
                self.add_key(attributes)
            case "node":
                self.owner = GraphmlNode(self.needed(attributes, "id"), self.place(self.parser.CurrentByteIndex))
                self.graph.nodes.append(self.owner)
            case "edge":
                ends = self.needed(attributes, "source"), self.needed(attributes, "target")
                one_way = {"true": True, "false": False}.get(attributes.get("directed", ""), self.directed)
                self.owner = GraphmlEdge(*ends, one_way, self.place(self.parser.CurrentByteIndex))
                self.graph.edges.append(self.owner)
            case "data" | "default":
                self.key = self.needed(attributes, "key") if element == "data" else self.key
                self.text, self.began = [], self.place(self.parser.CurrentByteIndex)
            case _:
                pass

    def add_key(self, attributes: Mapping[str, str]) -> None:
        self.key = self.needed(attributes, "id")
        name, owner = attributes.get("attr.name", ""), attributes.get("for", "all")
        self.keys[self.key] = _Key(name, owner, self.place(self.parser.CurrentByteIndex))

    def needed(self, attributes: Mapping[str, str], name: str) -> str:
        value = attributes.get(name, "")
        if not value or not value.isprintable():
            raise self.refuse(f"`{self.open[-1]}` needs a printable text `{name}`")
        return value

    def characters(self, text: str) -> None:
        if self.open[-1] in ("data", "default"):
            self.text.append(text)

    def end(self, name: str) -> None:
        element = self.open.pop()
        if "data" in self.open:
            return
        value = "".join(self.text).strip(), self.began
        match element:
            case "default" if self.key in self.keys:
                self.keys[self.key].default = value
            case "data" if self.owner is not None and self.open[-1] in ("node", "edge"):
                if self.key not in self.keys:
                    raise _WrongError(self.began, f"unknown key `{self.key[:40]}`")
                if self.keys[self.key].name:
                    self.owner.data[self.keys[self.key].name] = value
            case "node" | "edge":
                self.owner = None
            case "graphml":
                self.add_defaults()
            case _:
                pass

    def add_defaults(self) -> None:
        for key in self.keys.values():
            if not key.name or key.owner not in ("node", "edge", "all"):
                continue
            self.graph.keys[key.owner, key.name] = key.span
            elements = [
                *(self.graph.nodes if key.owner != "edge" else ()),
                *(self.graph.edges if key.owner != "node" else ()),
            ]
            for element in elements if key.default is not None else ():
                element.data.setdefault(key.name, key.default)


def _wrong(span: Span, reason: str) -> Diagnostic:
    return Diagnostic(
        NOT_GRAPHML,
        f"`{span.source.name}` is not a roadmap: {reason}",
        Label(span),
        help="write the graph with `networkx.write_graphml`",
    )
