"""A reader's progress in a browser: marks, going on, saving, bringing in, forgetting, reviewing."""

from __future__ import annotations

import datetime
import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from coursekit import Folder
from labcourse import PENDULUM
from labpage import comes, until, watched
from plainhost import served
from playwright.sync_api import Browser, BrowserContext, Locator, Page, Route
from readercourse import FILES, PUSH

KEY = "coursebuild.progress.motion"
PUSH_PAGE = "lessons/1.1-push.html"
FALL_PAGE = "lessons/1.2-fall.html"


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """The course, built."""
    folder = Folder(tmp_path_factory.mktemp("reader") / "course")
    folder.root.mkdir()
    folder.borrow(stores)
    for path, text in FILES.items():
        folder.write(path, text)
    folder.write("models/pendulum.xml", PENDULUM)
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    return folder


@pytest.fixture(scope="module")
def site(reader: Folder) -> Iterator[str]:
    """The address of the site."""
    with served(reader.root / "public") as address:
        yield address


@pytest.fixture
def calm(browsers: dict[str, Browser]) -> Iterator[BrowserContext]:
    """A window without a service worker, which would keep pages that a test changes."""
    size = {"width": 1000, "height": 800}
    with browsers["plain"].new_context(viewport=size, service_workers="block") as context:
        yield context


def opened(context: BrowserContext, address: str) -> Page:
    """A page; `quiet` says whether its console is empty."""
    page, said = watched(context)
    page.goto(address)
    SAID[page] = said
    return page


SAID: dict[Page, list[str]] = {}


def quiet(*pages: Page) -> bool:
    """Nothing was said on the consoles of pages, but what a test brings about itself.

    There is no service worker, and an icon may still be loading when the next page is opened.
    """
    said = [text for page in pages for text in SAID[page]]
    ours = ("blocked by Playwright", "/assets/icon.")
    return all(any(part in text for part in ours) for text in said)


def mark(page: Page, id: str) -> str:
    """The mark of a lesson, as it is read out."""
    place = page.locator(f'[data-lesson="{id}"] [data-mark]')
    return " ".join((place.text_content() or "").split())


def question(page: Page, key: str) -> Locator:
    return page.locator(f'[data-question="{key}"]')


def choose(page: Page, found: Locator, option: str) -> None:
    found.scroll_into_view_if_needed()  # questions come alive when they come near
    found.get_by_label(option, exact=False).check()
    found.locator(".quiz-check").click()


def kept(page: Page) -> dict[str, object]:
    found: dict[str, object] = json.loads(page.evaluate("key => localStorage.getItem(key)", KEY))
    return found


def put(page: Page, *answers: dict[str, object], at: datetime.datetime | None = None) -> None:
    """Write answers into the storage as an earlier visit would have."""
    when = at or datetime.datetime.now(datetime.UTC) - datetime.timedelta(days=2)
    tick = int(when.timestamp() * 1000)
    quizzes: dict[str, dict[str, object]] = {}
    for number, given in enumerate(answers, 1):
        answer = {"kind": "mcq", "given": [], "right": False, "tries": 1, "hints": 0, "number": 1}
        answer |= {"lesson": "1.1", "at": when.strftime("%Y-%m-%dT%H:%M:%S.000Z")} | given
        quiz, key = answer.pop("quiz"), answer.pop("key")
        assert isinstance(quiz, str)
        assert isinstance(key, str)
        entry = {"answer": {"tick": tick + number, **answer}}
        recalls = [] if answer["right"] else [[tick + number, 0, tick]]
        quizzes.setdefault(quiz, {})[key] = {**entry, "recalls": recalls}
    text = {"coursebuild": "progress", "version": 1, "course": "motion", "reset": 0}
    data = json.dumps({**text, "answers": quizzes, "lessons": {}})
    page.evaluate("([key, data]) => localStorage.setItem(key, data)", [KEY, data])


# --------------------------------------------------------------------------------- the map


