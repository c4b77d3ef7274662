"""Finds the numbers that a document states, and what each is held against.

Entry points: `document_claims(document)`; `sourced_claims`, of a document's numbers whose source is
a part of the course, and `check_sources`, which looks there; `unbound_results`, of those that
neither a script, a formula nor a source gives.

1. A number in digits is a claim, except: a whole number up to twelve without a unit, which counts
   or names as a word does; a year; what only looks like a number (versions, dates, `x1`).
2. Headings, footnotes (which name sources), code, addresses, links to lessons, pages and models,
   recorded outputs and the texts of quizzes and labs have no claims but those with a source.
3. In formulas a side that is a number is one claim, but for a digit without a unit. A chain whose
   arithmetic was checked has none, and its numbers are inputs.
4. A number in an alternative text, where nothing can be marked, is a claim unless the same number
   is bound or given in the document.
5. A source that is a part of the course must have the number: in the unit of the text or in base
   units, perhaps with more digits. A model may have half of it, since MJCF writes radii and
   half-lengths. Any other source is for readers to judge.
6. What the map says of a lesson has claims too, unless the same number is bound in the map.
7. What the lesson's own scripts, models and labs hold is an input, not a result.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from itertools import groupby
from math import isfinite
from operator import itemgetter

from msgspec.structs import replace

from coursebuild.api import Diagnostic, Excerpt, Fix, Span, diagnose, did_you_mean, model, regex
from coursebuild.core.registry import kind_of_block
from coursebuild.core.syntax.document import read_again
from coursebuild.core.text.numbers import Number, point_decimals, scan_prose
from coursebuild.core.text.quantities import unit_behind, unit_of_header
from coursebuild.core.text.units import find_unit
from coursebuild.features.arithmetic.evaluate import FormulaComparison, measure, read_numeral
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.statements import FormulaSide, read_statements
from coursebuild.features.arithmetic.symbol_values import check_formulas
from coursebuild.features.truth.model import Claims, StatedNumber

_PART = regex(
    r"[\w.-]+(?:/[\w.-]+)+\.[a-z]+|(?:content|examples|lib|models|runs)/\S*|lab|#lab:\S+|lesson:\S+"
)
"""A source that is a part of the course, also where its name is misspelt."""
_LITERAL = regex(r"(?<![\w.])(?:\d+(?:_\d{3})*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_MODEL_PATH = regex(r"models/([\w/-]+)\.xml")

_COUNTS = 12
_YEARS = range(1600, 2100)
_OTHER = "\ufffc"
"""Stands for code, a formula or a link behind a text: `in` is no unit before one."""
_FACTORS = regex(r"(?:\s*×\s*[\d.]+)*")
_MAY_CLAIM = regex(r"\d\.?\d|\d(?:\\[ ,;]|[\s~])*(?:\\(?:mathrm|text|%)|\^?\{?\\circ|°)")
"""Two digits, or one with a unit."""
_DIGIT = regex("[0-9]")
_VECTOR = regex(r"\s*[(\[](?:[-+\d.,;\s]|\\[,;: ])+[)\]]\s*")


# --- held against the course


class _Parts:
    """The texts of a course that can be named as a source."""

    def __init__(self, course: model.Course) -> None:
        self.models = {file.name: file.source.text for file in course.models}
        scripts = (s for document in course.documents for s in model.document_scripts(document))
        self.texts = {f"models/{name}.xml": text for name, text in self.models.items()}
        self.texts |= {script.path: script.code.text for script in scripts}
        self.texts |= {
            f"lesson:{owner.id}": document.source.text
            for owner, document in course.owned_documents
            if isinstance(owner, model.Lesson)
        }
        self.numbers = cache(lambda name: frozenset(_literals(name, self.texts[name])))

    def of_labs(self, document: model.Document) -> dict[str, str]:
        """The texts of a document's labs, with the models that they show."""
        labs: dict[str, str] = {}
        for block in model.find_blocks(document, model.FeatureBlock):
            if kind_of_block(block).label == "lab":
                models = (self.models.get(name, "") for name in block.models())
                text = "\n".join((block.span.text, *models))
                labs["lab"] = labs.get("lab", "") + text
                if block.label is not None:
                    labs[f"#{block.label.id}"] = text
        return labs

    def inputs(self, document: model.Document) -> set[float]:
        """The numbers in the scripts and labs of a document, and in the models that these name."""
        scripts = [script.code.text for script in model.document_scripts(document)]
        texts = [*scripts, self.of_labs(document).get("lab", "")]
        names = {name for text in texts for name in _MODEL_PATH.findall(text)}
        paths = {f"models/{name}.xml" for name in names & {*self.models}}
        numbers = {number for text in texts for number in _literals("lab", text)}
        return numbers.union(*map(self.numbers, paths))


