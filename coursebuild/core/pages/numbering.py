r"""Numbers of formulas, figures, tables, listings, labs and callouts.

1. What has a label has a number, in the order of the text, and nothing else: a number is there to
   be referred to. Each kind is counted for itself.
2. A figure of Lesson 4.2 is "Figure 4.2.3" wherever it is named, and on a page that is no lesson
   "Figure 3". A formula is "(3)" where it stands, and "(3) of Lesson 4.2" elsewhere.
3. LaTeX's numbered environments count too, continuing ours. A formula with such numbers of its own,
   or with a `\tag`, gets no other.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from html import unescape
from itertools import count
from typing import TypeVar
from urllib.parse import unquote

from markupsafe import Markup

from coursebuild.core import model
from coursebuild.core.model.results import Mathml
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import Strings
from coursebuild.core.text.regex import regex

TextT = TypeVar("TextT", str, Markup)

_COUNTER_CLASS = 'class="tml-eqn"'
_TAG_CLASS = 'class="tml-tag"'
_NUMBER = regex(r'<mtext class="tml-tag">\(?([^<]*?)\)?</mtext>')


def number_items(document: model.Document, mathml: Mathml) -> dict[int, model.NumberedItem]:
    """What has a number in a document, and formulas that have an id only, by offset."""
    items: dict[int, model.NumberedItem] = {}
    total = 0
    for formula in model.display_formulas(document):
        html = mathml(formula.tex, True)
        styled_count = html.count(_COUNTER_CLASS)
        tag = _NUMBER.search(html) if _TAG_CLASS in html else None
        number, has_margin_number = "", False
        if formula.label is not None and formula.id:
            has_margin_number = not styled_count and tag is None
            number = unescape(tag[1]) if tag is not None and not styled_count else str(total + 1)
        total += styled_count + has_margin_number
        if formula.id:
            conditions = formula.label.conditions if formula.label is not None else None
            first = total - styled_count + 1 if styled_count else 0
            items[formula.start] = model.NumberedItem(
                formula.id, number, has_margin_number, conditions, first_row=first
            )
    counts = Counter[str]()
    for block, label in model.labelled_blocks(document):
        callout = block.kind if isinstance(block, model.Callout) else ""
        kind = callout or label.id.partition(":")[0]
        counts[kind] += 1
        items[block.span.start] = model.NumberedItem(label.id, str(counts[kind]), callout=callout)
    return items


def with_row_numbers(mathml: Markup, first: int) -> Markup:
    """A formula whose numbered rows, as of `align`, get their numbers."""
    numbers = count(first)
    return Markup(re.sub(f"{_COUNTER_CLASS}>", lambda m: f"{m[0]}({next(numbers)})", str(mathml)))


def items_of(document: model.Document, mathml: Mathml) -> tuple[model.NumberedItem, ...]:
    """The numbered items of a document, or of its summary."""
    if document.summaries is not None:
        return document.numbered_items
    return tuple(number_items(document, mathml).values())


def item_name(
    item: model.NumberedItem, prefix: str, words: Strings, callouts: Mapping[str, model.CalloutKind]
) -> str:
    """The name of an item, such as "(3)" or "Theorem 4.2.3"; empty without a number.

    `callouts` are the kinds of callouts that may have one, with their labels.
    """
    if not item.number or (item.kind == "eq" and not item.callout):
        return item.number and f"({item.number})"
    if item.callout:
        return f"{callouts[item.callout].label} {prefix}{item.number}"
    return words(f"number.{item.kind}", number=prefix + item.number)


def number_prefix(id: str) -> str:
    """What stands before numbers in a lesson."""
    return f"{id}."


UNNAMED = "\0"
"""Stands for the name of a link's target in texts that are kept of a document: the names depend on
other documents. No text of a course has this character."""


def fill_in(text: TextT, names: Iterator[str]) -> TextT:
    """A text, or HTML, with names in the place of `UNNAMED`."""
    head, *rest = text.split(UNNAMED)
    for part in rest:
        head = head + next(names, "") + part
    return head


def name_outside(library: Library, owner: model.Owner, target: model.Target) -> str:
    """The name of what a link of a lesson or page leads to, for a page that quotes it."""
    target = model.resolve(target, library.course, owner.path)
    if isinstance(target, model.UrlTarget) and target.url.startswith("#"):
        kind = model.LessonTarget if isinstance(owner, model.Lesson) else model.PageTarget
        target = kind(owner.id, unquote(target.url[1:]))
    return name_elsewhere(library, "", target)


def name_elsewhere(library: Library, path: str, target: model.Target) -> str:
    """The name of a numbered item of another page, for the document at a path; else empty."""
    target = model.resolve(target, library.course, path)
    if not isinstance(target, model.LessonTarget | model.PageTarget):
        return ""
    if target.anchor is None or ":" not in target.anchor:
        return ""
    lesson = isinstance(target, model.LessonTarget)
    owner = library.lessons.get(target.id) if lesson else library.pages.get(target.id)
    if owner is None or owner.document is None:
        return ""
    items = items_of(owner.document, library.mathml)
    item = next((item for item in items if item.id == target.anchor), None)
    prefix = number_prefix(owner.id) if lesson else ""
    kinds = {kind.name: library.callout(kind.name) for kind in library.course.callouts}
    name = item and item_name(item, prefix, library.words, kinds)
    if not item or not name:
        return ""
    if owner.document.source.path == path or (lesson and item.kind != "eq"):
        return name
    if lesson:
        return library.words("number.of_lesson", name=name, id=owner.id)
    return library.words("number.of_page", name=name, title=owner.title)
