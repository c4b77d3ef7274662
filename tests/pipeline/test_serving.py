"""`serve`: a preview in a process of its own, asked over HTTP."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest
from coursekit import GOOD, Folder, block, ended, wait_until_alone

Make = Callable[..., Folder]


class Preview:
    """A running `coursebuild serve`."""

    def __init__(self, folder: Folder, process: subprocess.Popen[bytes]) -> None:
        self.folder = folder
        self.process = process
        self.said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        first = self.heard("serving http://")
        self.port = int(first.partition("127.0.0.1:")[2].partition("/")[0])

    def _read(self) -> None:
        assert self.process.stderr is not None
        with contextlib.suppress(ValueError):  # closed at the end of the test
            for line in self.process.stderr:
                self.said.append(line.decode().rstrip("\n"))

    def heard(self, text: str, after: int = 0, seconds: float = 30.0) -> str:
        """The first line said that holds a text."""
        until = time.monotonic() + seconds
        while True:
            for line in self.said[after:]:
                if text in line:
                    return line
            assert time.monotonic() < until, f"{text!r} is not in {self.said}"
            assert self.process.poll() is None, self.said
            time.sleep(0.02)

    def get(
        self, path: str, method: str = "GET", **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        with contextlib.closing(connection):
            connection.putrequest(method, path, skip_host="Host" in headers)
            for name, value in headers.items():
                connection.putheader(name, value)
            connection.endheaders()
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()

    @contextlib.contextmanager
    def events(self) -> Iterator[Iterator[tuple[str, str]]]:
        """What an open page is told."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=30) as link:
            link.sendall(
                b"GET /.coursebuild/events HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n" % self.port
            )
            with link.makefile("rb") as stream:
                head = b""
                while not head.endswith(b"\r\n\r\n"):
                    head += stream.readline()
                assert head.startswith(b"HTTP/1.1 200 ")
                assert b"text/event-stream" in head
                yield _events(stream)


def _events(stream: Iterable[bytes]) -> Iterator[tuple[str, str]]:
    name = ""
    for raw in stream:
        line = raw.decode().rstrip("\r\n")
        assert line != ": still here", "nothing was told for 15 s"
        if line.startswith("event: "):
            name = line.removeprefix("event: ")
        elif line.startswith("data: "):
            yield name, line.removeprefix("data: ")


