"""`serve`: a preview in a process of its own, asked over HTTP."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from support.preview_process import Preview, serving
from support.scratch_course import GOOD, Folder

Make = Callable[..., Folder]
pytestmark = pytest.mark.site


@pytest.fixture(scope="module")
def preview(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Preview]:
    folder = Folder(tmp_path_factory.mktemp("served") / "a cöurse")
    folder.fill([GOOD + "![A](../pic%20ä.svg) and $x$\n"], stores)
    folder.write("content/pic ä.svg", '<svg xmlns="http://www.w3.org/2000/svg"/>')
    folder.write("secret.txt", "not of the site")
    with serving(folder) as running:
        running.heard("checked: ")
        yield running


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
    for path, kept in (
        (f"/{style}", "max-age=31536000, immutable"),
        ("/assets/nothing.00000000.css", "no-store"),
        ("/index.html", "no-store"),
    ):
        assert preview.get(path)[1]["Cache-Control"] == kept


def test_address_of_nothing_has_the_page_that_says_so(preview: Preview, make: Make) -> None:
    status, headers, body = preview.get("/no/such/page.html")
    assert (status, headers["Content-Type"]) == (404, "text/html; charset=utf-8")
    assert b"There is no page at this address" in body
    assert b'data-page="no/such/page.html" data-state=""' in body  # it is told once it is there
    folder = make(GOOD)  # it names everything from where the published site will be
    folder.replace("content/course.toml", "[course]", '[course]\nbase_url = "https://x.org/a/b"')
    with serving(folder) as other:
        other.heard("ready: ")
        status, _, body = other.get("/no/such/page.html")
        found = re.findall(rb'<link rel="stylesheet" href="(/a/b/assets/[^"]+)">', body)
        assert (status, len(found)) == (404, 1)
        assert other.get(found[0].decode())[1]["Content-Type"] == "text/css; charset=utf-8"
        assert b"Scratch" in other.get("/a/b/")[2]


OUTSIDE = (
    "/../secret.txt",
    "/lessons/../../secret.txt",
    "/%2e%2e/secret.txt",
    "/..%2fsecret.txt",
    "/%2e%2e%2f%2e%2e%2fetc/passwd",
    "//etc/passwd",
    "/etc/passwd",
    "/..%5csecret.txt",
    "/secret.txt%00.html",
    "/content/course.toml",
    "/public/index.html",
    "/.coursebuild/lock",
    "/.coursebuild-site",
    "file:///etc/passwd",
    "//[",
    "/%ff%fe",
    "*",
)


def test_nothing_but_the_site_is_served(preview: Preview) -> None:
    given = []
    for path in OUTSIDE:
        status, _, body = preview.get(path)
        if status != 404 or b"not of the site" in body or b"root:" in body:
            given.append((path, status))
    assert given == []


def test_head_has_no_body_and_other_methods_are_refused(preview: Preview) -> None:
    for path in ("/", "/nothing", "/.coursebuild/events"):
        status, headers, body = preview.get(path, "HEAD")
        assert (status, body) == (404 if path == "/nothing" else 200, b"")
        assert headers["Content-Type"].startswith("text/")
    methods = ("PUT", "DELETE", "OPTIONS", "TRACE", "NONSENSE")
    found = {method: preview.get("/", method)[0] for method in methods}
    assert found == dict.fromkeys(methods, 501)


CALLERS: tuple[tuple[dict[str, str], int], ...] = (
    ({"Host": "127.0.0.1:PORT"}, 200),
    ({"Host": "localhost:PORT"}, 200),
    ({"Host": "LOCALHOST:PORT"}, 200),
    ({"Host": "[::1]:PORT"}, 200),
    ({"Host": "127.0.0.1"}, 403),
    ({"Host": "127.0.0.1:1"}, 403),
    ({"Host": "evil.example:PORT"}, 403),
    ({"Host": "127.0.0.1.evil.example:PORT"}, 403),
    ({"Host": ""}, 403),
    ({"Origin": "http://evil.example"}, 403),
    ({"Origin": "null"}, 403),
    ({"Origin": "http://127.0.0.1:PORT"}, 200),
)


def test_only_this_machine_is_answered(preview: Preview) -> None:
    wrong = []
    for path, method in (("/", "GET"), ("/.coursebuild/events", "HEAD")):
        for given, status in CALLERS:
            port = str(preview.port)
            headers = {name: value.replace("PORT", port) for name, value in given.items()}
            got, _, body = preview.get(path, method, **headers)
            refused = body == b"this preview answers only on this machine\n"
            if got != status or (status == 403 and method == "GET" and not refused):
                wrong.append((path, given, got, body[:50]))
    assert wrong == []


def test_preview_listens_on_the_loopback_only(preview: Preview) -> None:
    ports = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(FileNotFoundError):
            for row in Path(table).read_text().splitlines()[1:]:
                address, state = row.split()[1], row.split()[3]
                if state == "0A" and address.endswith(f":{preview.port:04X}"):
                    ports.append(address.partition(":")[0])
    assert ports == ["0100007F"]


def test_port_that_is_taken_is_told(preview: Preview) -> None:
    done = preview.folder.main("serve", "--port", str(preview.port))
    assert (done.status, done.out) == (2, "")
    assert f"port {preview.port} cannot be used: Address already in use" in done.err
