"""The page of a reader's progress: saving, forgetting, bringing in, keys alone, no scripts."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from support.lab_page import comes
from support.reader_page import (
    FALL_PAGE,
    KEY,
    PUSH_PAGE,
    SAID,
    choose,
    kept,
    opened,
    put,
    question,
    quiet,
)


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
