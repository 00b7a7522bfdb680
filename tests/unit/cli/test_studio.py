"""The studio's server: strangers get nothing, and a file changes only when its user saves it."""

from __future__ import annotations

import os
import re
import secrets
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

pytest.importorskip("websockets")

from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.cli.app import main
from missionc.frontend.syntax.tokens import WORDS
from missionc.tools.language_server.open_text import Outline
from missionc.tools.language_server.scene.scene import scene
from missionc.tools.studio.session import COLOURS, session_words
from tests.support.small_missions import SMALL, WRONG
from tests.support.studio_server import Page, Serving, studio
from tests.support.watch_process import until

GALLERY = Path(__file__).resolve().parents[3] / "missions" / "gallery"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


@pytest.fixture
def serving(home: Path) -> Iterator[Serving]:
    with studio(home, SMALL) as found:
        yield found


@pytest.fixture
def page(serving: Serving) -> Iterator[Page]:
    with serving.page() as found:
        yield found


# --------------------------------------------------------------------- strangers


def test_the_page_is_there_for_who_knows_the_token_and_may_load_nothing_from_elsewhere(serving: Serving) -> None:
    status, content, headers = serving.get()
    nonce = re.search(rb'name="csp-nonce" content="([\w-]{16})"', content)
    assert status == 200
    assert nonce
    policy = headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; script-src 'self'; ")
    assert f"'nonce-{nonce[1].decode()}'" in policy
    assert "unsafe" not in policy.replace("style-src-attr 'unsafe-inline'", "")
    assert headers["cache-control"] == "no-store"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "access-control-allow-origin" not in headers
    assert serving.get()[2]["content-security-policy"] != policy


def test_a_guessed_token_gets_nothing_and_not_even_word_of_what_is_there(serving: Serving) -> None:
    token = serving.server.guard.token
    guesses = ["", token[:-1], f"{token}x", token.swapcase(), secrets.token_urlsafe(24), "%00", "%C3%A4"]
    names = ("", "studio.js", "no")
    answers = {serving.get(f"/{guess}/{name}")[:2] for guess in guesses for name in names}
    assert answers == {(403, b"forbidden\n")}
    assert serving.get("/")[:2] == (403, b"forbidden\n")


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "[::1]:{port}", "evil.example:{port}", ""]
)
def test_another_host_gets_nothing_so_that_no_name_can_be_rebound_to_this_machine(serving: Serving, host: str) -> None:
    port = serving.server.guard.port
    assert serving.get(Host=host.format(port=port))[0] == 403
    assert serving.get(Host=f"localhost:{port}")[0] == 200


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_request_that_another_sites_page_makes_gets_nothing(serving: Serving, site: str) -> None:
    assert serving.get(Sec_Fetch_Site=site)[0] == 403
    assert serving.get(Sec_Fetch_Site="none")[0] == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}", None]
)
def test_a_socket_is_opened_for_no_other_origin(serving: Serving, origin: str | None) -> None:
    named = origin and origin.format(port=serving.server.guard.port)
    address = serving.address.replace("http", "ws") + "socket"
    with pytest.raises(InvalidStatus, match="403"), connect(address, origin=named):  # type: ignore[arg-type]
        pass


def test_a_socket_is_opened_for_no_other_token(serving: Serving) -> None:
    netloc = urlsplit(serving.address).netloc
    with pytest.raises(InvalidStatus, match="403"), connect(f"ws://{netloc}/guessed/socket", origin=f"http://{netloc}"):  # type: ignore[arg-type]
        pass


@pytest.mark.parametrize(
    "way", ["../a.mission", "a.mission", "..%2fguard.py", "studio.js/../session.py", "/etc/passwd"]
)
def test_no_path_leads_to_a_file_that_is_no_part_of_the_page(serving: Serving, way: str) -> None:
    status, content, _ = serving.get(f"/{serving.server.guard.token}/{way}")
    assert (status, content) in [(404, b"not found\n"), (403, b"forbidden\n")]


def test_a_message_of_more_than_a_mebibyte_ends_the_socket(serving: Serving) -> None:
    from websockets.exceptions import ConnectionClosed

    with serving.page() as page, pytest.raises(ConnectionClosed):
        page.ask("studio/save", text="x" * (1 << 20))
    assert serving.get()[0] == 200


