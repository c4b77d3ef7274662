"""`serve`: who may read a preview and press its buttons, and what opens in an editor."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from coursebuild.preview.server import open_in_editor
from support.fixture_cases import fixture_tables, fixture_text
from support.lab_page import wait_for_condition
from support.live_course import Live
from support.live_course import live as live
from support.preview_page import LESSON
from support.preview_process import Preview, serve_preview
from support.scratch_course import GOOD, Folder, Make
from support.static_host import Host

pytestmark = pytest.mark.site


@pytest.fixture(scope="module")
def preview(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Preview]:
    """A preview that a browser was told of."""
    folder = Folder(tmp_path_factory.mktemp("served") / "a cöurse")
    folder.fill([GOOD], stores)
    with serve_preview(folder, "--open", env={"BROWSER": "true"}) as running:
        running.wait_for_line("checked: ")
        yield running


SITE, MODE, DEST = "Sec_Fetch_Site", "Sec_Fetch_Mode", "Sec_Fetch_Dest"
LINK = {SITE: "cross-site", MODE: "navigate", DEST: "document"}
PRIVATE = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


def test_other_origins_can_only_link_to_the_preview(preview: Preview) -> None:
    failures = []
    for path, method in (("/", "GET"), ("/search/index.js", "GET"), ("/", "POST"), ("/", "PUT")):
        for caller, status in fixture_tables("callers")["callers"]:
            headers = {n: v.replace("PORT", str(preview.port)) for n, v in caller.items()}
            got_status, answer_headers, body = preview.get(path, method, **headers)
            expected = {"GET": status, "PUT": 501}.get(method, 403)
            if method == "POST" and (status, *caller) == (200, "Origin"):
                expected = 405
            told_more = got_status == 403 and b"Scratch" in body
            if got_status != expected or told_more or answer_headers | PRIVATE != answer_headers:
                failures.append((path, method, caller, got_status, answer_headers))
    assert failures == []


def test_origin_that_may_embed_the_preview_shows_it_in_a_frame(make: Make) -> None:
    """Also for a course that will be published in a folder of a host."""
    origins = ("vscode-webview:", "https://*.example.org:8080")
    folder = make(GOOD)
    folder.replace("content/course.toml", "[course]", '[course]\nbase_url = "https://x.org/a/b"')
    with serve_preview(folder, *(f"--embed={origin}" for origin in origins)) as preview:
        frame_headers = {**LINK, DEST: "iframe"}
        cookie = preview.get(f"/?token={preview.token}", **frame_headers)[1]["Set-Cookie"]
        assert cookie.endswith("; HttpOnly; SameSite=None; Secure; Partitioned")
        status, headers, _ = preview.get("/", **frame_headers)
        policy = "frame-ancestors vscode-webview: https://*.example.org:8080"
        assert (status, headers["Content-Security-Policy"]) == (200, policy)
        assert preview.get("/", **{SITE: "cross-site", DEST: "script"})[0] == 403
        status, _, body = preview.get("/no/such/page.html")
        sheets = re.findall(rb'<link rel="stylesheet" href="(/a/b/assets/[^"]+)">', body)
        assert (status, len(sheets)) == (404, 1)
        assert preview.get(sheets[0].decode())[1]["Content-Type"] == "text/css; charset=utf-8"
        assert b"Scratch" in preview.get("/a/b/")[2]
    for bad_origin in ("example.org", "https://a;script-src *", "*"):
        result = folder.main("serve", "--embed", bad_origin)
        assert (result.status, "is not an origin" in result.err) == (2, True)


def test_whoever_asks_needs_the_token_of_the_link(preview: Preview) -> None:
    """On this machine too, at any address, and whatever name led to it."""
    denied = b"open the address that the terminal shows, which lets this browser in\n"
    paths = ["/", "/?token=x", "/?token=", "/lessons/1.1-one.html", "/.coursebuild/events", "//["]
    paths += [f"{paths[n]}{end}/service-worker.js" for n in (3, 4) for end in "?#"]
    for cookie in ("", "a=b", f"{preview.cookie}x", preview.cookie[:-1], preview.cookie[12:]):
        for path in (*paths, "http://evil.example?token=x"):
            status, headers, body = preview.get(path, Host="evil.example", Cookie=cookie)
            assert (status, body, headers | PRIVATE == headers) == (403, denied, True), path
        own_origin = {"Origin": "http://localhost", "Host": "localhost", "Cookie": cookie}
        for command in ("accept", "open", "else", "service-worker.js"):
            assert preview.get(f"/.coursebuild/{command}", "POST", b"{}", **own_origin)[0] == 403
    assert preview.get("/", Cookie=f"a=b; {preview.cookie}", Host="laptop.local")[0] == 200
    assert preview.get("/", **{SITE: "cross-site"})[0] == 403


def test_token_of_the_link_becomes_a_cookie(preview: Preview) -> None:
    away = {"Host": "laptop.local:8000", "Cookie": ""}
    for address in (
        "//evil.example/",
        "/%5Cevil.example/",
        "/\\evil.example/",
        "http://laptop.local:8000//evil.example/",
    ):
        link = f"{address}?a=1&token={preview.token}"
        status, headers, body = preview.get(link, **away, **LINK)
        (next_page,) = re.findall(r'content="0; url=(.+?)"', body.decode())
        assert (status, next_page) in ((200, "/evil.example/?a=1"), (200, "/%5Cevil.example/?a=1"))
        cookie, *rules = headers["Set-Cookie"].split("; ")
        assert (cookie, rules) == (preview.cookie, ["Path=/", "HttpOnly", "SameSite=Strict"])
    assert len(preview.token) == 32


def test_link_stays_good_after_a_restart(make: Make) -> None:
    """It belongs to the course and its user; without a place for a key it is made each time."""
    folder, other_folder = make(GOOD), make(GOOD, name="other")
    nowhere = {"XDG_STATE_HOME": str(folder.root)}
    tokens = []
    for course, env in ((folder, {}), (folder, {}), (other_folder, {}), *[(folder, nowhere)] * 2):
        with serve_preview(course, env=env) as preview:
            assert preview.get("/")[0] == 200
            tokens.append(preview.token)
    assert tokens[0] == tokens[1]
    assert len({*tokens}) == 4


def test_list_of_running_programs_does_not_tell_the_token(
    preview: Preview, held_back: Path
) -> None:
    for program in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            assert preview.token.encode() not in program.read_bytes()


def test_files_that_hold_the_link_are_the_users_own(preview: Preview) -> None:
    folder = Path(os.environ["XDG_STATE_HOME"], "coursebuild", "previews")
    files = [file for file in folder.iterdir() if preview.token in file.read_text()]
    assert {file.suffix for file in files} == {".json", ".html"}
    assert {file.stat().st_mode & 0o777 for file in files} == {0o600}
    assert folder.stat().st_mode & 0o777 == 0o700


def test_host_for_other_machines_is_said_and_listened_at(make: Make) -> None:
    with serve_preview(make(GOOD), "--host", "0.0.0.0") as preview:
        assert preview.get("/", Cookie="", Host="laptop.local")[0] == 403
        assert preview.get("/", Host="laptop.local")[0] == 200
        assert listening(preview) == ["00000000"]


def listening(preview: Preview) -> list[str]:
    """The addresses at which something listens on the preview's port."""
    addresses = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(FileNotFoundError):
            for row in Path(table).read_text().splitlines()[1:]:
                address, state = row.split()[1], row.split()[3]
                if state == "0A" and address.endswith(f":{preview.port:04X}"):
                    addresses.append(address.partition(":")[0])
    return addresses


