"""Read texts that strangers wrote, and count what is said of them without reason.

Run: python benchmarks/corpus.py [--bodies NAME …] [--cache DIR] [--record]
     python benchmarks/corpus.py --pages NUMBER [--bodies NAME …] [--cache DIR]

The texts are those of packages (`corpus.toml`); they are fetched into `--cache`, and nothing of
them is run. Each body is read twice: as `coursebuild import` makes it, and its Markdown files as
lessons. Printed are errors, warnings and hints by rule, and the words of prose that an import
leaves on no page.

Whether a message is true, somebody has to say. Up to fifteen lines of each rule and body that
nobody has judged are written to `sample.txt` in the cache: put a letter before each of them, and
run this again. Letters are kept in `corpus_judged.txt`, with a hash of rule and line:

- r: right, the text has this mistake;
- f: fair, no mistake, but advice that makes the text better;
- o: right in its own tool, and never in a lesson: another tool's syntax, a file that the package
  does not hold, a picture elsewhere, `<script>`, a title in the text;
- w: wrong, the text is right here too.

The share of a letter among the lines judged of a rule and body is taken for all of them. Rates are
of `w`, and of all hints but `o`.

`--pages` imports each body that has a `format`, and names so many of its texts, always the same
ones: whether their pages look right in a browser, somebody has to see.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import random
import re
import shutil
import sys
import tempfile
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from textwrap import shorten
from typing import TypeAlias

import msgspec
from msgspec import Struct

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

from benchmarks.foreign.courses import (  # noqa: E402
    Examination,
    examine,
    import_course,
    write_plain_course,
)
from benchmarks.foreign.losses import Losses, find_losses  # noqa: E402
from benchmarks.foreign.packages import texts_of  # noqa: E402
from coursebuild.core.files.errors import UsageError  # noqa: E402
from coursebuild.core.text.diagnostics import Diagnostic  # noqa: E402

HERE = Path(__file__).parent
JUDGED = HERE / "corpus_judged.txt"
RESULT = HERE / "corpus_result.json"
SEVERITIES = ("error", "warning", "hint")
LETTERS = "rfow"
SAMPLE = 15
"""Lines of a rule and body that are judged."""
LONGEST = 10
"""Runs of lost words that are printed."""
SHARE = 10_000
"""Words to which counts are related."""

Judgements: TypeAlias = dict[str, str]
"""A letter by the hash of a rule and a line."""
_LINE_OF_WORDS = re.compile(r"(?:[^\w\n]*\n){0,3}[^\n]*")


class Body(Struct, frozen=True):
    """Texts that belong together."""

    name: str
    packages: list[str]
    files: list[str]
    format: str = ""
    """That of the tool for which they were written; empty where no pages are looked at."""
    folder: str = ""
    """The one that is imported."""


class Row(Struct, frozen=True):
    """What is said of a body, read in one of the two ways."""

    body: str
    way: str
    files: int
    words: int
    counts: dict[str, int]
    """Messages by severity."""
    refused: dict[str, float]
    """Those that are wrong, as far as they were judged; of hints, all but those of other tools."""
    unjudged: int
    """Messages of rules of which no line was judged."""

    def rate(self, severity: str) -> float:
        """What `refused` counts, per 10,000 words."""
        return self.refused[severity] * SHARE / max(self.words, 1)


def line_of(diagnostic: Diagnostic) -> str:
    """The line in which a diagnostic begins; one without words, such as `$$`, with those below."""
    text, start = diagnostic.span.source.text, diagnostic.span.start
    line = _LINE_OF_WORDS.match(text, text.rfind("\n", 0, start) + 1)
    assert line is not None
    return line[0].strip()


def hash_of(diagnostic: Diagnostic) -> str:
    """What a judgement is kept by."""
    text = f"{diagnostic.rule}\n{line_of(diagnostic)}"
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()[:16]


# --- judgements


def read_judgements(path: Path) -> Judgements:
    """The judgements in a file of which each line has a letter and a hash."""
    judgements = {}
    for line in path.read_text("utf-8").splitlines() if path.is_file() else ():
        letter, _, rest = line.partition(" ")
        if letter in LETTERS and letter:
            judgements[rest.split()[0]] = letter
    return judgements


def keep_judgements(judgements: Judgements) -> None:
    """Write them where the next run reads them."""
    lines = sorted(f"{letter} {key}\n" for key, letter in judgements.items())
    JUDGED.write_text("".join(lines), encoding="utf-8")


def by_rule(diagnostics: Iterable[Diagnostic]) -> dict[str, dict[str, list[Diagnostic]]]:
    """Diagnostics by rule and hash."""
    groups: dict[str, dict[str, list[Diagnostic]]] = defaultdict(lambda: defaultdict(list))
    for diagnostic in diagnostics:
        groups[diagnostic.rule][hash_of(diagnostic)].append(diagnostic)
    return groups


def sample(body: str, diagnostics: Iterable[Diagnostic], judgements: Judgements) -> Iterator[str]:
    """Lines to be judged, as they stand in the file of the sample."""
    for rule, groups in sorted(by_rule(diagnostics).items()):
        room = SAMPLE - sum(key in judgements for key in groups)
        for key in sorted(groups.keys() - judgements.keys())[: max(room, 0)]:
            first = groups[key][0]
            text = first.span.first_line().text[:80] if first.span.start < first.span.end else ""
            yield f"? {key} {body} | {first.severity} {rule}: {first.message}"
            yield f"      {first.span.path}:{first.span.line}: {text!r} in {line_of(first)[:300]!r}"


def evaluate(body: str, way: str, examination: Examination, judgements: Judgements) -> Row:
    """Count what is said, and what of it is wrong."""
    counts, refused, unjudged = Counter[str](), dict.fromkeys(SEVERITIES, 0.0), 0
    for groups in by_rule(examination.diagnostics).values():
        severity = next(iter(groups.values()))[0].severity
        count = sum(map(len, groups.values()))
        letters = [judgements[key] for key in groups if key in judgements]
        counts[severity] += count
        bad = "rfw" if severity == "hint" else "w"
        share = sum(letter in bad for letter in letters) / max(len(letters), 1)
        refused[severity] += count * share
        unjudged += 0 if letters else count
    filled = {severity: counts[severity] for severity in SEVERITIES}
    return Row(body, way, examination.files, examination.words, filled, refused, unjudged)


# --- the run


def read_bodies(names: Sequence[str]) -> list[Body]:
    """The bodies with one of these words in their names; all without words."""
    tables = tomllib.loads((HERE / "corpus.toml").read_text("utf-8"))["body"]
    bodies = msgspec.convert(tables, list[Body])
    return [b for b in bodies if not names or any(name in b.name for name in names)]


def examine_body(body: Body, cache: Path) -> Iterator[tuple[str, Examination, Losses | None]]:
    """What is said of a body, in the two ways; what is lost when it is imported."""
    with tempfile.TemporaryDirectory(prefix="corpus-") as folder:
        top = Path(folder)
        texts_of(body.packages, body.files, cache / "packages", top / "texts")
        try:
            texts = top / "texts" / body.folder
            paths = import_course(texts, top / "imported")
            losses = find_losses(texts, paths, top / "imported")
            yield "imported", examine(top / "imported"), losses
        except UsageError as error:
            print(f"{body.name} cannot be imported: {error}")
        if write_plain_course(top / "texts", top / "plain"):
            yield "as it is", examine(top / "plain"), None


def list_pages(body: Body, number: int, cache: Path) -> Iterator[str]:
    """Import a body into a folder of the cache, and yield lines: texts, and what they became."""
    folder = cache / "pages" / re.sub(r"\W+", "-", body.name)
    shutil.rmtree(folder, ignore_errors=True)
    texts_of(body.packages, body.files, cache / "packages", folder / "texts")
    texts = folder / "texts" / body.folder
    paths = import_course(texts, folder / "imported")
    sources = random.Random(body.name).sample(sorted(paths), min(number, len(paths)))
    yield f"\n{body.name} ({body.format}): {texts}; coursebuild serve -C {folder / 'imported'}"
    yield from (f"  {source} -> {paths[source]}" for source in sources)


def table_of_rules(examination: Examination, judgements: Judgements) -> Iterator[str]:
    """A line for each rule that fired."""
    for rule, groups in sorted(by_rule(examination.diagnostics).items()):
        first = next(iter(groups.values()))[0]
        count = sum(map(len, groups.values()))
        letters = Counter(judgements[key] for key in groups if key in judgements)
        verdicts = ", ".join(f"{letters[letter]} {letter}" for letter in LETTERS if letters[letter])
        rate = count * SHARE / max(examination.words, 1)
        yield f"  {first.severity:<8}{rule:<24}{count:>6}{rate:>9.1f}   {verdicts}"


def lines_of_losses(losses: Losses) -> Iterator[str]:
    """The share of the words that are on no page, and the longest runs of them."""
    share = losses.lost / max(losses.words, 1)
    yield (
        f"  on no page: {losses.lost} of {losses.words} words of prose ({share:.2%}), "
        f"{losses.silent} of them not in the account"
    )
    for path, words in losses.runs[:LONGEST]:
        yield f"    {path}: {shorten(words, 200, placeholder=' …')}"


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Rates of each body, of the worst, and of all words."""
    yield "| body | read | files | words | false errors | false warnings | hints | not judged |"
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for row in rows:
        rates = " | ".join(f"{row.rate(severity):.2f}" for severity in SEVERITIES)
        yield f"| {row.body} | {row.way} | {row.files} | {row.words} | {rates} | {row.unjudged} |"
    worst = " | ".join(f"{max(row.rate(s) for row in rows):.2f}" for s in SEVERITIES)
    yield f"| **worst** | | | | {worst} | |"
    words = sum(row.words for row in rows)
    whole = " | ".join(f"{overall(rows)[severity]:.2f}" for severity in SEVERITIES)
    yield f"| **all** | | {sum(row.files for row in rows)} | {words} | {whole} | |"


