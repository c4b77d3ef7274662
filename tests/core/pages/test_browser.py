"""Pages in a headless Chromium: what scripts add works, and nothing is lost without them.

What standards ask of pages, axe and the Nu checker, is in `tests/browser/test_standards.py`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, expect

from support.folder_server import served
from support.lab_page import until, watched
from support.model_reports import reports

pytestmark = pytest.mark.browser

Make = Callable[..., Any]

BODY = "".join(f"def f{i}(x):\n" + "    x = x + 1\n" * 14 + "    return x\n\n\n" for i in range(8))
WIDE = "a = " + " + ".join(["1.000"] * 40)
TEXT = "A number, `-6.0`{out=examples/a.py}, a footnote[^n] and a [link](page:about)."
LESSON = f"""## First part

Text with $x = y + z$ in it. {TEXT}

$$\\int_V x\\,dV$$

| Quantity | Value |
| --- | ---: |
| mass | 1.0 |

| Wide | Table |
| --- | --- |
| https://example.org/an/address/that/cannot/be/broken | supercalifragilisticexpialidocious |

> [!established] Title
> Text.

> [!derivation]- Folded
> Hidden at first.

> [!warning]
> Text.

> [!unverified]
> Text.

```python file=examples/a.py
\"\"\"Docstring.

Of some
length.
\"\"\"

import math
import sys

{BODY}
{WIDE}
```

Output:

```text
{WIDE}
-6.0
```

## Second part {{#second}}

```io
INPUT: a
PROCESS: b
OUTPUT: c
```

```mjcf fragment=worldbody
<body name="a"/> <!-- note -->
```

```sh
echo "x"  # said
```

```lab simlab
{{"model": "box", "dock": true, "title": "A lab", "note": "A note.",
 "controls": [{{"label": "m", "unit": "kg", "min": 0, "max": 1, "value": 0, "param": "m"}}],
 "readouts": [{{"label": "E (J)", "expr": "1"}}]}}
```

After the lab.

### Detail

## Check

```quiz
{{"id": "q", "title": "Check", "questions": [
 {{"kind": "mcq", "q": "Which?", "options": ["a", "b"], "answer": 1, "explain": "Because.",
  "hints": ["Look."], "feedback": ["No.", "Yes."]}},
 {{"kind": "numeric", "q": "How?", "answer": 1, "unit": "m^2", "explain": "So."}},
 {{"kind": "order", "q": "Sort.", "items": ["a", "b", "c"], "explain": "So."}},
 {{"kind": "open", "q": "Why?", "reference": "Since."}},
 {{"kind": "output", "q": "What?", "of": "examples/a.py", "line": 1, "explain": "So."}}]}}
```

[^n]: A note.
"""

PAGES = (
    "index.html",
    "lessons/0.1-falling.html",
    "lessons/1.2-later.html",
    "levels/1.html",
    "models/box.html",
    "numerics/index.html",
    "progress/index.html",
    "review/index.html",
    "about.html",
)
LESSON_PAGE = PAGES[1]


@pytest.fixture(scope="module")
def root(make: Make, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site on disk, below the path of its base address."""
    folder = tmp_path_factory.mktemp("served")
    for path, data in make(LESSON).site(reports=reports()).items():
        target = folder / "course" / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
    return folder


@pytest.fixture(scope="module")
def base(root: Path) -> Iterator[str]:
    with served(root, missing="course/404.html") as address:
        yield f"{address}course/"


@pytest.fixture
def browser(browsers: Mapping[str, Browser]) -> Browser:
    return browsers["plain"]


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        yield context


@pytest.mark.parametrize("place", ["http", "file"])
def test_pages_load_without_a_word_and_without_others(
    context: BrowserContext, base: str, root: Path, place: str
) -> None:
    page, said = watched(context)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    start = base if place == "http" else f"{root.as_uri()}/course/"
    for path in PAGES:
        page.goto(start + path)
        until(page, "document.fonts.status === 'loaded'")
        expect(page.locator("[data-tools] select")).to_have_count(1)  # the page's script ran
    assert said == []
    assert all(url.startswith(start) for url in asked)


def test_text_code_and_formulas_are_set_in_the_fonts_of_the_site(
    context: BrowserContext, base: str
) -> None:
    page = context.new_page()
    page.goto(base + LESSON_PAGE)
    until(page, "document.fonts.status === 'loaded'")
    loaded = page.evaluate(
        "[...document.fonts].filter(f => f.status === 'loaded').map(f => f.family)"
    )
    assert {name.strip('"') for name in loaded} >= {
        "Source Serif 4 Variable",
        "Source Code Pro Variable",
        "STIX Two Math",
    }