@contextlib.contextmanager
def serving(folder: Folder, *arguments: str) -> Iterator[Preview]:
    process = folder.start(
        "serve", "--port", "0", *arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with ended(process):
        yield Preview(folder, process)
    wait_until_alone(folder)


@pytest.fixture(scope="module")
def preview(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Iterator[Preview]:
    folder = Folder(tmp_path_factory.mktemp("served") / "a cöurse")
    folder.fill([GOOD + "![A](../pic%20ä.svg) and $x$\n"], stores)
    folder.write("content/pic ä.svg", '<svg xmlns="http://www.w3.org/2000/svg"/>')
    folder.write("secret.txt", "not of the site")
    with serving(folder) as running:
        running.heard("ready: ")
        yield running


def test_pages_and_files(preview: Preview) -> None:
    for path, kind, holds in (
        ("/", "text/html; charset=utf-8", b"Scratch"),
        ("/index.html", "text/html; charset=utf-8", b"Scratch"),
        ("/index.html?a=1#b", "text/html; charset=utf-8", b"Scratch"),
        ("/lessons/1.1-one.html", "text/html; charset=utf-8", b"hello 3.14159"),
        ("/examples/hello.py", "text/plain; charset=utf-8", b"print("),
        ("/files/pic%20%C3%A4.svg", "image/svg+xml", b"<svg"),
        ("/examples.zip", "application/zip", b"PK"),
        ("/.coursebuild/preview.js", "text/javascript; charset=utf-8", b"EventSource"),
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


def test_what_is_not_there(preview: Preview) -> None:
    status, headers, body = preview.get("/no/such/page.html")
    assert (status, headers["Content-Type"]) == (404, "text/html; charset=utf-8")
    assert b"There is no page at this address" in body
    assert b"/.coursebuild/preview.js" in body  # it comes back by itself once it is there


@pytest.mark.parametrize(
    "path",
    [
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
    ],
)
def test_nothing_but_the_site(preview: Preview, path: str) -> None:
    status, _, body = preview.get(path)
    assert status == 404
    assert b"not of the site" not in body and b"root:" not in body


def test_head(preview: Preview) -> None:
    for path in ("/", "/nothing", "/.coursebuild/events"):
        status, headers, body = preview.get(path, "HEAD")
        assert (status, body) == (404 if path == "/nothing" else 200, b"")
        assert headers["Content-Type"].startswith("text/")


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "NONSENSE"])
def test_other_methods(preview: Preview, method: str) -> None:
    assert preview.get("/", method)[0] == 501


@pytest.mark.parametrize(
    ("headers", "status"),
    [
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
    ],
)
@pytest.mark.parametrize("path", ["/", "/.coursebuild/events"])
def test_only_this_machine_is_answered(
    preview: Preview, headers: dict[str, str], status: int, path: str
) -> None:
    headers = {name: value.replace("PORT", str(preview.port)) for name, value in headers.items()}
    got, _, body = preview.get(path, "HEAD" if path != "/" else "GET", **headers)
    assert got == status
    if status == 403 and path == "/":
        assert body == b"this preview answers only on this machine\n"


def test_it_listens_on_the_loopback_only(preview: Preview) -> None:
    ports = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(FileNotFoundError):
            for row in Path(table).read_text().splitlines()[1:]:
                address, state = row.split()[1], row.split()[3]
                if state == "0A" and address.endswith(f":{preview.port:04X}"):
                    ports.append(address.partition(":")[0])
    assert ports == ["0100007F"]


def test_a_port_that_is_taken(preview: Preview) -> None:
    done = preview.folder.main("serve", "--port", str(preview.port))
    assert (done.status, done.out) == (2, "")
    assert f"port {preview.port} cannot be used: Address already in use" in done.err


# --- changes


def test_a_page_is_told_of_every_save(make: Make) -> None:
    folder = make(GOOD)
    page = "/lessons/1.1-one.html"
    with serving(folder) as preview, preview.events() as events:

        def told() -> tuple[str, str]:
            return next(events)

        assert told()[0] == "hello"
        if not [line for line in preview.said if line.startswith("ready")]:
            assert told()[0] == "reload"
        folder.replace(folder.lesson(), "## Hello\n", "## Hello again\n")
        assert told()[0] == "reload"
        assert b"Hello again" in preview.get(page)[2]
        folder.replace(folder.lesson(), "3.14159\n```", "3.14158\n```")
        name, data = told()
        assert name == "problems"
        assert json.loads(data).startswith("error[output-drift]: recorded output differs")
        assert b"Hello again" in preview.get(page)[2]  # the last good site
        with preview.events() as late:  # a page that is opened now is told as well
            assert [next(late)[0], next(late)] == ["hello", ("problems", data)]
        folder.replace(folder.lesson(), "3.14158\n```", "3.14159\n```")
        assert told()[0] == "reload"
        # As editors save: a new file takes the place of the old one.
        fresh = folder.root / "content/lessons/.1.1-one.md.swp"
        fresh.write_text(folder.text(folder.lesson()) + "By another file.\n")
        fresh.replace(folder.root / folder.lesson())
        assert told()[0] == "reload"
        assert b"By another file." in preview.get(page)[2]
        # A folder that was not there when the preview began.
        folder.write("models/ball.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
        assert told()[0] == "reload"
        assert preview.get("/models/ball.html")[0] == 200
        folder.write("models/ball.xml", "<mujoco><nosuch/></mujoco>")
        assert told()[0] == "problems"
        (folder.root / "models/ball.xml").unlink()
        assert told()[0] == "reload"
        # The map is gone, and back.
        map_ = folder.read("content/course.toml")
        (folder.root / "content/course.toml").unlink()
        assert "map-missing" in told()[1]
        folder.write("content/course.toml", map_)
        assert told()[0] == "reload"


def test_what_is_not_of_the_course_is_no_change(make: Make) -> None:
    folder = make(GOOD)
    with serving(folder) as preview:
        preview.heard("ready: ")
        before = len(preview.said)
        folder.write("notes.txt", "elsewhere")
        folder.write("examples/mine.txt", "derived")
        folder.write("content/lessons/.1.1-one.md.swp", "an editor's")
        folder.write("content/lessons/1.1-one.md~", "an editor's")
        folder.write("content/lessons/#1.1-one.md#", "an editor's")
        folder.write("content/lessons/4913", "an editor's")
        time.sleep(1.2)
        assert preview.said[before:] == []
        folder.write("content/public/pic.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>")
        assert "content/public" in preview.heard("changed: ", before)


def test_a_save_during_the_first_build_is_not_missed(make: Make) -> None:
    slow = "import time, pathlib\npathlib.Path('begun').touch()\ntime.sleep(0.7)\nprint(1)"
    folder = make("## First\n\n" + block("x.py", slow, "1"))
    with serving(folder) as preview:
        until = time.monotonic() + 20
        while not (folder.root / "begun").exists():
            assert time.monotonic() < until
            time.sleep(0.01)
        folder.replace(folder.lesson(), "## First", "## Second")
        preview.heard("changed: ")
        until = time.monotonic() + 20
        while b"Second" not in preview.get("/lessons/1.1-one.html")[2]:
            assert time.monotonic() < until
            time.sleep(0.05)


def test_a_course_that_is_wrong_from_the_beginning(make: Make) -> None:
    folder = make(GOOD + "[gone](lesson:7.7)\n")
    with serving(folder) as preview:
        preview.heard("error[link-lesson]")
        preview.heard("1 lesson")
        status, _, body = preview.get("/")
        assert status == 404
        assert b"Nothing is built yet" in body and b"/.coursebuild/preview.js" in body
        with preview.events() as events:
            assert [next(events)[0], next(events)[0]] == ["hello", "problems"]
            folder.write(folder.lesson(), GOOD)
            assert next(events)[0] == "reload"
        assert preview.get("/")[0] == 200
    assert not (folder.root / "public").exists()


# --- the end


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly(make: Make, number: int) -> None:
    folder = make(GOOD)
    with serving(folder) as preview, preview.events() as events:
        preview.heard("ready: ")
        preview.process.send_signal(number)
        assert preview.process.wait(10) == 0
        for _ in events:  # the stream ends
            pass
        preview._reader.join(5)
        assert preview.said[-1] == "stopped"
        assert "Traceback" not in "\n".join(preview.said)
        assert preview.process.stdout is not None and preview.process.stdout.read() == b""
    assert list(folder.tmp.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_it_ends_while_scripts_run(make: Make, number: int) -> None:
    slow = "import time, pathlib\npathlib.Path('begun').touch()\ntime.sleep(60)"
    folder = make("## One\n\n" + block("x.py", slow))
    with serving(folder) as preview:
        until = time.monotonic() + 20
        while not (folder.root / "begun").exists():
            assert time.monotonic() < until
            time.sleep(0.01)
        preview.process.send_signal(number)
        status = preview.process.wait(10)
        assert status == (-number if number == signal.SIGKILL else 0)
    wait_until_alone(folder)


def test_the_port_is_free_again(make: Make) -> None:
    folder = make(GOOD)
    with serving(folder) as preview:
        preview.heard("ready: ")
        preview.get("/")
        port = preview.port
        preview.process.send_signal(signal.SIGINT)
        assert preview.process.wait(10) == 0
    process = folder.start("serve", "--port", str(port), stderr=subprocess.PIPE)
    with ended(process):
        assert process.stderr is not None
        assert process.stderr.readline().startswith(b"serving http://127.0.0.1:%d/" % port)