def test_messages_that_are_none_are_passed_over(page: Page) -> None:
    for nonsense in ("", "{", "[]", "17", '{"method": 3}', '{"method": "exit"}', "[" * 100_000):
        page.socket.send(nonsense)
    assert page.ask("studio/none")["error"]["code"] == -32601
    assert page.ask("studio/open", shelf="elsewhere", name="a")["error"]["code"] == -32602
    assert page.ask("studio/save", text=3)["error"]["code"] == -32602
    assert page.ask("studio/save", text="\ud800")["error"]["code"] == -32602
    assert page.ask("studio/begin")["name"] == "a.mission"


# --------------------------------------------------------------------- open and save


def test_nothing_is_written_before_the_user_saves(home: Path, page: Page) -> None:
    before = (home / "a.mission").stat()
    uri = page.open_text(SMALL + "# more\n")
    assert page.hear("studio/scene")["uri"] == uri
    assert page.hear("textDocument/publishDiagnostics")["diagnostics"] == []
    assert (home / "a.mission").read_text() == SMALL
    assert (home / "a.mission").stat() == before
    assert [path.name for path in home.iterdir()] == ["a.mission"]


def test_a_save_writes_the_text_and_keeps_how_its_lines_end(home: Path) -> None:
    with studio(home, "\ufeff" + SMALL.replace("\n", "\r\n")) as serving, serving.page() as page:
        assert page.ask("studio/begin")["text"] == SMALL
        assert page.ask("studio/save", text=SMALL + "# ä\n")["problem"] == ""
    assert (home / "a.mission").read_bytes() == ("\ufeff" + (SMALL + "# ä\n").replace("\n", "\r\n")).encode()


def test_a_file_that_changed_meanwhile_is_replaced_only_when_the_user_says_so(home: Path, page: Page) -> None:
    file = home / "a.mission"
    assert page.ask("studio/save", text="# mine\n")["problem"] == ""
    file.write_text("# theirs\n")
    assert page.ask("studio/save", text="# mine again\n") == {"problem": "changed"}
    assert file.read_text() == "# theirs\n"
    assert page.ask("studio/reload")["text"] == "# theirs\n"
    file.unlink()
    assert page.ask("studio/save", text="# mine again\n") == {"problem": "changed"}
    assert not file.exists()
    assert page.ask("studio/save", text="# mine again\n", replace=True)["problem"] == ""
    assert file.read_text() == "# mine again\n"


def test_another_name_lies_in_the_folder_and_replaces_nothing_unasked(home: Path, page: Page) -> None:
    (home / "b.mission").write_text("# theirs\n")
    assert page.ask("studio/save", text="# mine\n", name="b") == {"problem": "exists"}
    assert (home / "b.mission").read_text() == "# theirs\n"
    assert page.ask("studio/save", text="# mine\n", name="b", replace=True)["name"] == "b.mission"
    assert page.ask("studio/save", text="# mine two\n")["problem"] == ""
    assert (home / "b.mission").read_text() == "# mine two\n"
    assert (home / "a.mission").read_text() == SMALL


@pytest.mark.parametrize("name", ["../b", "/tmp/b.mission", "sub/b", ".b", "a\0b", "a\nb", "..\\b", "x" * 300, ".."])
def test_a_name_that_leads_out_of_the_folder_is_refused(home: Path, page: Page, name: str) -> None:
    (home / "sub").mkdir()
    answer = page.ask("studio/save", text="# mine\n", name=name)
    assert (answer["problem"], answer["code"]) == ("refused", "MC702")
    assert sorted(path.name for path in home.rglob("*")) == ["a.mission", "sub"]
    assert not (home.parent / "b.mission").exists()


def test_a_link_that_leads_out_of_the_folder_is_neither_listed_nor_written_through(home: Path, page: Page) -> None:
    outside = home.parent / "outside.mission"
    outside.write_text("# secret\n")
    (home / "link.mission").symlink_to(outside)
    assert [entry["name"] for entry in page.ask("studio/lists")["folder"]] == ["a.mission"]
    assert page.ask("studio/open", shelf="folder", name="link.mission")["code"] == "MC002"
    assert page.ask("studio/save", text="# mine\n", name="link", replace=True)["code"] == "MC702"
    assert outside.read_text() == "# secret\n"


def test_a_text_that_is_too_large_is_not_saved(home: Path, page: Page) -> None:
    answer = page.ask("studio/save", text="#" * (Limits().file_bytes + 1))
    assert (answer["problem"], answer["code"]) == ("refused", "MC004")
    assert (home / "a.mission").read_text() == SMALL


