"""`serve`: requests to a preview in a process."""

from __future__ import annotations

import contextlib
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path

import pytest

from support.fixture_cases import fixture_tables
from support.preview_process import Preview, serve_preview
from support.scratch_course import GOOD, WAIT_FOR_GO, Folder, Make, block, kill_at_end
from support.scratch_course import SECOND as SECOND_LESSON
from support.waiting import wait_for_file

pytestmark = pytest.mark.site


@pytest.fixture(scope="module")
def preview(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Preview]:
    """A preview that opens a browser, which records its arguments and the answer."""
    folder = Folder(tmp_path_factory.mktemp("served") / "a cöurse")
    folder.fill([GOOD + "![A](../pic%20ä.svg) and $x$\n"], stores)
    folder.write("content/pic ä.svg", '<svg xmlns="http://www.w3.org/2000/svg"/>')
    folder.write("secret.txt", "not of the site")
    browser = folder.tmp / "browser"
    browser.write_text(
        f"#!{sys.executable}\n"
        "import pathlib, re, sys, urllib.request as requests\n"
        "page = requests.urlopen(sys.argv[1]).read().decode()\n"
        "link = re.search('url=([^\"]+)', page)[1]\n"
        "status = requests.urlopen(link).status\n"
        "told = pathlib.Path(sys.argv[0]).with_name('told')\n"
        "told.with_suffix('.new').write_text(f'{sys.argv[1]} {link} {status}')\n"
        "told.with_suffix('.new').rename(told)\n"
    )
    browser.chmod(0o755)
    env = {"BROWSER": f"'{browser}' %s"}
    with serve_preview(folder, "--open", env=env) as running:
        running.wait_for_line("checked: ")
        yield running


def test_browser_is_opened_when_the_address_answers(preview: Preview) -> None:
    calls = preview.folder.tmp / "told"
    wait_for_file(calls)
    page, link, status = calls.read_text().split()
    assert (link, status) == (preview.link, "200")
    assert preview.token not in page  # all users can read the command that starts a browser


def test_pages_and_files_have_their_types(preview: Preview) -> None:
    for path, kind, holds in (
        ("/", "text/html; charset=utf-8", b"Scratch"),
        ("/index.html", "text/html; charset=utf-8", b"Scratch"),
        ("/index.html?a=1#b", "text/html; charset=utf-8", b"Scratch"),
        ("/lessons/1.1-one.html", "text/html; charset=utf-8", b"hello 3.14159"),
        ("/examples/hello.py", "text/plain; charset=utf-8", b"print("),
        ("/files/pic%20%C3%A4.svg", "image/svg+xml", b"<svg"),
        ("/examples.zip", "application/zip", b"PK"),
        ("/.coursebuild/preview.js", "text/javascript; charset=utf-8", b"EventSource"),
        ("/.coursebuild/preview.css", "text/css; charset=utf-8", b".preview-"),
    ):
        status, headers, body = preview.get(path)
        assert (status, headers["Content-Type"]) == (200, kind), path
        assert holds in body
        assert headers["Cache-Control"] == "no-store"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert int(headers["Content-Length"]) == len(body)
        assert (b"/.coursebuild/preview.js" in body) == kind.startswith("text/html")


def test_a_drawing_runs_nothing_and_loads_nothing_before_it_is_judged(preview: Preview) -> None:
    with contextlib.closing(HTTPConnection("127.0.0.1", preview.port)) as connection:
        cookie = {"Cookie": preview.cookie}
        connection.request("GET", "/files/pic%20%C3%A4.svg", headers=cookie)
        policies = connection.getresponse().headers.get_all("Content-Security-Policy", [])
    drawing = "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    assert policies == [drawing, "frame-ancestors 'none'"]


def test_every_address_of_a_page_is_there(preview: Preview) -> None:
    page = preview.get("/lessons/1.1-one.html")[2].decode()
    addresses = re.findall(r'(?:href|src)="([^"#]+)"', page)
    assert len(addresses) > 8
    for address in addresses:
        path = re.sub(r"^\.\./", "/", address)
        path = path if path.startswith("/") else f"/lessons/{path}"
        assert preview.get(path)[0] == 200, address


def test_what_has_its_hash_in_its_name_may_be_kept(preview: Preview) -> None:
    page = preview.get("/index.html")[2].decode()
    (style,) = re.findall(r'href="(assets/[^"]+\.css)"', page)
    for path, cache_control in (
        (f"/{style}", "max-age=31536000, immutable"),
        ("/assets/nothing.00000000.css", "no-store"),
        ("/index.html", "no-store"),
    ):
        assert preview.get(path)[1]["Cache-Control"] == cache_control


