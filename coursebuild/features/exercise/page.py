"""Exercises before any script runs: the task, the start, the trials, and the solution folded.

The page's script puts an editor and a simulation into `data-exercise`, which holds what it needs.
"""

from __future__ import annotations

import json

from markupsafe import Markup

from coursebuild.api import Block, Excerpt, IndexReader, MarkdownWriter, PageContext, model
from coursebuild.core.pages.marks import escape_line, escape_marks, fence, link, table
from coursebuild.core.pages.renderer import Strings
from coursebuild.core.text.quantities import with_unit
from coursebuild.features.exercise.model import FORMULA, LANGUAGES, Exercise, PublishedExercise
from coursebuild.features.exercise.schema import HiddenTrial
from coursebuild.features.lab.reply import PublishedLab

ROWS = 22
"""The most lines that the page's editor shows at once, as in `site/js/lab/page/editor.js`."""


def draw_exercise(page: PageContext, block: Exercise) -> Markup:
    """Draw an exercise without its editor."""
    lab = page.inputs.trials.get(block.lab.span.start)
    language, words = LANGUAGES[block.subject], page.renderer.words
    record = lab.record if isinstance(lab, PublishedLab) else None
    title, config, script, name = block.title or words("exercise.untitled"), "", "", ""
    if isinstance(lab, PublishedLab):
        name, config = lab.name, page.place.href(lab.config)
        script = page.place.href(lab.script)

    def code(text: str) -> Markup:
        html = page.highlight(language, text.rstrip())
        return page.template("blocks/code.html", language=language, html=html)

    download = page.inputs.trials.get(block.span.start)
    file = href = picture = ""
    if isinstance(download, PublishedExercise):
        file = download.name if download.path else ""
        href, picture = (page.place.href(p) if p else "" for p in (download.path, download.picture))
    return page.template(
        "exercise/exercise.html",
        file=file,
        href=href,
        is_tried=download is not None,
        id=block.id,
        lab=name,
        config=config,
        script=script,
        data=json.dumps(block.data(), ensure_ascii=False, separators=(",", ":")),
        title=title,
        picture=picture,
        size=() if record is None else record.size,
        arrows=0 if record is None else record.arrows,
        alt=words("lab.picture", title=title, t=0),
        task=page.blocks(block.task),
        subject=_subject(words, block),
        start=code(block.start.text),
        rows=min(ROWS, block.start.text.rstrip().count("\n") + 1),
        label=words(f"exercise.live.{block.subject}", names=", ".join(block.names)),
        fields=block.lab.fields,
        solution=code(block.solution.text),
        explain=page.blocks(block.explain),
        trials=[(trial.name, _bounds(words, trial)) for trial in block.trials],
    )


def _subject(words: Strings, block: Exercise) -> str:
    names = ", ".join(block.names)
    if block.subject == FORMULA:
        return words("exercise.formula_of", names=names) if names else words("exercise.formula")
    return words(f"exercise.{block.subject}")


def _bounds(words: Strings, trial: HiddenTrial) -> str:
    """The values that a trial accepts, with the time at which it looks, in words."""
    if trial.max is None:
        bounds = words("exercise.least", value=trial.min or 0)
    elif trial.min is None:
        bounds = words("exercise.most", value=trial.max)
    else:
        bounds = words("exercise.between", min=trial.min, max=trial.max)
    bounds = with_unit(bounds, trial.unit)
    return words("exercise.at", bounds=bounds, t=trial.t) if trial.t else bounds


def plain_task(words: Strings, block: Exercise) -> tuple[Block, ...]:
    """The task with the start and the trials, for a place where nothing tries an attempt."""
    span = block.span

    def line(text: str) -> model.Paragraph:
        return model.Paragraph(span, (model.Text(span, text),))

    return (
        *block.task,
        line(_subject(words, block)),
        code_block(block, block.start),
        line(words("exercise.trials")),
        *(line(f"{trial.name}: {_bounds(words, trial)}") for trial in block.trials),
    )


def code_block(block: Exercise, code: Excerpt) -> model.CodeBlock:
    """What the reader of an exercise could write, as code."""
    language = LANGUAGES[block.subject]
    return model.CodeBlock(block.span, language, language, code)


def exercise_markdown(writer: MarkdownWriter, block: Exercise) -> str:
    """Write the task, the start, the trials and the solution, with a link to where it runs."""
    words, language = writer.page.renderer.words, LANGUAGES[block.subject]
    title = block.title or words("exercise.untitled")
    rows = [(escape_line(trial.name), escape_line(_bounds(words, trial))) for trial in block.trials]
    solution = [fence(language, block.solution.text), writer.blocks(block.explain)]
    parts = [
        f"**{writer.words('exercise.label')}: {escape_marks(title)}**",
        writer.blocks(block.task),
        f"{escape_marks(_subject(words, block))}:",
        fence(language, block.start.text),
        table((words("exercise.trial"), words("exercise.accepted")), rows),
        writer.folded(writer.words("exercise.solution"), "\n\n".join(filter(None, solution))),
        link(writer.words("exercise.do"), writer.live),
    ]
    return "\n\n".join(filter(None, parts))


def index_exercise(reader: IndexReader, block: Exercise) -> None:
    """Give the search an exercise's title, task and start, and no solution."""
    reader.add("text", block.title)
    reader.blocks(block.task)
    reader.add("code", block.start.text)
    for name in block.lab.models():
        reader.add_name(name)