def test_what_is_opened_from_the_gallery_or_a_template_is_a_text_without_a_file(home: Path, page: Page) -> None:
    lists = page.ask("studio/lists")
    gallery = {entry["name"]: entry["about"] for entry in lists["gallery"]}
    assert gallery["mountain_rescue"].endswith(".")
    copy = page.ask("studio/open", shelf="gallery", name="factory_lanes")
    assert (copy["saved"], copy["named"]) == (False, False)
    assert page.ask("studio/save", text=copy["text"]) == {"problem": "unnamed"}
    template = page.ask("studio/open", shelf="template", name=lists["template"][0]["name"])
    assert page.ask("studio/save", text=template["text"], name="mine")["problem"] == ""
    assert (home / "mine.mission").read_text() == template["text"]


def test_what_a_gallery_mission_includes_is_found_and_saved_with_it(home: Path, page: Page) -> None:
    copy = page.ask("studio/open", shelf="gallery", name="factory_lanes")
    saved = page.ask("studio/save", text=copy["text"], name="mine")
    assert saved["beside"] == ["factory_lanes.graphml"]
    assert (home / "factory_lanes.graphml").read_text().startswith("<?xml")
    assert main(["check", str(home / "mine.mission")]) == 0


def test_only_the_text_that_is_open_is_read_by_the_language_server(home: Path, page: Page) -> None:
    (home.parent / "secret.mission").write_text("region hidden = box (0, 0) to (1, 1)\n")
    page.open_text(SMALL)
    page.hear("textDocument/publishDiagnostics")
    other = (home.parent / "x.mission").as_uri()
    document = {"uri": other, "languageId": "mission", "version": 1, "text": 'include "secret.mission"\n'}
    page.send({"method": "textDocument/didOpen", "params": {"textDocument": document}})
    assert page.ask("textDocument/documentSymbol", textDocument={"uri": other}) == []


# --------------------------------------------------------------------- compile