def test_address_of_nothing_has_the_page_that_says_so(preview: Preview) -> None:
    status, headers, body = preview.get("/no/such/page.html")
    assert (status, headers["Content-Type"]) == (404, "text/html; charset=utf-8")
    assert b"There is no page at this address" in body
    assert b'data-page="no/such/page.html" data-state=""' in body  # it is told when it connects


OUTSIDE_PATHS = fixture_tables("outside_paths")["paths"]


def test_nothing_but_the_site_is_served(preview: Preview) -> None:
    answers = []
    for path in OUTSIDE_PATHS:
        status, _, body = preview.get(path)
        if status != 404 or b"not of the site" in body or b"root:" in body:
            answers.append((path, status))
    assert answers == []


def test_head_has_no_body_and_other_methods_are_refused(preview: Preview) -> None:
    for path in ("/", "/nothing", "/.coursebuild/events"):
        status, headers, body = preview.get(path, "HEAD")
        assert (status, body) == (404 if path == "/nothing" else 200, b"")
        assert headers["Content-Type"].startswith("text/")
    methods = ("PUT", "DELETE", "OPTIONS", "TRACE", "NONSENSE")
    statuses = {method: preview.get("/", method)[0] for method in methods}
    assert statuses == dict.fromkeys(methods, 501)


HEAD = b"HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nCookie: COOKIE\r\n"
SECOND = b"GET /lessons/1.1-one.html " + HEAD + b"Connection: close\r\n\r\n"
LENGTH = b"Content-Length: %d\r\n" % len(SECOND)
BAD_LENGTHS = (
    *(b"", b"+5", b"-5", b"5 ", b"0x5", b"5,5", b"5;", b"5.0", b"1e1", b"1_0", b"\xb2", b"5 5"),
    b"65537",
    b"9" * 5000,
)
UNCLEAR_HEADERS = (
    *(b"Content-Length: %b\r\n" % length for length in BAD_LENGTHS),
    LENGTH + LENGTH,
    LENGTH + b"content-length: 0\r\n",
    LENGTH + b"Transfer-Encoding: chunked\r\n",
    b"Transfer-Encoding: chunked\r\n",
    b"transfer-encoding: identity\r\n",
    b"Transfer-Encoding : chunked\r\n",
    b"Content-Length : 5\r\n",
    b"X: a\r\n folded\r\n",
    b" X: a\r\n",
    b"X: a\n",
    b"X: a\rContent-Length: 5\r\n",
    b"X: a\0b\r\n",
    b"X\r\n",
    b": x\r\n",
    b"X: \x7f\r\n",
    b"Host: 127.0.0.1:PORT\r\n",
    b"host: evil.example\r\n",
    b"X: a\r\n" * 200,
    b"X: " + b"a" * 70_000 + b"\r\n",
    b"X:" + b" " * 60_000 + b"\0\r\n",
)
UNCLEAR_LINES = (
    b"GET / HTTP/1.1\nHost: 127.0.0.1:PORT\r\n",
    b"GET /\r\n",
    b"GET  / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n",
    b"GET /\tHTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n",
    b"GET / x HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n",
    b"GET /\xff HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n",
    b"GET / HTTP/2.0\r\nHost: 127.0.0.1:PORT\r\n",
    b"GET / HTTP/1.1 \r\nHost: 127.0.0.1:PORT\r\n",
    b"G\0T / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n",
    b"\r\nGET / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n",
)


def test_request_that_can_be_read_in_two_ways_is_refused(preview: Preview) -> None:
    """Each is followed by another one, which a proxy would take for its body or for its own."""
    heads = [b"%b / " % method + HEAD + h for h in UNCLEAR_HEADERS for method in (b"GET", b"POST")]
    failures = []
    for head in (*heads, *UNCLEAR_LINES):
        answer = preview.exchange(head + b"\r\n" + SECOND)
        if not re.match(rb"HTTP/1.1 4\d\d ", answer) or answer.count(b"HTTP/1.1 ") != 1:
            failures.append((head[:200], answer[:200]))
    assert failures == []