def overall(rows: Sequence[Row]) -> dict[str, float]:
    """The rates of all words together."""
    words = sum(row.words for row in rows)
    return {s: sum(row.rate(s) * row.words for row in rows) / max(words, 1) for s in SEVERITIES}


def main() -> int:
    """Print what is said of all bodies, and write what is to be judged."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("--bodies", nargs="*", default=[], help="words of the names of bodies")
    parser.add_argument("--cache", type=Path, default=Path.home() / ".cache/coursebuild-corpus")
    parser.add_argument("--pages", type=int, metavar="NUMBER", help="name texts to look at")
    parser.add_argument("--record", action="store_true", help=f"write {RESULT.name}")
    arguments = parser.parse_args()
    cache: Path = arguments.cache
    cache.mkdir(parents=True, exist_ok=True)
    if arguments.pages:
        for body in read_bodies(arguments.bodies):
            if body.format:
                print(*list_pages(body, arguments.pages, cache), sep="\n", flush=True)
        return 0
    judgements = read_judgements(JUDGED) | read_judgements(cache / "sample.txt")
    keep_judgements(judgements)
    rows, questions = [], []
    for body in read_bodies(arguments.bodies):
        for way, examination, losses in examine_body(body, cache):
            row = evaluate(body.name, way, examination, judgements)
            rows.append(row)
            questions += sample(f"{body.name}, {way}", examination.diagnostics, judgements)
            print(f"\n{body.name}, {way}: {row.files} files, {row.words} words")
            print(*table_of_rules(examination, judgements), sep="\n", flush=True)
            if losses is not None:
                print(*lines_of_losses(losses), sep="\n", flush=True)
    print("", *table(rows), sep="\n")
    (cache / "sample.txt").write_text("\n".join([*questions, ""]), encoding="utf-8")
    if questions:
        print(f"\n{len(questions) // 2} lines are to be judged: {cache / 'sample.txt'}")
    if arguments.record:
        result = {"words": sum(row.words for row in rows), **overall(rows)}
        RESULT.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
