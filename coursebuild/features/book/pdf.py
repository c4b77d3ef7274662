"""The whole course as a PDF, printed from its page by a Chromium of the machine.

It is printed twice: the first PDF says on which page each lesson begins, the second has these
numbers in its contents. Chromium runs without a network, in a profile of its own. Pictures and
fonts are a stranger's, so it keeps its sandbox, which it has for every user but root. Its note of
the time of printing is replaced by one of the same length, for the same bytes.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from html import unescape
from pathlib import Path
from urllib.parse import unquote_to_bytes

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.context import ExportContext
from coursebuild.features.book.chapters import page_file

MARK = "/Keywords (coursebuild: the whole course"
"""The note that replaces that of the time."""
_PATH = "CHROME_PATH"
"""The variable of the environment that names another Chromium."""
_NAMES = """
    chromium chromium-browser google-chrome google-chrome-stable chrome chromium-headless-shell
    headless_shell microsoft-edge
""".split()
_MAC = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"
_OPTIONS = (
    *("--headless", "--disable-gpu", "--no-first-run", "--no-default-browser-check"),
    *("--disable-background-networking", "--disable-component-update", "--disable-extensions"),
    *("--disable-sync", "--disable-dev-shm-usage", "--host-resolver-rules=MAP * ~NOTFOUND"),
    *("--no-pdf-header-footer", "--generate-pdf-document-outline", "--export-tagged-pdf"),
)
_SECONDS = 600
"""How long printing may take."""
_ENTRY = re.compile(r'(<span class="book-page" data-at="([^"]*)">)(</span>)')
_TIMES = re.compile(rb"/CreationDate \([^()]*\)\s*/ModDate \([^()]*\)")
_DESTINATION = re.compile(rb"/([^\s/\[\]()<>]+) \[(\d+) 0 R /XYZ")
_OBJECT = re.compile(rb"(?:^|\n)(\d+) 0 obj\n(<<.*?)\nendobj", re.DOTALL)
_KIDS = re.compile(rb"/Kids \[([^\]]*)\]")
_ROOT = re.compile(rb"/Type /Catalog\s+/Pages (\d+) 0 R")


def pdf_file(context: ExportContext) -> OutputFile:
    """Return the PDF.

    Raises:
        EffectError: there is no Chromium, or it does not print.
    """
    choice = os.environ.get(_PATH, "")
    candidates = [choice] if choice else [*_NAMES, _MAC]
    program = next(filter(None, map(shutil.which, candidates)), None)
    if program is None:
        message = f"`{choice}`, which {_PATH} names, is not a program" if choice else ""
        raise EffectError(
            message or "`export pdf` prints with Chromium, and there is none on this machine",
            help=f"install Chromium or Chrome, or name one in the variable {_PATH}; or print the "
            "page of `coursebuild export page` in any browser",
        )
    html = page_file(context, page_numbers=True).data.decode()
    with tempfile.TemporaryDirectory(prefix="coursebuild-pdf-") as folder:
        first = _print(program, Path(folder), _with_numbers(html, {}))
        data = _print(program, Path(folder), _with_numbers(html, _page_numbers(first)))
    times = _TIMES.search(data, 0, 4096)
    if times is not None:
        note = f"{MARK})".encode().ljust(len(times[0]))
        data = data[: times.start()] + note + data[times.end() :]
    return OutputFile("course.pdf", data)


def _print(program: str, folder: Path, html: str) -> bytes:
    page, pdf = folder / "course.html", folder / "course.pdf"
    page.write_text(html, encoding="utf-8")
    pdf.unlink(missing_ok=True)
    options = [*_OPTIONS, f"--user-data-dir={folder / 'profile'}", f"--print-to-pdf={pdf}"]
    if os.geteuid() == 0:  # Chromium refuses to start otherwise
        options.append("--no-sandbox")
    names = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH")
    environment = {name: os.environ[name] for name in names if name in os.environ}
    environment |= {"HOME": str(folder), "TMPDIR": str(folder), "TZ": "UTC"}
    try:
        process = subprocess.Popen(
            [program, *options, page.as_uri()],
            env=environment,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    except OSError as error:
        raise EffectError(f"{program} cannot be started: {reason(error)}") from None
    try:
        _, errors = process.communicate(timeout=_SECONDS)
    except subprocess.TimeoutExpired:
        raise EffectError(
            f"{program} has not printed the course in {_SECONDS} s",
            help="print the page of `coursebuild export page` in parts",
        ) from None
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    data = pdf.read_bytes() if pdf.is_file() else b""
    if not data.startswith(b"%PDF-"):
        lines = errors.decode(errors="replace").strip().splitlines()
        cause = lines[-1][:300] if lines else f"its status is {process.returncode}"
        raise EffectError(
            f"{program} did not print the course: {cause}",
            help="where its sandbox cannot start, as in some containers, print the page of "
            "`coursebuild export page` elsewhere",
        )
    return data


def _with_numbers(html: str, numbers: Mapping[str, int]) -> str:
    """The page with numbers in its contents; three digits stand for those not known yet."""
    return _ENTRY.sub(
        lambda entry: f"{entry[1]}{numbers.get(unescape(entry[2]), '000')}{entry[3]}", html
    )


def _page_numbers(pdf: bytes) -> dict[str, int]:
    objects = {int(number): text for number, text in _OBJECT.findall(pdf)}
    root = _ROOT.search(pdf)
    pages = {} if root is None else {p: n for n, p in enumerate(_pages(objects, int(root[1])), 1)}
    names = (
        (unquote_to_bytes(name.replace(b"#", b"%")).decode(errors="replace"), int(page))
        for name, page in _DESTINATION.findall(pdf)
    )
    return {name: pages[page] for name, page in names if page in pages}


def _pages(objects: Mapping[int, bytes], number: int, depth: int = 0) -> Iterator[int]:
    kids = _KIDS.search(objects.get(number, b""))
    if kids is None or depth > 50:
        yield number
        return
    for kid in re.findall(rb"(\d+) 0 R", kids[1]):
        yield from _pages(objects, int(kid), depth + 1)