def test_body_of_a_request_is_never_the_next_request(preview: Preview) -> None:
    origin = b"Origin: http://127.0.0.1:PORT\r\n"
    for head, status in (
        (b"GET / " + HEAD + LENGTH, b"200"),
        (b"HEAD / " + HEAD + LENGTH, b"200"),
        (b"GET /nothing " + HEAD + LENGTH, b"404"),
        (b"GET / " + HEAD + b"Content-Length: 0\r\n", b"200"),
        (b"POST / " + HEAD + origin + LENGTH, b"405"),
        (b"POST / " + HEAD + origin, b"405"),
        (b"POST / " + HEAD + LENGTH, b"403"),
        (b"PUT / " + HEAD + LENGTH, b"501"),
        (b"GET /nothing " + HEAD, b"404"),
        (b"GET / HTTP/1.1\r\nHost: evil.example\r\n", b"403"),
    ):
        answer = preview.exchange(head + b"\r\n" + SECOND)
        assert answer.startswith(b"HTTP/1.1 %b " % status), head
        assert answer.count(b"HTTP/1.1 ") == 1, head
        assert b"Connection: close\r\n" in answer, head
    answer = preview.exchange(b"GET / " + HEAD + b"\r\n" + SECOND)
    assert answer.count(b"HTTP/1.1 200 ") == 2, "requests without a body share a connection"


def test_address_with_a_host_names_the_host_of_the_request(preview: Preview) -> None:
    for target, status in (
        ("http://127.0.0.1:PORT/lessons/1.1-one.html", 200),
        ("HTTP://127.0.0.1:PORT", 200),
        ("http://127.0.0.1/", 403),
        ("http://evil.example/", 403),
        ("https://evil.example:443/", 403),
        ("http://evil.example@127.0.0.1:PORT/", 403),
        ("http://127.0.0.1:PORT@evil.example/", 403),
        ("http:/127.0.0.1:PORT/", 403),
        ("http:", 403),
    ):
        address = target.replace("PORT", str(preview.port))
        assert preview.get(address, Host=f"127.0.0.1:{preview.port}")[0] == status, target


def test_port_or_host_that_cannot_be_had_is_told(preview: Preview, make: Make) -> None:
    """The port of another program, or of another course's preview; a host that is not there."""
    folder = make(GOOD)
    with socket.create_server(("127.0.0.1", 0)) as other_program:
        used_port = other_program.getsockname()[1]
        for course, host, port, reason in (
            (preview.folder, "127.0.0.1", used_port, "Address already in use"),
            (folder, "127.0.0.1", used_port, "Address already in use"),
            (folder, "127.0.0.1", preview.port, "Address already in use"),
            (preview.folder, "no.invalid", preview.port, "Name or service"),
        ):
            result = course.main("serve", "--host", host, "--port", str(port))
            assert (result.status, result.out) == (2, "")
            assert f"port {port} of {host} cannot be used: {reason}" in result.err


# --- beside it

PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}


def test_a_second_preview_says_where_the_first_is(make: Make) -> None:
    folder = make(GOOD)
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: ")
        for words in ((), ("--port", "0"), ("--port", str(preview.port))):
            second = folder.run("serve", *words)
            message = f"serving {preview.link} already (process {preview.process.pid})\n"
            assert (second.status, second.err) == (0, message)
        for words in (("--embed", "vscode-webview:"), ("--host", "localhost")):
            process = folder.start("serve", "--port", "0", *words, **PIPES)
            with kill_at_end(process):
                assert Preview(folder, process).port != preview.port
        assert folder.run("serve").status == 0, "others do not take its place"
        preview.process.kill()
        preview.process.wait()
    with serve_preview(folder) as preview:  # what it said means nothing now
        preview.wait_for_line("checked: ")


def test_commands_beside_a_preview_wait_only_for_what_they_need(make: Make) -> None:
    """A script that both need runs once, and nothing else holds up a command."""
    count = "pathlib.Path(f'runs/{time.time_ns()}').touch()\n"
    slow = block("slow.py", f"{WAIT_FOR_GO}{count}print(3)", "3", info="writes=runs/")
    folder = make(f"## Slow\n\n{slow}", SECOND_LESSON)
    (folder.root / "runs").mkdir()
    with serve_preview(folder) as preview:
        preview.wait_for_line("running examples/slow.py")
        for words in (("check", "1.2"), ("update", "1.2"), ("new", "lesson", "1.3", "Third")):
            result = folder.run(*words)
            assert (result.status, "slow.py" in result.err) == (0, False), (words, result)
        with kill_at_end(folder.start("check", "1.1", **PIPES)) as process:
            assert process.stderr is not None and process.stdout is not None
            for line in process.stderr:
                if b"another coursebuild is running examples/slow.py" in line:
                    break
            folder.write("go", "")
            assert b"ok       examples/slow.py  cached" in process.stdout.read()
            assert process.wait() == 0
        preview.wait_for_line("checked: everything holds")
        assert len([*(folder.root / "runs").iterdir()]) == 1