def test_preview_listens_on_the_loopback_only(preview: Preview) -> None:
    assert listening(preview) == ["0100007F"]


# --- in browsers


@pytest.fixture
def browser(browsers: Mapping[str, Browser]) -> Browser:
    return browsers["plain"]


ATTACK = fixture_text("documents/attack.html")
STEAL = fixture_text("scripts/steal.js")


@pytest.mark.browser
def test_page_of_another_origin_can_only_link_to_the_preview(
    make: Make, browser: Browser, tmp_path: Path
) -> None:
    """From another site, and from another port of this one."""
    folder = make(GOOD + "![A](../pic.svg)\n")
    folder.write("content/pic.svg", '<svg xmlns="http://www.w3.org/2000/svg"/>')
    with Host(tmp_path) as host, serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        address = f"http://127.0.0.1:{preview.port}/"
        attack = ATTACK.replace("ADDRESS", address).replace("LINK", preview.link)
        (tmp_path / "index.html").write_text(attack)
        for url in (host.url, host.url.replace("localhost", "127.0.0.1")):
            with browser.new_context() as context:
                page = context.new_page()
                page.goto(preview.link)  # whoever has its cookie is safe as well
                expect(page.locator("h1").first).to_have_text("Scratch")
                page.goto(url)
                (frame,) = page.main_frame.child_frames
                wait_for_condition(page, lambda frame=frame: frame.url.startswith("chrome-error:"))
                answer = page.evaluate(STEAL, address)
                assert set(answer.values()) == {"refused"}, answer
                assert page.evaluate("window.draft") == "nothing"
                page.get_by_role("button", name="Go").click()
                expect(page.locator("body")).to_have_text(re.compile("of other origins"))
                page.go_back()
                page.get_by_role("link", name="Link").click()
                expect(page.locator("h1").first).to_have_text("Scratch")


