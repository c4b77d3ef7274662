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
from typing import Any

import pytest
from coursekit import GOOD, Folder, block, ended, wait_until_alone

from coursebuild.effects.server import PREFIX

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
        self, path: str, method: str = "GET", body: bytes = b"", **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        with contextlib.closing(connection):
            connection.putrequest(method, path, skip_host="Host" in headers)
            for name, value in headers.items():
                connection.putheader(name.replace("_", "-"), value)
            if body:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body or None)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()

    def accept(self, body: bytes, **headers: str) -> tuple[int, Any]:
        """What the server says to an acceptance; as JSON, or as text."""
        status, _, data = self.get(f"{PREFIX}accept", "POST", body, **headers)
        return status, json.loads(data) if data.startswith(b"{") else data.decode()

    @contextlib.contextmanager
    def events(self, page: str = "lessons/1.1-one.html") -> Iterator[Events]:
        """What an open page is told."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=30) as link:
            asked = f"GET {PREFIX}events?page={page} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}"
            link.sendall(f"{asked}\r\n\r\n".encode())
            with link.makefile("rb") as stream:
                head = b""
                while not head.endswith(b"\r\n\r\n"):
                    head += stream.readline()
                assert head.startswith(b"HTTP/1.1 200 ")
                assert b"text/event-stream" in head
                yield Events(_events(stream))


class Events:
    """The stream of one page, and what was told last."""

    def __init__(self, stream: Iterator[tuple[str, str]]) -> None:
        self.stream = stream
        self.hello: dict[str, str] = {}
        self.state = ""
        self.pages = 0
        self.news: dict[str, Any] = {}

    def until(self, good: Callable[[Events], bool]) -> Events:
        """Read on until something holds."""
        while not (self.hello and self.news and good(self)):
            name, data = next(self.stream, ("", ""))
            assert name, f"nothing was told for 15 s; the last was {self.state} {self.news}"
            match name:
                case "hello":
                    self.hello = json.loads(data)
                case "page":
                    self.state = json.loads(data)
                    self.pages += 1
                    self.news = {}  # it follows
                case "news":
                    self.news = json.loads(data)
                case _:
                    raise AssertionError(name)
        return self

    def rules(self) -> list[str]:
        return [problem["rule"] for problem in self.news["problems"]]

    def settled(self, *rules: str) -> Events:
        """All is known, and this is what is wrong."""
        return self.until(lambda told: told.news["busy"] == "" and told.rules() == [*rules])


def _events(stream: Iterable[bytes]) -> Iterator[tuple[str, str]]:
    name = ""
    for raw in stream:
        line = raw.decode().rstrip("\r\n")
        if line == ": still here":  # nothing was told for 15 s
            return
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
        running.heard("checked: ")
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
    styles = re.findall(r'href="(assets/[^"]+\.css)"', page)
    assert len(styles) == 1
    for path, kept in (
        (f"/{styles[0]}", "max-age=31536000, immutable"),
        ("/assets/nothing.00000000.css", "no-store"),
        ("/index.html", "no-store"),
    ):
        assert preview.get(path)[1]["Cache-Control"] == kept


def test_what_is_not_there(preview: Preview) -> None:
    status, headers, body = preview.get("/no/such/page.html")
    assert (status, headers["Content-Type"]) == (404, "text/html; charset=utf-8")
    assert b"There is no page at this address" in body
    assert b'data-page="no/such/page.html" data-state=""' in body  # it is told once it is there


def test_the_page_for_missing_addresses_has_its_style(make: Make) -> None:
    """It names everything from where the published site will be."""
    folder = make(GOOD)
    folder.replace("content/course.toml", "[course]", '[course]\nbase_url = "https://x.org/a/b"')
    with serving(folder) as preview:
        preview.heard("ready: ")
        status, _, body = preview.get("/no/such/page.html")
        found = re.findall(rb'<link rel="stylesheet" href="(/a/b/assets/[^"]+)">', body)
        assert (status, len(found)) == (404, 1)
        assert preview.get(found[0].decode())[1]["Content-Type"] == "text/css; charset=utf-8"
        assert b"Scratch" in preview.get("/a/b/")[2]


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


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "TRACE", "NONSENSE"])
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
        events.settled()
        assert events.news["scripts"] == [{"path": "examples/hello.py", "state": "ok"}]

        def shows(text: bytes) -> bool:
            return text in preview.get(page)[2]

        folder.replace(folder.lesson(), "## Hello\n", "## Hello again\n")
        state = events.state
        events.until(lambda told: told.state != state)
        assert shows(b"Hello again")
        folder.replace(folder.lesson(), "3.14159\n```", "3.14158\n```")
        events.settled("output-drift")
        assert shows(b"3.14158")  # the page is new, and says what is wrong with it
        folder.replace(folder.lesson(), "## Hello again\n", "## Never [x](lesson:9.9)\n")
        events.until(lambda told: "link-lesson" in told.rules())
        assert events.news["kept"]
        assert shows(b"Hello again") and not shows(b"Never")  # the last good page
        with preview.events("index.html") as late:  # a page that is opened now is told as well
            late.until(lambda told: "link-lesson" in told.rules())
        folder.write(folder.lesson(), GOOD)
        events.settled()
        assert shows(b"Hello") and not shows(b"Hello again")
        # As editors save: a new file takes the place of the old one.
        fresh = folder.root / "content/lessons/.1.1-one.md.swp"
        fresh.write_text(folder.text(folder.lesson()) + "By another file.\n")
        fresh.replace(folder.root / folder.lesson())
        state = events.state
        events.until(lambda told: told.state != state)
        assert shows(b"By another file.")
        # A folder that was not there when the preview began.
        folder.write("models/ball.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
        with preview.events("models/ball.html") as model:
            model.until(lambda told: told.state != "")
            folder.write("models/ball.xml", "<mujoco><nosuch/></mujoco>")
            events.settled("model-error")
            (folder.root / "models/ball.xml").unlink()
            events.settled()
            model.until(lambda told: told.state == "")
        # The map is gone, and back.
        map_ = folder.read("content/course.toml")
        (folder.root / "content/course.toml").unlink()
        events.until(lambda told: "map-missing" in told.rules())
        assert shows(b"By another file.")
        folder.write("content/course.toml", map_)
        events.settled()


def test_pages_elsewhere_are_watched(make: Make) -> None:
    folder = make(GOOD)
    entries = "".join(
        f'[[page]]\nid = "{id}"\ntitle = "Page"\nfile = "{path}"\n'
        for id, path in (("guide", "docs/guide.md"), ("readme", "README.md"))
    )
    folder.write("content/course.toml", folder.text("content/course.toml") + entries)
    folder.write("docs/guide.md", "One.\n")
    folder.write("README.md", "One.\n")
    with serving(folder) as preview:
        for page, path in (("guide.html", "docs/guide.md"), ("readme.html", "README.md")):
            with preview.events(page) as events:
                events.settled()
                folder.write(path, "Two.\n")
                state = events.state
                events.until(lambda told, state=state: told.state != state)  # type: ignore[misc]
                assert b"Two." in preview.get(f"/{page}")[2]


SAVES: dict[str, Callable[[Path, str], None]] = {}


def saver(function: Callable[[Path, str], None]) -> Callable[[Path, str], None]:
    SAVES[function.__name__] = function
    return function


@saver
def in_place(path: Path, text: str) -> None:
    path.write_text(text)


@saver
def in_pieces(path: Path, text: str) -> None:
    """Emptied first, then written bit by bit."""
    with path.open("w") as file:
        file.flush()
        for start in range(0, len(text), 20):
            file.write(text[start : start + 20])
            file.flush()


@saver
def with_a_backup(path: Path, text: str) -> None:
    """vim: the old file is moved away, a new one is written, the old one is removed."""
    backup = path.with_name(path.name + "~")
    path.rename(backup)
    path.write_text(text)
    backup.unlink()


@saver
def by_renaming(path: Path, text: str) -> None:
    fresh = path.with_name(f".#{path.name}.new")
    fresh.write_text(text)
    fresh.replace(path)


@saver
def gone_for_a_moment(path: Path, text: str) -> None:
    path.unlink()
    path.write_text(text)


def test_saves_of_every_editor_count_once(make: Make) -> None:
    folder = make(GOOD)
    with serving(folder) as preview, preview.events() as events:
        events.settled()
        for name, save in SAVES.items():
            state, before = events.state, len(preview.said)
            save(folder.root / folder.lesson(), GOOD.replace("## Hello", f"## {name}"))
            events.until(lambda told, state=state: told.state != state)  # type: ignore[misc]
            assert name.encode() in preview.get("/lessons/1.1-one.html")[2], name
            events.settled()
            told = [line for line in preview.said[before:] if not line.startswith("checked")]
            assert len(told) == 1 and told[0].startswith("changed: content/lessons/1.1-one.md (")


def test_a_switched_branch_is_one_change(make: Make) -> None:
    folder = make(*("## One\n" for _ in range(6)))
    for number in range(300):
        folder.write(f"content/pics/{number}.svg", '<svg xmlns="http://www.w3.org/2000/svg"/>')
    with serving(folder) as preview, preview.events() as events:
        events.settled()
        before = len(preview.said)
        for number in range(300):
            (folder.root / f"content/pics/{number}.svg").unlink()
        for number in range(1, 7):
            folder.write(folder.lesson(number), "## Two\n")
        state = events.state
        events.until(lambda told: told.state != state)
        for name in ("one", "six"):
            number = 1 + ("one", "two", "three", "four", "five", "six").index(name)
            assert b"Two" in preview.get(f"/lessons/1.{number}-{name}.html")[2]
        events.settled()
        changed = [line for line in preview.said[before:] if line.startswith("changed: ")]
        assert len(changed) == 1, changed


def test_two_browsers_and_one_that_was_away(make: Make) -> None:
    folder = make(GOOD, "## Two\n")
    with serving(folder) as preview:
        with preview.events() as one, preview.events() as two:
            one.settled()
            two.settled()
            assert one.state == two.state
            old = one.state
            folder.replace(folder.lesson(), "## Hello", "## Both")
            assert one.until(lambda told: told.state != old).state == (
                two.until(lambda told: told.state != old).state
            )
        folder.replace(folder.lesson(), "## Both", "## Later")
        with preview.events("lessons/1.2-two.html") as other:
            other.settled()
            assert other.pages == 1  # nothing of its own changed
        with preview.events() as back:
            assert back.until(lambda told: bool(told.state)).state not in (old, one.state)


def test_what_is_not_of_the_course_is_no_change(make: Make) -> None:
    folder = make(GOOD)
    with serving(folder) as preview:
        preview.heard("checked: ")
        before = len(preview.said)
        folder.write("notes.txt", "elsewhere")
        folder.write("examples/mine.txt", "derived")
        folder.write("content/lessons/.1.1-one.md.swp", "an editor's")
        folder.write("content/lessons/1.1-one.md~", "an editor's")
        folder.write("content/lessons/#1.1-one.md#", "an editor's")
        folder.write("content/lessons/4913", "an editor's")
        folder.write("content/public/pic.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>")
        preview.heard("changed: content/public", before)
        assert len([line for line in preview.said[before:] if line.startswith("changed: ")]) == 1


def test_a_save_during_the_first_runs_is_not_missed(make: Make) -> None:
    slow = "import time, pathlib\npathlib.Path('begun').touch()\ntime.sleep(0.7)\nprint(1)"
    folder = make("## First\n\n" + block("x.py", slow, "1"))
    with serving(folder) as preview, preview.events() as events:
        until = time.monotonic() + 20
        while not (folder.root / "begun").exists():
            assert time.monotonic() < until
            time.sleep(0.01)
        assert events.until(lambda told: bool(told.news["scripts"])).news["scripts"] == [
            {"path": "examples/x.py", "state": "running"}
        ]
        folder.replace(folder.lesson(), "## First", "## Second")
        events.until(lambda told: b"Second" in preview.get("/lessons/1.1-one.html")[2])
        events.settled()
        assert events.news["scripts"] == [{"path": "examples/x.py", "state": "ok"}]


def test_a_course_that_is_wrong_from_the_beginning(make: Make) -> None:
    folder = make(GOOD + "[gone](lesson:7.7)\n")
    page = "/lessons/1.1-one.html"
    with serving(folder) as preview:
        preview.heard("error[link-lesson]")
        status, _, body = preview.get(page)
        assert status == 200
        assert b"This page cannot be shown before its mistakes are mended." in body
        assert b"/.coursebuild/preview.js" in body
        assert b"Scratch" in preview.get("/")[2]
        with preview.events() as events:
            events.settled("link-lesson")
            assert events.state == ""
            folder.write(folder.lesson(), GOOD)
            events.until(lambda told: told.state != "")
        assert b"hello 3.14159" in preview.get(page)[2]
    assert not (folder.root / "public").exists()


def test_a_map_that_is_wrong_from_the_beginning(make: Make) -> None:
    folder = make(GOOD)
    good = folder.read("content/course.toml")
    folder.write("content/course.toml", "[course\n")
    with serving(folder) as preview, preview.events("index.html") as events:
        events.until(lambda told: told.rules() == ["map-syntax"])
        status, _, body = preview.get("/")
        assert status == 404
        assert b"Nothing is built yet." in body and b"/.coursebuild/preview.js" in body
        folder.write("content/course.toml", good)
        events.settled()
        assert preview.get("/")[0] == 200


# --- accepting


def test_an_output_is_accepted(make: Make) -> None:
    lesson = "## Random\r\n\r\n" + GOOD.replace("\n", "\r\n").replace(
        "3.14159\r\n```\r\n\r\n", "3\r\n```\r\n"
    )
    folder = make(lesson)
    with serving(folder) as preview, preview.events() as events:

        def offered(told: Events) -> bool:
            return any(output.get("offer") for output in told.news["outputs"])

        events.until(offered)
        (output,) = events.news["outputs"]
        assert (output["script"], output["nth"], output["state"]) == (
            "examples/hello.py",
            0,
            "drift",
        )
        assert output["rows"] == [
            ["-", [["hello ", False], ["3", True]]],
            ["+", [["hello ", False], ["3.14159", True]]],
        ]
        asked = {"page": "lessons/1.1-one.html", "id": output["offer"]}
        body = json.dumps(asked).encode()
        right = {
            "Origin": f"http://127.0.0.1:{preview.port}",
            "X_Coursebuild_Token": events.hello["token"],
        }
        before = folder.read(folder.lesson())
        alone = (403, "this preview answers only on this machine\n")
        older = (403, {"message": "this page is older than the preview; load it again"})
        unread = (400, {"message": "the request cannot be read"})
        gone = (409, {"message": "this is no longer what the page offers; look at it again"})
        for wrong, data, answer in (
            ({"Origin": ""}, body, alone),
            ({"Origin": "http://evil.example"}, body, alone),
            ({"Host": "evil.example"}, body, alone),
            ({"X_Coursebuild_Token": "x"}, body, older),
            ({"X_Coursebuild_Token": ""}, body, older),
            ({}, b"{", unread),
            ({}, b"[1]", unread),
            ({}, b'{"page": 1, "id": 2}', unread),
            ({}, b"x" * 70_000, unread),
            ({}, json.dumps({**asked, "id": "0" * 24}).encode(), gone),
            ({}, json.dumps({**asked, "page": "index.html"}).encode(), gone),
        ):
            headers = {name: value for name, value in (right | wrong).items() if value}
            assert preview.accept(data, **headers) == answer, (wrong, data[:40])
        assert folder.read(folder.lesson()) == before
        assert preview.accept(body, **right) == (200, {"message": ""})
        assert folder.read(folder.lesson()) == before.replace(b"hello 3\r", b"hello 3.14159\r")
        events.settled()
        assert events.news["outputs"][0]["state"] == "verified"


def test_what_changed_since_is_not_written(make: Make) -> None:
    folder = make(GOOD.replace("hello 3.14159", "hello 3"))
    with serving(folder) as preview, preview.events() as events:
        events.until(lambda told: any(o.get("offer") for o in told.news["outputs"]))
        id = events.news["outputs"][0]["offer"]
        # Somebody saves, and the server has not heard of it: another process holds its attention.
        preview.process.send_signal(signal.SIGSTOP)
        folder.replace(folder.lesson(), "## Hello", "## Mine")
        mine = folder.read(folder.lesson())
        preview.process.send_signal(signal.SIGCONT)
        body = json.dumps({"page": "lessons/1.1-one.html", "id": id}).encode()
        status, told = preview.accept(
            body,
            Origin=f"http://127.0.0.1:{preview.port}",
            X_Coursebuild_Token=events.hello["token"],
        )
        assert status == 409
        assert told["message"] in (
            "content/lessons/1.1-one.md was changed in the meantime",
            "this is no longer what the page offers; look at it again",
        )
        assert folder.read(folder.lesson()) == mine


def test_an_output_that_differs_from_run_to_run_is_not_offered(make: Make) -> None:
    code = "import time\nprint('took', time.time_ns())"
    folder = make("## Clock\n\n" + block("clock.py", code, "took 12"))
    with serving(folder) as preview, preview.events() as events:
        events.until(lambda told: any(o.get("refused") for o in told.news["outputs"]))
        (output,) = events.news["outputs"]
        assert output["offer"] is None
        assert output["refused"] == "two runs of the script printed different lines"


def test_a_bound_number_is_accepted(make: Make) -> None:
    folder = make(GOOD + "It is `3.15`{out}, nearly.\n")
    with serving(folder) as preview, preview.events() as events:
        events.until(lambda told: bool(told.news["numbers"]))
        (number,) = events.news["numbers"]
        assert (number["text"], number["nth"], number["better"]) == ("3.15", 0, "3.14")
        body = json.dumps({"page": "lessons/1.1-one.html", "id": number["offer"]}).encode()
        origin, token = f"http://localhost:{preview.port}", events.hello["token"]
        assert preview.accept(body, Origin=origin, X_Coursebuild_Token=token)[0] == 200
        assert folder.text(folder.lesson()) == GOOD + "It is `3.14`{out}, nearly.\n"
        events.settled()


# --- the end


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly(make: Make, number: int) -> None:
    folder = make(GOOD)
    with serving(folder) as preview, preview.events() as events:
        preview.heard("checked: ")
        preview.process.send_signal(number)
        assert preview.process.wait(10) == 0
        for _ in events.stream:  # it ends
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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_while_the_course_is_read(make: Make, number: int) -> None:
    folder = make(*(GOOD.replace("hello.py", f"hello{n}.py") + "$x$\n" * 500 for n in range(6)))
    with serving(folder) as preview:  # it has said where it will serve
        preview.process.send_signal(number)
        assert preview.process.wait(10) == 0
        preview._reader.join(5)
        assert preview.said[-1] == "stopped"
        assert "Traceback" not in "\n".join(preview.said)


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