def test_at_first_a_page_is_as_it_was_built(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    assert page.locator(".start a").inner_text() == "Start with 1.1 Push & <em>pull</em>"
    assert page.locator("[data-mark]").all_text_contents() == [""] * 4
    assert page.evaluate("() => localStorage.length") == 0
    assert quiet(page), SAID[page]


def test_answers_and_lessons_show_on_the_map_at_once_in_another_tab(
    calm: BrowserContext, site: str
) -> None:
    home, lesson = opened(calm, site), opened(calm, site + PUSH_PAGE)
    choose(lesson, question(lesson, "smoke"), "Up")
    comes(home, lambda: mark(home, "1.1") == "begun1/3, 1 of 3 questions right")
    end = lesson.locator('[data-progress="lesson"]')
    assert end.get_by_role("status").inner_text() == "Not marked as read."
    end.get_by_role("button", name="Mark as read").click()
    assert end.get_by_role("status").inner_text() == "You have read this lesson."
    assert end.get_by_role("button").inner_text() == "Mark as not read"
    comes(home, lambda: mark(home, "1.1").startswith("read1/3"))
    assert home.locator('[data-progress="summary"]').inner_text().split("\n") == [
        "1 of 3 read",
        "1 of 7 questions right",
    ]
    assert home.locator(".start a").inner_text().startswith("Continue with 1.2 Free fall")
    choose(lesson, question(lesson, "smoke"), "Down")
    for index, answer in ((0, "Down"), (2, "Up")):
        again = lesson.locator(".question").nth(index)
        if again.get_by_role("button", name="Try again").is_visible():
            again.get_by_role("button", name="Try again").click()
        choose(lesson, again, answer)
    lesson.locator(".question").nth(1).get_by_role("textbox").fill("4")
    lesson.locator(".question").nth(1).locator(".quiz-check").click()
    comes(home, lambda: mark(home, "1.1") == "right3/3, 3 of 3 questions right")
    home.reload()
    assert mark(home, "1.1").startswith("right3/3")
    level = opened(calm, site + "levels/1.html")
    assert mark(level, "1.1").startswith("right3/3")
    assert quiet(home, lesson, level)


def test_the_home_page_leads_back_to_the_section(calm: BrowserContext, site: str) -> None:
    lesson = opened(calm, site + PUSH_PAGE)
    lesson.evaluate("() => document.getElementById('law').scrollIntoView()")
    until(lesson, f"() => localStorage.getItem('{KEY}') !== null")
    lesson.close()
    page = opened(calm, site)
    start = page.locator('[data-progress="start"]')
    assert start.locator("a").inner_text() == "Continue with 1.1 Push & <em>pull</em>"
    note = start.locator("[data-note]").inner_text()
    assert note.startswith("at “The x")
    assert note.endswith("law & its reach”")
    start.locator("a").click()
    assert page.url == site + PUSH_PAGE + "#law"


def test_a_lesson_read_to_its_end_counts_as_read_and_what_the_reader_says_holds(
    calm: BrowserContext, site: str
) -> None:
    page = calm.new_page()
    page.clock.install()
    page.goto(site + PUSH_PAGE)
    status = page.locator('[data-progress="lesson"]').get_by_role("status")
    height = page.evaluate("() => document.documentElement.scrollHeight")
    for top in range(0, height, 400):
        page.evaluate("top => scrollTo(0, top)", top)
        page.clock.run_for(2100)
    comes(page, lambda: status.inner_text() == "You have read this lesson.")
    page.get_by_role("button", name="Mark as not read").click()
    page.clock.run_for(60_000)
    assert status.inner_text() == "Not marked as read."
    assert page.locator(":focus").inner_text() == "Mark as read"


def late(route: Route) -> None:
    time.sleep(0.2)
    route.continue_()


def test_marks_move_nothing(calm: BrowserContext, site: str) -> None:
    """Neither on a wide screen nor on a narrow one, and not when they come after the text.

    The fonts are left out: what they move is another matter, measured in `test_lighthouse.py`.
    """
    page = opened(calm, site)
    page.route("**/*.woff2", lambda route: route.abort())
    page.route("**/assets/site.*.js", late)
    put(
        page,
        {"quiz": "fall", "key": "way", "lesson": "1.2"},
        {"quiz": "push.check_1", "key": "smoke", "right": True, "number": 3},
    )
    moved = """() => new Promise((done) => {
      const moved = []
      const inMain = (node) => node?.parentElement?.closest('main')
      const add = ({ sources }) => moved.push(...sources.map(({ node }) => node).filter(inMain))
      const observer = new PerformanceObserver((list) => list.getEntries().forEach(add))
      observer.observe({ type: 'layout-shift', buffered: true })
      setTimeout(() => done(moved.map((node) => node.outerHTML ?? node.textContent)), 300)
    })"""
    for width in (320, 360, 800, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        for path in ("", "levels/1.html", "progress/", "review/"):
            page.goto(site + path)
            assert page.evaluate(moved) == [], (width, path)
            room = "() => document.documentElement.scrollWidth - innerWidth"
            assert page.evaluate(room) <= 0


# --------------------------------------------------------------------------------- the page


def test_saving_forgetting_and_bringing_in(calm: BrowserContext, site: str, tmp_path: Path) -> None:
    lesson = opened(calm, site + FALL_PAGE)
    choose(lesson, question(lesson, "way"), "Up")
    lesson.get_by_role("button", name="Mark as read").click()
    page = opened(calm, site + "progress/")
    overall = page.locator('[data-progress="overall"]')
    assert overall.inner_text().split("\n\n") == ["1 of 3 lessons read", "0 of 8 questions right"]
    with page.expect_download() as saving:
        page.get_by_role("button", name="Save as a file").first.click()
    today = page.evaluate("() => new Date().toISOString().slice(0, 10)")
    assert saving.value.suggested_filename == f"progress-motion-{today}.json"
    file = tmp_path / "saved.json"
    saving.value.save_as(file)
    assert json.loads(file.read_text("utf-8")) == kept(page)

    page.get_by_role("button", name="Forget everything").click()
    ask = page.get_by_role("dialog", name="Forget everything?")
    assert "1 answer and 1 lesson are forgotten" in ask.inner_text()
    assert page.locator(":focus").inner_text() == "Cancel"
    page.keyboard.press("Escape")
    assert not ask.is_visible()
    page.get_by_role("button", name="Forget everything").click()
    ask.get_by_role("button", name="Forget", exact=True).click()
    assert overall.inner_text().startswith("Nothing yet.")
    comes(lesson, lambda: lesson.get_by_role("button", name="Mark as read").is_visible())
    assert not lesson.get_by_text("Not this", exact=False).first.is_visible()

    page.locator("input[type=file]").set_input_files(file)
    told = page.locator('[data-control="import"] [role=status]')
    comes(page, lambda: "2 things in the file are not here" in told.inner_text())
    assert overall.inner_text().startswith("Nothing yet."), "what was forgotten stays so"
    told.get_by_role("button", name="Bring back what was forgotten").click()
    assert told.inner_text().startswith("Brought in: 1 answer and 1 lesson")
    assert overall.inner_text().startswith("1 of 3 lessons read")
    page.locator("input[type=file]").set_input_files(file)
    comes(page, lambda: told.inner_text() == "Everything in the file was here already.")
    assert quiet(page, lesson)


def test_forgetting_can_be_undone(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2", "right": True})
    page.goto(site + "progress/")
    page.get_by_role("button", name="Forget everything").click()
    page.get_by_role("dialog").get_by_role("button", name="Forget", exact=True).click()
    page.get_by_role("button", name="Undo").click()
    assert "1 of 8 questions right" in page.locator('[data-progress="overall"]').inner_text()
    assert page.locator(":focus").inner_text() == "Forget everything"


def test_a_file_goes_to_another_device(
    calm: BrowserContext, browsers: dict[str, Browser], site: str, tmp_path: Path
) -> None:
    page = opened(calm, site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    file = tmp_path / "desk.json"
    file.write_text(page.evaluate("key => localStorage.getItem(key)", KEY), "utf-8")
    with browsers["plain"].new_context() as other:
        phone = opened(other, site + FALL_PAGE)
        phone.get_by_role("button", name="Mark as read").click()
        phone.goto(site + "progress/")
        phone.locator("input[type=file]").set_input_files(file)
        told = phone.locator('[data-control="import"] [role=status]')
        comes(phone, lambda: told.inner_text().startswith("Brought in: 0 answers and 1 lesson "))
        overall = phone.locator('[data-progress="overall"]').inner_text()
        assert overall.startswith("2 of 3 lessons read")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\xff\xfe\x00", "The file is no saved progress: it can’t be read as JSON"),
        (b'{"a": 1}', "The file is no saved progress of a course. Nothing was changed."),
        (
            b'{"coursebuild":"progress","version":9}',
            "The file was saved by a newer version of this site.",
        ),
        (
            b'{"coursebuild":"progress","version":1,"course":"<img src=x onerror=alert(1)>"}',
            "The file is of another course, “<img src=x onerror=alert(1)>”. Nothing was changed.",
        ),
        (
            b'{"coursebuild":"progress","version":1,"course":"motion","reset":0,"lessons":{},'
            b'"answers":{"q":{"<b>k":{"answer":{"tick":1}}}}}',
            "The file is damaged: what it says at “answers, q, <b>k, answer” makes no sense.",
        ),
    ],
    ids=["no-json", "no-progress", "newer", "other-course", "damaged"],
)
def test_wrong_files_change_nothing(
    calm: BrowserContext, site: str, tmp_path: Path, data: bytes, message: str
) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.goto(site + "progress/")
    before = kept(page)
    (tmp_path / "wrong.json").write_bytes(data)
    page.locator("input[type=file]").set_input_files(tmp_path / "wrong.json")
    told = page.locator('[data-control="import"] [role=status]')
    comes(page, lambda: told.inner_text().startswith(message))
    assert kept(page) == before
    assert quiet(page), SAID[page]


def test_what_is_no_longer_in_the_course_is_shown_and_can_be_forgotten(
    calm: BrowserContext, site: str
) -> None:
    page = opened(calm, site)
    put(
        page,
        {"quiz": "<i>gone", "key": "x", "lesson": "7.7", "number": 3},
        {"quiz": "fall", "key": "was", "lesson": "1.2", "number": 9},
        {"quiz": "fall", "key": "way", "lesson": "1.2"},
    )
    page.goto(site + "progress/")
    orphans = page.locator('[data-progress="orphans"]')
    first = "Question 3 of quiz “<i>gone”, lesson 7.7 (wrong)"
    assert [text.split(" Forget")[0] for text in orphans.locator("li").all_inner_texts()] == [
        "Question 9 of quiz “fall”, lesson 1.2 (wrong)",
        first,
    ]
    orphans.get_by_role("button", name=f"Forget: {first}").click()
    assert orphans.locator("li").count() == 1
    assert page.locator(":focus").inner_text() == "No longer in the course"
    orphans.get_by_role("button", name="Forget all of these").click()
    assert not orphans.is_visible()
    page.reload()
    assert not orphans.is_visible()
    assert "0 of 8 questions right" in page.locator('[data-progress="overall"]').inner_text()


# --------------------------------------------------------------------------------- storage


CLOSED = """
const closed = () => { throw new DOMException('no', 'SecurityError') }
Object.defineProperty(window, 'localStorage', { get: closed })
"""
FULL = """
Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError') }
"""


@pytest.mark.parametrize(
    ("script", "message"),
    [(CLOSED, "This browser keeps nothing"), (FULL, "This browser has no room left")],
    ids=["closed", "full"],
)
def test_without_storage_the_page_works_and_says_so(
    calm: BrowserContext, site: str, script: str, message: str
) -> None:
    calm.add_init_script(script)
    page = opened(calm, site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    end = page.locator('[data-progress="lesson"]')
    assert end.get_by_role("status").inner_text() == "You have read this lesson."
    assert end.locator(".lesson-trouble").inner_text().startswith(message)
    choose(page, question(page, "smoke"), "Up")
    assert "Right" in question(page, "smoke").locator(".verdict").inner_text()
    page.goto(site + "progress/")
    page.goto(site)
    assert page.locator(".start a").inner_text().startswith("Start with")
    assert quiet(page), SAID[page]


def test_damaged_storage_is_put_aside_and_can_be_saved(
    calm: BrowserContext, site: str, tmp_path: Path
) -> None:
    page = opened(calm, site)
    page.evaluate("key => localStorage.setItem(key, '{\"coursebuild\"')", KEY)
    page.goto(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    page.goto(site + "progress/")
    assert page.locator('[data-progress="overall"]').inner_text().startswith("1 of 3 lessons")
    part = page.locator(".aside-part")
    with page.expect_download() as saving:
        part.get_by_role("button", name="Save it as a file").click()
    saving.value.save_as(tmp_path / "damaged")
    assert (tmp_path / "damaged").read_text("utf-8") == '{"coursebuild"'
    part.get_by_role("button", name="Remove it").click()
    page.reload()
    assert page.locator(".aside-part").count() == 0


def test_a_newer_version_is_left_alone(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    newer = '{"coursebuild":"progress","version":2,"course":"motion"}'
    page.evaluate("([key, text]) => localStorage.setItem(key, text)", [KEY, newer])
    page.goto(site + PUSH_PAGE)
    page.get_by_role("button", name="Mark as read").click()
    trouble = page.locator(".lesson-trouble").inner_text()
    assert trouble.startswith("A newer version of this site has written your progress.")
    assert page.evaluate("key => localStorage.getItem(key)", KEY) == newer


# --------------------------------------------------------------------------------- the review


def test_missed_questions_come_back(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(
        page,
        {"quiz": "push.check_1", "key": "smoke", "number": 3},
        {"quiz": "fall", "key": "way", "lesson": "1.2"},
        {"quiz": "fall", "key": "swing", "lesson": "1.2", "kind": "predict", "number": 2},
        {"quiz": "fall", "key": "steps", "lesson": "1.2", "right": True, "kind": "order"},
        {"quiz": "gone", "key": "x", "lesson": "7.7"},
    )
    page.goto(site + "review/")
    review = page.locator('[data-progress="review"]')
    assert review.locator(".due").inner_text() == "3 questions are due."
    assert "One more was missed, of which the course no longer" in review.inner_text()
    page.get_by_role("button", name="Begin").click()
    comes(page, lambda: question(page, "smoke").is_visible())
    assert page.locator(":focus").inner_text() == "Question 1 of 3"
    assert not question(page, "smoke").get_by_label("Up").is_checked(), "nothing is shown of before"
    choose(page, question(page, "smoke"), "Up")
    page.get_by_role("button", name="Next question").click()

    comes(page, lambda: question(page, "way").is_visible())
    picture = question(page, "way").locator("img")
    until(page, "() => document.querySelector('.question img').naturalWidth === 9")
    assert picture.get_attribute("src") == site + "files/lessons/stone.svg"
    choose(page, question(page, "way"), "Up")
    page.get_by_role("button", name="Next question").click()

    comes(page, lambda: question(page, "swing").is_visible())
    assert page.locator("[data-lab]").count() == 0
    choose(page, question(page, "swing"), "Left")
    link = page.get_by_role("link", name="See what happens, in the lesson")
    assert link.get_attribute("href") == f"{site}{FALL_PAGE}#fall.swing"
    page.get_by_role("button", name="Next question").click()
    assert page.locator(":focus").inner_text() == "Done: 2 of 3 right."
    assert review.locator(".due").inner_text() == "Nothing is due."
    assert "One comes back in a day. 2 come back in 3 days." in review.inner_text()
    page.reload()
    assert review.locator(".due").inner_text() == "Nothing is due."
    page.goto(site + FALL_PAGE)
    assert question(page, "way").get_by_label("Up").is_checked(), "the lesson shows it too"
    assert quiet(page), SAID[page]


def test_a_question_that_cannot_be_fetched_is_linked(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.goto(site + "review/")
    page.route("**/lessons/*", lambda route: route.fulfill(status=500, body="no"))
    page.get_by_role("button", name="Begin").click()
    link = page.get_by_role("link", name="question 1 in its lesson")
    assert link.get_attribute("href") == f"{site}{FALL_PAGE}#fall.way"
    page.get_by_role("button", name="Skip").click()
    assert page.locator(".due").inner_text() == "One question is due."


def test_from_disk_there_are_links(calm: BrowserContext, reader: Folder) -> None:
    page = opened(calm, (reader.root / "public/review/index.html").as_uri())
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.reload()
    link = page.get_by_role("link", name="question 1 in its lesson")
    assert "Pages opened from disk" in page.locator('[data-progress="review"]').inner_text()
    link.click()
    assert page.url.endswith(f"public/{FALL_PAGE}#fall.way")


def test_a_reworded_question_keeps_its_answer_and_its_turn(
    calm: BrowserContext, site: str, reader: Folder
) -> None:
    page = opened(calm, site + PUSH_PAGE)
    choose(page, page.locator(".question").first, "Up")
    old = page.locator(".question").first.get_attribute("data-question")
    reader.write("content/lessons/1.1-push.md", PUSH.replace("Where does a", "Whither a"))
    try:
        assert reader.main("build").status == 0
        page.reload()
        first = page.locator(".question").first
        new = first.get_attribute("data-question")
        assert new != old
        assert first.get_by_label("Up").is_checked()
        page.goto(site + "progress/")
        assert not page.locator('[data-progress="orphans"]').is_visible()
        page.goto(site + "review/")
        assert "One comes back in a day." in page.locator('[data-progress="review"]').inner_text()
    finally:
        reader.write("content/lessons/1.1-push.md", PUSH)
        assert reader.main("build").status == 0


# --------------------------------------------------------------------------------- access


def test_without_a_script_the_pages_say_so_and_are_complete(
    browsers: dict[str, Browser], site: str
) -> None:
    with browsers["plain"].new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto(site + "progress/")
        assert "Progress is kept by a script" in page.locator("noscript").inner_text()
        page.locator("summary").first.click()
        assert page.get_by_role("link", name="Push & <em>pull</em>").is_visible()
        page.goto(site + "review/")
        assert "scripts are switched off here" in page.locator("noscript").inner_text()
        assert page.locator(".asking li").all_inner_texts() == [
            "1.1 Push & <em>pull</em> 3 questions",
            "1.2 Free fall, from a height that is not small 4 questions",
            "About 1 question",
        ]
        page.goto(site)
        assert page.locator(".start a").inner_text().startswith("Start with 1.1")


def test_everything_works_from_the_keyboard(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "fall", "key": "way", "lesson": "1.2"})
    page.goto(site + "review/")
    tab_to(page, "Begin")
    page.keyboard.press("Enter")
    comes(page, lambda: question(page, "way").is_visible())
    tab_to(page, "Up", property="labels?.[0]?.innerText")
    page.keyboard.press("ArrowDown")
    tab_to(page, "Check")
    page.keyboard.press("Enter")
    assert "Right" in page.locator(".verdict").inner_text()
    tab_to(page, "Next question")
    page.keyboard.press("Enter")
    assert page.locator(":focus").inner_text() == "Done: 1 of 1 right."
    page.goto(site + "progress/")
    tab_to(page, "Forget everything")
    page.keyboard.press("Space")
    tab_to(page, "Forget")
    page.keyboard.press("Enter")
    tab_to(page, "Undo")
    page.keyboard.press("Enter")
    assert "1 of 8 questions right" in page.locator('[data-progress="overall"]').inner_text()


def tab_to(page: Page, text: str, property: str = "innerText") -> None:
    """Press Tab until the element of this text has the focus."""
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate(f"() => document.activeElement?.{property}?.trim()") == text:
            return
    raise AssertionError(f"Tab does not come to {text!r}")


def test_what_can_be_pressed_is_large_enough(calm: BrowserContext, site: str) -> None:
    page = opened(calm, site)
    put(page, {"quiz": "gone", "key": "x", "lesson": "7.7"})
    page.set_viewport_size({"width": 320, "height": 640})
    for path, part in (("progress/", "main"), (PUSH_PAGE, ".lesson-end")):
        page.goto(site + path)
        sizes = page.locator(part).evaluate(
            "(part) => [...part.querySelectorAll('button, input[type=file], summary')]"
            ".filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect())"
            ".map(({ width, height }) => Math.min(width, height))"
        )
        assert sizes
        assert min(sizes) >= 24
        room = "() => document.documentElement.scrollWidth - innerWidth"
        assert page.evaluate(room) <= 0