def test_the_page_for_missing_addresses_works_at_any_depth(
    context: BrowserContext, base: str
) -> None:
    page, said = watched(context)
    page.goto(base + "no/such/page.html")
    expect(page.locator("h1")).to_have_text("Page not found")
    expect(page.locator("body")).to_have_css("display", "flex")  # it has its style
    page.get_by_role("link", name="Go to the course map").click()
    page.wait_for_url(base)
    assert [text for text in said if "404" not in text] == []


BACKGROUND = "getComputedStyle(document.documentElement).backgroundColor"


def test_the_theme_is_kept_and_set_before_anything_is_drawn(
    context: BrowserContext, base: str
) -> None:
    page = context.new_page()
    page.goto(base + LESSON_PAGE)
    root = page.locator("html")
    light = page.evaluate(BACKGROUND)
    page.get_by_label("Colours").select_option("dark")
    expect(root).not_to_have_css("background-color", light)
    dark = page.evaluate(BACKGROUND)
    page.add_init_script(
        "addEventListener('DOMContentLoaded',"
        " () => window.early = document.documentElement.dataset.theme)"
    )
    page.goto(base + "about.html")
    assert page.evaluate("window.early") == "dark"
    expect(root).to_have_css("background-color", dark)
    expect(page.get_by_label("Colours")).to_have_value("dark")
    page.get_by_label("Colours").select_option("auto")
    until(page, "localStorage.length === 0")


def test_copying_takes_the_whole_script_and_not_its_output(
    context: BrowserContext, base: str, root: Path
) -> None:
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    page = context.new_page()
    page.goto(base + LESSON_PAGE)
    script = page.locator('.script[data-script="examples/a.py"]')
    assert script.locator("details").count() >= 1
    script.get_by_role("button", name="Copy").click()
    script.get_by_role("button", name="Copied").wait_for()
    text = page.evaluate("navigator.clipboard.readText()")
    assert text == (root / "course" / "examples" / "a.py").read_text()


def test_the_contents_list_follows_the_reader(context: BrowserContext, base: str) -> None:
    page = context.new_page()
    page.goto(base + LESSON_PAGE)
    current = page.locator(".toc [aria-current]")
    for anchor, title in (
        ("second", "Second part"),
        ("first-part", "First part"),
        ("check", "Check"),
    ):
        page.evaluate("id => document.getElementById(id).scrollIntoView()", anchor)
        expect(current).to_have_text([title])


def test_boxes_that_scroll_can_be_reached_and_others_are_no_stop(
    context: BrowserContext, base: str
) -> None:
    page = context.new_page()
    page.set_viewport_size({"width": 400, "height": 800})
    page.goto(base + LESSON_PAGE)
    output = page.locator(".output pre")
    until(page, "document.querySelector('.output pre').dataset.more === 'end'")
    expect(output).to_have_attribute("tabindex", "0")
    output.focus()
    page.keyboard.press("End")
    page.keyboard.press("ArrowRight")
    until(page, "document.querySelector('.output pre').scrollLeft > 0")
    until(page, "document.querySelector('.formula').tabIndex === -1")


def test_without_scripts_everything_is_there(browser: Browser, base: str) -> None:
    with browser.new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(base + LESSON_PAGE)
        expect(page.locator("main button, main select, main input")).to_have_count(0)
        answer = page.locator("details.answer").first
        expect(answer.get_by_text("Because.")).to_be_hidden()
        answer.locator("summary").click()
        expect(answer.get_by_text("Because.")).to_be_visible()
        folded = page.get_by_text("Hidden at first.")
        expect(folded).to_be_hidden()
        page.locator(".callout summary").click()
        expect(folded).to_be_visible()


def test_on_paper_everything_is_open_and_the_frame_is_gone(
    context: BrowserContext, base: str
) -> None:
    page = context.new_page()
    page.goto(base + LESSON_PAGE)
    page.emulate_media(media="print")
    for text in ("Hidden at first.", "Because.", "Look."):
        expect(page.get_by_text(text)).to_be_visible()
    for part in (".site-nav", ".toc", ".pager", ".copy"):
        expect(page.locator(part).first).to_be_hidden()


def test_the_keyboard_gets_past_the_head_at_once(context: BrowserContext, base: str) -> None:
    page = context.new_page()
    page.goto(base + LESSON_PAGE)
    page.keyboard.press("Tab")
    skip = page.locator(".skip")
    expect(skip).to_be_focused()
    expect(skip).to_be_in_viewport()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#_main$"))


def test_no_page_is_wider_than_its_window(context: BrowserContext, base: str) -> None:
    page = context.new_page()
    found = []
    for path in PAGES:
        page.goto(base + path)
        page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
        page.evaluate("document.documentElement.style.setProperty('--below', 'visible')")
        for width in (320, 360, 800, 1200, 1440):
            page.set_viewport_size({"width": width, "height": 800})
            needed = page.evaluate("document.documentElement.scrollWidth")
            if needed > width:
                found.append((path, width, needed))
    assert found == []
