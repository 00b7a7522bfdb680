"""The language server as an editor meets it: a process, spoken to on standard input and output."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("pygls")

import pytest_lsp
from lsprotocol import types
from pytest_lsp import ClientServerConfig, LanguageClient, client_capabilities, make_test_lsp_client

pytest_plugins = ["pytest_lsp"]

ROOT = Path(__file__).resolve().parents[3]
WILDFIRE = (ROOT / "missions" / "wildfire.mission").read_text(encoding="utf-8")
URI = "file:///somewhere/typed.mission"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


@pytest_lsp.fixture(
    config=ClientServerConfig(server_command=[sys.executable, "-m", "missionc", "lsp"], server_env=ENVIRONMENT)
)
async def editor(lsp_client: LanguageClient) -> AsyncIterator[None]:
    await lsp_client.initialize_session(
        types.InitializeParams(
            capabilities=client_capabilities("visual-studio-code"),
            root_uri="file:///somewhere",
            initialization_options={"commands": ["missionc.compile", 3]},
        )
    )
    yield
    await lsp_client.shutdown_session()


@pytest.mark.asyncio
@pytest.mark.parametrize(("agreed", "column"), [("utf-8", 12), ("utf-16", 10), ("utf-32", 9)])
async def test_columns_are_in_the_units_that_the_editor_asks_for(agreed: str, column: int) -> None:
    client = make_test_lsp_client()
    await client.start_io(sys.executable, "-m", "missionc", "lsp", "--stdio", env=ENVIRONMENT)
    general = types.GeneralClientCapabilities(position_encodings=[types.PositionEncodingKind(agreed)])
    capabilities = types.ClientCapabilities(general=general)
    await client.initialize_session(types.InitializeParams(capabilities=capabilities))
    opens(client, 'include "𝄞"\n')
    (finding, *_) = await checked(client)
    assert finding.range.end == types.Position(0, column + 2)
    await client.shutdown_session()
    await client.stop()


def opens(client: LanguageClient, text: str, uri: str = URI) -> None:
    item = types.TextDocumentItem(uri, "mission", 1, text)
    client.text_document_did_open(types.DidOpenTextDocumentParams(item))


def changes(client: LanguageClient, text: str, version: int) -> None:
    document = types.VersionedTextDocumentIdentifier(version, URI)
    change = types.TextDocumentContentChangeWholeDocument(text)
    client.text_document_did_change(types.DidChangeTextDocumentParams(document, [change]))


async def checked(client: LanguageClient) -> list[types.Diagnostic]:
    await asyncio.wait_for(client.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS), 60)
    return list(client.diagnostics[URI])


def place(text: str, words: str) -> types.Position:
    offset = text.index(words)
    return types.Position(text.count("\n", 0, offset), offset - text.rfind("\n", 0, offset) - 1)


def document() -> types.TextDocumentIdentifier:
    return types.TextDocumentIdentifier(URI)


@pytest.mark.asyncio
async def test_the_unsaved_text_is_checked_and_a_finding_is_mended(editor: LanguageClient) -> None:
    opens(editor, WILDFIRE)
    assert await checked(editor) == []
    text = WILDFIRE.replace("let safe = not fire", "let safe = nott fire")
    changes(editor, text, 2)
    (finding,) = await checked(editor)
    assert (finding.code, finding.severity) == ("MC008", types.DiagnosticSeverity.Error)
    assert finding.range == types.Range(place(text, "nott"), place(text, " fire\n\nrequire"))
    assert finding.code_description is not None
    assert finding.code_description.href.endswith("/docs/errors/MC008.md")
    asked = types.CodeActionParams(document(), finding.range, types.CodeActionContext([finding]))
    (action,) = await editor.text_document_code_action_async(asked)
    assert action.title == "Replace `nott` by `not`"
    assert list(action.edit.changes[URI]) == [types.TextEdit(finding.range, "not")]


@pytest.mark.asyncio
async def test_after_many_changes_what_is_shown_is_of_the_newest(editor: LanguageClient) -> None:
    opens(editor, WILDFIRE)
    await checked(editor)
    for version in range(2, 12):
        changes(editor, WILDFIRE + "region " + "x" * version, version)
    changes(editor, WILDFIRE.replace("not fire", "nott fire"), 12)
    async with asyncio.timeout(60):
        while [finding.code for finding in editor.diagnostics[URI]] != ["MC008"]:
            await asyncio.sleep(0.05)
    await asyncio.sleep(0.5)
    assert [finding.code for finding in editor.diagnostics[URI]] == ["MC008"]


@pytest.mark.asyncio
async def test_every_request_of_an_editor_is_answered(editor: LanguageClient) -> None:
    opens(editor, WILDFIRE)
    await checked(editor)
    here = place(WILDFIRE, "safe reach")
    said = await editor.text_document_hover_async(types.HoverParams(document(), here))
    assert "a named formula" in said.contents.value
    found = await editor.text_document_definition_async(types.DefinitionParams(document(), here))
    assert found.range.start == place(WILDFIRE, "safe = not")
    context = types.ReferenceContext(include_declaration=False)
    used = await editor.text_document_references_async(types.ReferenceParams(context, document(), here))
    assert len(used) == WILDFIRE.count("safe") - 1
    marked = await editor.text_document_document_highlight_async(types.DocumentHighlightParams(document(), here))
    assert len(marked) == WILDFIRE.count("safe")
    fits = await editor.text_document_completion_async(
        types.CompletionParams(document(), place(WILDFIRE, "radio] base"))
    )
    assert [fit.label for fit in fits] == ["radio"]
    shown = await editor.text_document_document_symbol_async(types.DocumentSymbolParams(document()))
    assert [symbol.name for symbol in shown][:2] == ["wildfire", "base"]
    everywhere = types.Range(types.Position(0, 0), types.Position(99, 0))
    ahead = await editor.text_document_inlay_hint_async(types.InlayHintParams(document(), everywhere))
    assert [hint.label for hint in ahead][:2] == ["horizon 20 s", "horizon 12 s"]
    folds = await editor.text_document_folding_range_async(types.FoldingRangeParams(document()))
    assert folds[0].start_line < folds[0].end_line
    assert list(await editor.text_document_document_link_async(types.DocumentLinkParams(document()))) == []
    colours = await editor.text_document_semantic_tokens_full_async(types.SemanticTokensParams(document()))
    assert len(colours.data) > 5 * WILDFIRE.count("safe")
    lenses = await editor.text_document_code_lens_async(types.CodeLensParams(document()))
    assert [(lens.command.title, list(lens.command.arguments)) for lens in lenses] == [("compile", [URI])]
    found = await editor.workspace_symbol_async(types.WorkspaceSymbolParams("safe"))
    assert [(symbol.name, symbol.location.uri) for symbol in found] == [("safe", URI)]
    layout = types.DocumentFormattingParams(document(), types.FormattingOptions(2, True))
    assert list(await editor.text_document_formatting_async(layout)) == []


@pytest.mark.asyncio
async def test_the_map_is_of_the_text_as_it_is_typed(editor: LanguageClient) -> None:
    opens(editor, WILDFIRE)
    asked = {"textDocument": {"uri": URI}}
    drawn = await editor.protocol.send_request_async("missionc/scene", asked)
    assert (drawn.version, drawn.whole, drawn.scene.dimension) == (1, True, 2)
    regions = {thing.name for thing in drawn.scene.things if thing.kind == "region"}
    assert {"base", "fire"} <= regions
    changes(editor, WILDFIRE + "region typed = box (1, 1) to (2, 2)\nregion half = box", 2)
    drawn = await editor.protocol.send_request_async("missionc/scene", asked)
    assert (drawn.version, drawn.whole) == (2, False)
    assert {thing.name for thing in drawn.scene.things if thing.kind == "region"} == regions | {"typed"}
    assert await editor.protocol.send_request_async("missionc/scene", {"textDocument": {"uri": "file:///no"}}) is None


@pytest.mark.asyncio
async def test_a_rename_is_prepared_made_and_refused_in_plain_words(editor: LanguageClient) -> None:
    opens(editor, WILDFIRE)
    await checked(editor)
    here = place(WILDFIRE, "safe reach")
    ready = await editor.text_document_prepare_rename_async(types.PrepareRenameParams(document(), here))
    assert ready.placeholder == "safe"
    edit = await editor.text_document_rename_async(types.RenameParams(document(), here, "calm"))
    assert len(edit.changes[URI]) == WILDFIRE.count("safe")
    with pytest.raises(Exception, match="`always` is a reserved word"):
        await editor.text_document_rename_async(types.RenameParams(document(), here, "always"))


@pytest.mark.asyncio
async def test_a_text_that_is_closed_has_no_findings(editor: LanguageClient) -> None:
    opens(editor, "missoin x")
    assert await checked(editor) != []
    editor.text_document_did_close(types.DidCloseTextDocumentParams(document()))
    assert await checked(editor) == []
    assert await editor.text_document_hover_async(types.HoverParams(document(), types.Position(0, 0))) is None


@pytest.mark.asyncio
async def test_what_a_mission_includes_is_found_in_its_file(editor: LanguageClient, tmp_path: Path) -> None:
    site = tmp_path / "site.mission"
    site.write_text(
        "region base = box (0.2, 0.2) to (1.8, 1.8)\nregion spare = box (3, 3) to (4, 4)\n", encoding="utf-8"
    )
    text = (
        'mission main\ninclude "site.mission"\ntime step 1 s, horizon 10 s\nworld (0, 0) to (4, 4)\n'
        "team drone[2] { dynamics single_integrator(speed <= 2 m/s)  start in base }\n"
        "require stay: every drone: always[0, 5 s] base\n"
    )
    uri = (tmp_path / "main.mission").as_uri()
    opens(editor, text, uri)
    await asyncio.wait_for(editor.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS), 60)
    (finding,) = editor.diagnostics[uri]
    assert finding.range.start.line == 1
    assert finding.related_information is not None
    assert finding.related_information[0].location.uri == site.as_uri()
    here = types.TextDocumentIdentifier(uri)
    found = await editor.text_document_definition_async(types.DefinitionParams(here, place(text, "base\n")))
    assert (found.uri, found.range.start) == (site.as_uri(), types.Position(0, 7))
    with pytest.raises(Exception, match=r"declared in .*site.mission`: rename it there"):
        await editor.text_document_rename_async(types.RenameParams(here, place(text, "base\n"), "home"))