def _literals(name: str, text: str) -> Iterator[float]:
    for match in _LITERAL.finditer(text):
        value = float(match[0].replace("_", "").rstrip("."))
        yield value
        if name == "lab" or name.endswith(".xml"):
            yield 2 * value


def check_sources(
    course: model.Course, documents: Iterable[tuple[model.Document, Claims]]
) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each number that the part named as its source does not hold."""
    parts = _Parts(course)
    for document, claims in documents:
        labs = parts.of_labs(document) if claims.sourced else {}
        for claim in claims.sourced:
            unknown = [name for name in claim.sources if name not in parts.texts | labs]
            if unknown:
                message = f"`{unknown[0]}` names no script, model, lab or lesson here"
                names = [n for n in (*parts.texts, *labs) if not n.startswith("lesson:")]
                help = did_you_mean(unknown[0], names)
                if isinstance(help, Fix) and claim.mark is not None:
                    help = help.at(claim.mark)
                yield diagnose("given-source", claim.span, message, help=help)
                continue
            numbers = (
                _literals("lab", labs[name]) if name in labs else parts.numbers(name)
                for name in claim.sources
            )
            if not claim.is_in(number for part in numbers for number in part):
                subject = " and ".join(f"`{name}`" for name in claim.sources)
                verb = "has" if len(claim.sources) == 1 else "have"
                message = f"{subject} {verb} no number `{claim.text}`"
                help = "bind the number to an output, or name where it is from"
                if not claim.text:
                    message = f"no number stands here that {subject} could hold"
                    help = "delete the mark"
                yield diagnose("given-source", claim.span, message, help=help)


def unbound_results(course: model.Course) -> Iterator[tuple[model.Owner, tuple[StatedNumber, ...]]]:
    """Yield the results that each lesson and page of the menu states, and nothing gives."""
    parts = _Parts(course)
    bound = {part.text for number in course.bound_numbers for part in scan_prose(number.text)}
    for owner, document in course.owned_documents:
        if isinstance(owner, model.Lesson) or owner.menu:
            claims = document_claims(read_again(course, owner, document))
            texts: tuple[str, ...] = ()
            if isinstance(owner, model.Lesson):
                texts = (owner.title, owner.summary, *owner.objectives)
            of_map = [
                _claim(number, owner.span, _unit_of(number, text))
                for text in texts
                for number in find_numbers(text, document.comma)
                if number.text not in bound
            ]
            results = [*claims.open, *of_map]
            inputs = parts.inputs(document).union(claims.inputs) if results else ()
            yield owner, tuple(claim for claim in results if not claim.is_in(inputs))


# --- found in a document


def sourced_claims(document: model.Document) -> Claims | None:
    """The claims of a document that name a part of the course; `None` where there are none."""
    sourced = document_claims(document).sourced
    return Claims((), sourced) if sourced else None


def document_claims(document: model.Document) -> Claims:
    """Find the claims of a document in its text."""
    counter = _Counter(check_formulas(document), document.comma)
    counter.blocks(document.blocks)
    count = len(counter.open)
    for footnote in document.footnotes:
        counter.blocks(footnote.blocks)
    del counter.open[count:]
    bound_texts = {part.text for text in counter.marked for part in scan_prose(text)}
    alternatives = (claim for claim in counter.alternatives if claim.text not in bound_texts)
    claims = sorted((*counter.open, *alternatives), key=lambda claim: claim.span.start)
    return Claims(tuple(claims), tuple(counter.sourced), tuple(sorted(counter.inputs)))


class _Counter:
    def __init__(
        self, comparisons: Mapping[int, tuple[FormulaComparison, ...]], comma: bool
    ) -> None:
        """`comma`: whether one may stand before the decimals of a number."""
        self.comparisons, self.comma = comparisons, comma
        self.open: list[StatedNumber] = []
        self.sourced: list[StatedNumber] = []
        self.inputs: set[float] = set()
        self.marked: set[str] = set()
        """The texts that are bound or given."""
        self.alternatives: list[StatedNumber] = []

    def blocks(self, blocks: Iterable[model.Block]) -> None:
        """Add the claims of blocks."""
        for block in blocks:
            first = len(self.open)
            if isinstance(block, model.MathBlock):
                source = None if block.label is None else block.label.source
                self.formula(block, source)
            elif isinstance(block, model.Table):
                self.inlines(block.caption)
                self.table(block)
            else:
                self.inlines(model.block_inlines(block))
                self.blocks(model.child_blocks(block))
            mark = getattr(block, "source_mark", None)
            if mark is not None:
                self.give(mark.source, mark.span, self.open[first:])
            elif isinstance(block, model.Recording) and isinstance(block.body, model.Table):
                del self.open[first:]
            if mark is not None or isinstance(block, model.Heading | model.FeatureBlock):
                del self.open[first:]

    def table(self, table: model.Table) -> None:
        """Add the claims of cells, a number alone in its cell with the unit of its column."""
        headers = (model.plain_text(cell.children) for cell in table.header)
        units = [unit_of_header(header).text for header in headers]
        for row in (table.header, *table.rows):
            for cell, unit in zip(row, units, strict=True):
                text = model.plain_text(cell.children).strip()
                numbers = scan_prose(text) if table.source_mark is not None else ()
                is_plain = all(isinstance(child, model.Text) for child in cell.children)
                if is_plain and len(numbers) == 1 and numbers[0].text == text:
                    self.open.append(_claim(numbers[0], cell.span, unit))
                else:
                    self.inlines(cell.children)

    def give(self, source: str, mark: Span, claims: Iterable[StatedNumber]) -> None:
        """Give claims their source; a part of the course is kept with each of them."""
        names = tuple(name.strip() for name in source.split(","))
        claims = tuple(claim for claim in claims if claim.values)
        self.inputs |= {claim.values[0][0] for claim in claims}
        if all(map(_PART.fullmatch, names)):
            claims = claims or (StatedNumber(mark, ""),)
            self.sourced += (replace(claim, sources=names, mark=mark) for claim in claims)

    def inlines(self, inlines: Iterable[model.Inline]) -> None:
        """Add the claims of inlines."""
        row = tuple(inlines)
        for is_text, group in groupby(row, lambda i: isinstance(i, model.Text | model.SoftBreak)):
            if is_text:  # a unit may stand on the next line
                pieces = [*group]
                following = "" if pieces[-1] is row[-1] else _OTHER
                self.open += _text_claims(pieces, following, self.comma)
        for inline in row:
            match inline:
                case model.NumberBinding():
                    self.number(inline)
                case model.Math():
                    source = inline.source
                    if source is None and inline.label is not None:
                        source = inline.label.source
                    if inline.meaning is not None and source is None and inline.value is None:
                        source = ""  # a symbol stands for a value because the author says so
                    if inline.value is not None:
                        self.number(inline.value)
                        source = None
                    self.formula(inline, source)
                case model.Image():
                    for bound in inline.numbers:
                        self.number(bound)
                    matches = find_numbers(inline.alt, self.comma)
                    numbers = {number.text: number for number in matches}
                    self.alternatives += (_claim(n, inline.span) for n in numbers.values())
                case model.Link(target=model.UrlTarget() | model.TermTarget() as target):
                    texts = (child for child in inline.children if isinstance(child, model.Text))
                    text = "".join(child.text for child in texts)
                    if isinstance(target, model.TermTarget) or text not in target.url:
                        self.inlines(inline.children)
                case model.Emphasis() | model.Strong() | model.Strikethrough() | model.Term():
                    self.inlines(inline.children)
                case _:
                    pass

    def number(self, number: model.NumberBinding) -> None:
        """Add a number that is bound or given."""
        self.marked.add(number.text)
        if number.source is None:
            return
        text = point_decimals(number.text) if number.comma else number.text
        numbers = scan_prose(text)
        unit = number.unit or (text[numbers[-1].end :].strip() if numbers else "")
        unit = unit or unit_behind(number.span.source.text, number.span.end).text
        mark = Span(number.span.source, number.text_span.end, number.span.end)
        claims = (_claim(part, number.text_span, unit) for part in numbers)
        self.give(number.source, mark, claims)

    def formula(self, formula: model.Math | model.MathBlock, source: str | None) -> None:
        """Add the claims of a formula, but for what is bound in it."""
        tex = formula.tex
        for number in formula.numbers:
            self.number(number)
        if source is None and _MAY_CLAIM.search(tex.text) is None:
            return
        comparisons = self.comparisons.get(tex.span().start, ())
        proofs = [comparison for comparison in comparisons if comparison.kind == "holds"]
        claims: list[StatedNumber] = []
        for statement in read_statements(tex.text, self.comma):
            first, last = statement.sides[0], statement.sides[-1]
            if any(first.start <= proof.start < last.end for proof in proofs):
                numbers = scan_prose(tex.text[first.start : last.end])
                self.inputs |= {float(number.value) for number in numbers if number.is_finite}
                continue
            for side in filter(lambda side: side.is_numeric, statement.sides):
                if source is not None or _MAY_CLAIM.search(tex.text, side.start, side.end):
                    claims += _side_claims(side, tex, self.comma)
        bound = [number.text_span for number in formula.numbers]
        claims = [c for c in claims if not any(map(c.span.contains, bound))]
        if source is None:
            self.open += claims
        else:
            self.give(source, Span(tex.source, tex.span().end, formula.span.end), claims)


def find_numbers(text: str, comma: bool = False) -> Iterator[Number]:
    """Yield the numbers of a text that are claims; `comma`: it may stand before decimals."""
    text = point_decimals(text) if comma else text
    if _DIGIT.search(text) is None:
        return  # saves time: most texts have no number, and scanning is slow
    for number in scan_prose(text):
        if not number.is_finite:
            continue
        is_whole = number.is_integer or number.text.endswith(".")
        is_small = is_whole and (number.value in _YEARS or abs(number.value) <= _COUNTS)
        if not is_small or _unit_of(number, text):
            yield number


def _unit_of(number: Number, text: str) -> str:
    """The unit behind a number, or behind those with which it is multiplied: `20 × 10 × 4 cm`."""
    factors = _FACTORS.match(text, number.end)
    return unit_behind(text, factors.end() if factors else number.end).text


def _text_claims(
    inlines: Iterable[model.Inline], following: str, comma: bool
) -> Iterator[StatedNumber]:
    places: list[tuple[int, str, Span]] = []
    text = ""
    for inline in inlines:
        piece = inline.text if isinstance(inline, model.Text) else " "
        places.append((len(text), piece, inline.span))
        text += piece
    if text[-1:].isspace():
        text += following
    for number in find_numbers(text, comma):
        start, piece, span = places[bisect_right(places, number.start, key=itemgetter(0)) - 1]
        if span.end - span.start == len(piece):  # not so with escapes in it
            first = span.start + number.start - start
            span = Span(span.source, first, first + len(number.text))
        yield _claim(number, span, _unit_of(number, text))


def _claim(number: Number, span: Span, unit_text: str = "") -> StatedNumber:
    unit = find_unit(unit_text) if unit_text else None
    size = float(measure(unit)) if unit is not None else 1.0
    zero = float(unit.zero) if unit is not None else 0.0
    value, step = float(number.value), float(f"1e{number.place}")
    if not (isfinite(value) and isfinite(step)):
        return StatedNumber(span, number.text)  # larger than any number of a script
    return StatedNumber(span, number.text, ((value, step), ((value + zero) * size, step * size)))


def _side_claims(side: FormulaSide, tex: Excerpt, comma: bool) -> Iterator[StatedNumber]:
    """Yield the number that a side is, or those of a vector such as `(0.2, 0, -0.5)`."""
    part = tex.text[side.start : side.end]
    if _VECTOR.fullmatch(part):
        for number in find_numbers(part, comma):
            yield _claim(number, tex.span(side.start + number.start, side.start + number.end))
        return
    place = tex.span(side.end - len(part.lstrip()), side.start + len(part.rstrip()))
    expression = side.expression if side.is_numeric else None
    numeral = None
    with suppress(NotUnderstood):  # a unit may be a word
        numeral = read_numeral(expression) if isinstance(expression, Expression) else None
    if numeral is None:
        yield StatedNumber(place, place.text)
        return
    step, size = float(numeral.step), float(numeral.unit_size)
    values = ((float(numeral.express(numeral.value)), step / size), (float(numeral.value), step))
    yield StatedNumber(place, place.text, values)
