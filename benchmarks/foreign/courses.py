"""Texts of strangers as courses: imported, or as the lessons that they are, and what is said.

Entry points: `import_course`, `write_plain_course`, `examine`. Nothing of them is run.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.importer.contents import read_contents
from coursebuild.features.importer.convert import convert, write_course
from coursebuild.features.importer.course_map import read_texts
from coursebuild.features.importer.source_files import SourceFiles
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, open_store
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.scripts import extract_scripts
from coursebuild.pipeline.verify import compile_models

_FENCE = re.compile(r"^[ >]*(`{3,}|~{3,}).*?(?:^[ >]*\1|\Z)", re.MULTILINE | re.DOTALL)
WORDS = re.compile(r"[\u3040-\u30ff\u3400-\u9fff]{1,2}|[^\W\d_\u3040-\u30ff\u3400-\u9fff]+")
"""Words, and two signs each of Chinese and Japanese, which has no spaces."""
FRONT = re.compile(r"\A---\n.*?\n---\n", re.DOTALL)
_TITLE = re.compile(r"\A\s*# .*\n")


class Examination(Struct, frozen=True):
    """What is said of a course."""

    files: int
    words: int
    """Of its texts, without blocks of code."""
    diagnostics: tuple[Diagnostic, ...]
    """Errors, warnings and hints."""


def import_course(texts: Path, root: Path) -> dict[str, str]:
    """Write texts as `coursebuild import` does; return the paths of the new ones by the old.

    A text that only others include has none, nor one of which nothing is left.
    """
    files = SourceFiles(texts)
    write_course(convert(files), root, files, open_store(root, None, None))
    files = SourceFiles(texts)
    course = read_texts(read_contents(files), files)
    lessons = [lesson for level in course.levels for lesson in level.lessons]
    texts_with_files = (text for text in (*lessons, *course.pages) if text.path)
    return {text.file: text.path for text in texts_with_files if (root / text.path).is_file()}


def write_plain_course(texts: Path, root: Path) -> bool:
    """Write the Markdown files as lessons, without front matter and title, if there are any."""
    entries = ['[course]\ntitle = "Texts"\n\n[[level]]\nid = "1"\ntitle = "Texts"\n']
    lessons = root / "content" / "lessons"
    lessons.mkdir(parents=True)
    number = 0
    for path in sorted(texts.rglob("*.md")):
        text = path.read_text("utf-8", errors="replace")
        text = _TITLE.sub("", FRONT.sub("", text), count=1)
        if not text.strip():
            continue
        number += 1
        id, slug = f"1.{number}", f"text-{number}"
        title = json.dumps(path.relative_to(texts).as_posix(), ensure_ascii=False)
        (lessons / f"{id}-{slug}.md").write_text(text, encoding="utf-8")
        entries.append(
            f'[[level.lesson]]\nid = "{id}"\nslug = "{slug}"\ntitle = {title}\nstatus = "draft"\n'
        )
    (root / "content" / "course.toml").write_text("\n".join(entries), encoding="utf-8")
    return number > 0


def examine(root: Path) -> Examination:
    """Read, typeset and look up all that a course holds, and compile its models."""
    options = Options(root, 1, open_store(root, None, None))
    with Reader(options) as reader:
        loaded_course = load(root, reader, code="refuse")
    course, diagnostics = loaded_course.value, [*loaded_course.diagnostics]
    if course is not None:
        diagnostics += extract_scripts(course, options).diagnostics
        diagnostics += compile_models(course, options)[1]
    report = judge(course, diagnostics)
    texts = [path.read_text("utf-8") for path in (root / "content").rglob("*.md")]
    words = sum(len(WORDS.findall(_FENCE.sub("", text))) for text in texts)
    return Examination(len(texts), words, (*report.diagnostics, *report.hints))