FRAME = "<!DOCTYPE html><html lang=en><title>Editor</title><iframe src='{}'></iframe>"


@pytest.mark.browser
def test_preview_in_the_frame_of_an_editor_follows_and_accepts(
    make: Make, browser: Browser, tmp_path: Path
) -> None:
    """Browsers send no strict cookie from a frame in a page of another site."""
    folder = make(GOOD.replace("3.14159\n```", "3\n```"))
    with Host(tmp_path) as host, serve_preview(folder, "--embed", host.url.rstrip("/")) as preview:
        link = preview.link.replace("/?", f"/{LESSON}?")
        (tmp_path / "index.html").write_text(FRAME.format(link))
        with browser.new_context() as context:
            page = context.new_page()
            page.goto(host.url)
            frame = page.frame_locator("iframe")
            accept = frame.get_by_role("button", name="Accept this output")
            accept.click()
            expect(accept).to_have_count(0)
            frame.get_by_role("link", name="Scratch").first.click()
            expect(frame.locator("h1").first).to_have_text("Scratch")
    assert "hello 3.14159" in folder.text(folder.lesson())


def test_place_opens_in_each_kind_of_editor(
    make: Make, live: Callable[[Folder], Live], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = make("## One\n\nSee [x](lesson:9.9).\n")
    session = live(folder).session
    place = f"{folder.lesson()}:3:9"
    file = folder.root.resolve() / folder.lesson()
    bin, calls = tmp_path / "bin", tmp_path / "told"
    bin.mkdir()
    monkeypatch.setenv("PATH", str(bin))

    def arguments_of_editor(visual: str, editor: str = "") -> list[str]:
        monkeypatch.setenv("VISUAL", visual)
        monkeypatch.setenv("EDITOR", editor)
        calls.unlink(missing_ok=True)
        assert open_in_editor(session, place) == ""
        return calls.read_text().splitlines()

    def install(name: str, ends: int = 0) -> None:
        (bin / name).write_text(f'#!/bin/sh\nprintf "%s\\n" {name} "$@" > "{calls}"\nexit {ends}\n')
        (bin / name).chmod(0o755)

    assert open_in_editor(session, place) == (
        "no editor that opens a window was found: set VISUAL to one, such as `code`"
    )
    for name in ("code", "subl", "pycharm", "emacsclient", "gvim", "vim"):
        install(name)
    assert arguments_of_editor("code --wait") == ["code", "--wait", "--goto", f"{file}:3:9"]
    assert arguments_of_editor("", str(bin / "subl")) == ["subl", f"{file}:3:9"]
    assert arguments_of_editor("pycharm") == ["pycharm", "--line", "3", "--column", "9", str(file)]
    assert arguments_of_editor("emacsclient -n") == ["emacsclient", "-n", "+3:9", str(file)]
    assert arguments_of_editor("vim", "gvim") == ["gvim", "+3", str(file)]
    assert arguments_of_editor("vim", "not-there") == ["code", "--goto", f"{file}:3:9"]
    calls.unlink()
    for other_place in (f"{folder.lesson()}:3:8", "content/course.toml:1:1", "/etc/passwd:1:1", ""):
        assert open_in_editor(session, other_place) == "nothing is wrong there now"
    assert not calls.exists()
    install("gvim", ends=3)
    monkeypatch.setenv("VISUAL", "gvim")
    assert open_in_editor(session, place) == "gvim ended with status 3"