def test_the_text_as_it_stands_is_compiled_and_kept_where_the_user_says(
    home: Path, serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(home)
    with serving.page() as page:
        page.open_text(SMALL.replace("mission small", "mission typed"))
        assert page.ask("studio/keep") == {"problem": "refused", "says": "no plan to save"}
        page.ask("studio/compile")
        ended = page.hear("studio/ended")
        assert (ended["status"], ended["findings"], ended["version"]) == (0, [], 1)
        assert ended["lines"][0].startswith("typed: verified in ")
        status, report, headers = serving.get(f"/{serving.server.guard.token}/{ended['report']}")
        assert (status, headers["content-security-policy"]) == (200, "sandbox allow-scripts; frame-ancestors 'self'")
        assert b"<title>typed" in report
        assert os.listdir(home) == ["a.mission"]

        assert page.ask("studio/keep")["problem"] == ""
        assert (home / "build" / "typed" / "report.html").read_bytes() == report
        assert page.ask("studio/keep")["problem"] == "exists"
        assert page.ask("studio/keep", replace=True)["problem"] == ""
    assert main(["verify", "build/typed"]) == 0
    assert (home / "a.mission").read_text() == SMALL


def test_of_a_page_that_is_closed_amid_a_compilation_nothing_is_left(home: Path, serving: Serving) -> None:
    with serving.page() as page:
        page.open_text(SMALL)
        page.ask("studio/compile")
        assert page.ask("studio/stop") == {}
        page.ask("studio/compile")
    until(lambda: not any("planning" in thread.name for thread in threading.enumerate()), "the end of the planner")
    assert list((home.parent / "plans").iterdir()) == []


# --------------------------------------------------------------------- the scene


def drawn(text: str) -> dict[str, Any]:
    source = Source("/a/b.mission", text)
    found = scene(source, Outline.of(source, Limits()).declarations, Limits())
    assert found is not None
    return found


def thing(text: str, name: str) -> dict[str, Any]:
    return next(each for each in drawn(text)["things"] if each["name"] == name)


def quoted(text: str, number: dict[str, Any]) -> str:
    start, end = number["span"]
    return text.encode("utf-16-le")[2 * start : 2 * end].decode("utf-16-le")


def test_each_number_of_a_shape_is_where_it_stands_in_the_text_in_its_own_unit() -> None:
    text = SMALL.replace("(0.2, 0.2) to (1.8, 1.8)", "(-0.25, 200 mm) to (1.80 m, 18e-1)").replace(
        "small", "small  # \U0001f681"
    )
    (piece,) = thing(text, "base")["pieces"]
    numbers = [number for point in piece["points"] for number in point]
    assert [quoted(text, number) for number in numbers] == ["-0.25", "200", "1.80", "18e-1"]
    assert [number["metres"] for number in numbers] == [-0.25, 0.2, 1.8, 1.8]
    assert [number["unit"] for number in numbers] == [1.0, 1e-3, 1.0, 1.0]
    assert [number["decimals"] for number in numbers] == [2, 0, 2, 0]


def test_what_comes_from_elsewhere_is_drawn_and_says_why_it_cannot_be_dragged() -> None:
    text = SMALL.replace("world", "param wide = 1.5 m\nworld").replace("(1.8, 1.8)", "(wide, 0.3 + wide)")
    (piece,) = thing(text, "base")["pieces"]
    x, y = piece["points"][1]
    assert (x["metres"], x["fixed"]) == (1.5, "its value is the parameter wide")
    assert (y["metres"], y["fixed"]) == (1.8, "its value is computed")


def test_each_part_of_a_combined_shape_is_a_piece_and_the_whole_is_filled() -> None:
    found = thing(SMALL + "region ring = disc at (2, 2) radius 1 - box (1.5, 1.5) to (2.5, 2.5) + goal\n", "ring")
    assert [piece["form"] for piece in found["pieces"]] == ["disc", "box"]
    assert any(len(part.get("rings", [])) == 2 for part in found["parts"])


def test_a_map_is_drawn_of_a_text_that_is_half_written() -> None:
    text = WRONG + "require half: every drone: always[0, \nobstacle wall = polygon (0, 0), (1, 1), (1, 0), (0, 1)\n"
    found = {each["name"]: each for each in drawn(text)["things"]}
    assert {"base", "goal", "wall"} <= found.keys()
    assert found["wall"]["parts"] == []
    assert len(found["wall"]["pieces"][0]["points"]) == 4


def test_starts_beacons_and_ways_are_on_the_map() -> None:
    text = SMALL.replace("start    in base", "start at (1, 1), (1.5, 1)\n  finish line (3, 3) to (3.5, 3)")
    text += "beacon mast = (2, 3)\nobstacle cart = disc at (0.5, 3) radius 0.1 moving (0.5, 0) m/s\n"
    found = {(each["kind"], each["name"]): each for each in drawn(text)["things"]}
    assert [piece["form"] for piece in found["start", "drone"]["pieces"]] == ["point", "point"]
    assert found["finish", "drone"]["agents"] == [[3.0, 3.0], [3.5, 3.0]]
    assert found["beacon", "mast"]["pieces"][0]["form"] == "point"
    assert found["obstacle", "cart"]["way"] == [[0.0, 0.0], [3.0, 0.0]]
    assert next(each for each in drawn(SMALL)["things"] if each["kind"] == "start")["region"] == "base"


def test_there_is_no_map_without_a_world_that_has_room() -> None:
    for text in ("", "world (0, 0) to (0, 4)\n", "world (0, 0)\n", "world (0, 0) to (1/0, 4)\n"):
        source = Source("/a/b.mission", text)
        assert scene(source, Outline.of(source, Limits()).declarations, Limits()) is None


def test_every_number_that_a_drag_may_edit_reads_as_what_is_drawn(subtests: pytest.Subtests) -> None:
    for file in sorted(GALLERY.glob("*.mission")):
        with subtests.test(file.stem):
            text = file.read_text(encoding="utf-8")
            found = 0
            for each in drawn(text)["things"]:
                for piece in each["pieces"]:
                    numbers = [number for point in piece["points"] for number in point]
                    for number in [*numbers, *([piece["radius"]] if piece["radius"] else [])]:
                        if "fixed" not in number:
                            assert float(quoted(text, number)) * number["unit"] == pytest.approx(number["metres"])
                            found += 1
            assert found > 0


def test_every_kind_of_word_has_a_colour() -> None:
    assert {word.says for word in WORDS} == COLOURS.keys()
    assert session_words()["kinds"]["G"] == session_words()["kinds"]["always"]


# --------------------------------------------------------------------- the command


def test_without_its_packages_the_command_says_how_to_install_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("missionc.cli.commands.studio.find_spec", lambda name: None)
    assert main(["studio"]) == 1
    assert "error[MC404]: the studio needs the package pygls" in (said := capsys.readouterr().err)
    assert "pip install 'missionc[studio]'" in said


def test_a_file_that_cannot_be_read_is_said_before_anything_is_served(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.mission").write_bytes(b"\0")
    os.mkfifo(tmp_path / "pipe.mission")
    assert main(["studio", str(tmp_path / "a.mission")]) == 1
    assert main(["studio", str(tmp_path / "pipe.mission")]) == 1
    assert main(["studio", str(tmp_path)]) == 2
    assert main(["studio", str(tmp_path / "no" / "a.mission")]) == 2
    assert capsys.readouterr().err.count("MC002") == 2
