"""Check a whole course: lessons, terms, formulas and the rules of features."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping

from coursebuild.core.checks.links import LinkTargets, check_links, link_targets
from coursebuild.core.model import (
    Course,
    Document,
    Term,
    document_blocks,
    document_scripts,
    find_formulas,
    find_inlines,
    is_blank,
)
from coursebuild.core.model.blocks import title_line
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.registry import features
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Note, diagnose, did_you_mean, propose
from coursebuild.core.text.near import nearest
from coursebuild.core.text.source import Excerpt, Span


def check_course(course: Course) -> tuple[Diagnostic, ...]:
    """Check lessons, links, mentions and terms against each other, and the rules of features."""
    targets, documents = link_targets(course), course.documents
    diagnostics = [
        diagnostic
        for document in documents
        for diagnostic in _check_core_rules(course, document, targets)
    ]
    scripts = {s.path: s for document in documents for s in document_scripts(document)}
    first: dict[str, Span] = {}
    for entry in course.unproven:
        script, notes = scripts.get(entry.path), []
        if first.setdefault(entry.path, entry.span) is not entry.span:
            message, help = f"the script `{entry.path}` is named twice", "remove it here"
            notes = [Note("the first one is here", first[entry.path])]
        elif script is None:
            message = f"no lesson or page has a script `{entry.path}`"
            help = did_you_mean(entry.path, scripts) or "remove it"
        elif not (script.norun or script.requires):
            message = f"`{entry.path}` always runs: it says neither `norun` nor `requires`"
            help = "remove it"
        else:
            continue
        diagnostics.append(diagnose("unproven-name", entry.span, message, help=help, notes=notes))
    return (*diagnostics, *_check_features(course, documents))


def check_document(
    course: Course, document: Document, targets: LinkTargets
) -> tuple[Diagnostic, ...]:
    """What `check_course` finds in one document, given what the rest of the course offers."""
    diagnostics = _check_core_rules(course, document, targets)
    return (*diagnostics, *_check_features(course, (document,)))


def _check_core_rules(
    course: Course, document: Document, targets: LinkTargets
) -> Iterator[Diagnostic]:
    source = document.source
    for lesson in course.lessons:
        if lesson.document is not document or not is_blank(document_blocks(document)):
            continue
        help = 'say `status = "planned"` in the map and remove the file'
        if lesson.status == "complete":
            message = f"lesson {lesson.id} is complete, but there is nothing to read in it"
            help = f'write it, say `status = "draft"` in the map, or {help}'
            yield diagnose("lesson-empty", source.span(0, 0), message, help=help)
        elif not document.blocks:
            message = f"lesson {lesson.id} is a draft, and its file is empty"
            yield diagnose("draft-empty", source.span(0, 0), message, help=f"begin it, or {help}")
    span = title_line(document.source)
    for page in course.pages:
        if page.document is document and span is not None and span.text != page.title:
            message = f"the course map calls this page `{page.title}`"
            yield diagnose("heading-top", span, message, help="give it one title in both")
    yield from check_links(course, document, targets)
    for term in find_inlines(document, Term):
        first = targets.terms.get(term.id)
        if first is None or (first.path, first.start) == (term.span.path, term.span.start):
            continue
        message = f"the term `{term.id}` is defined twice"
        help = "leave one definition, and link to it from here: "
        help += f'`[…](term:{term.id})`; or name this one by `{{term="…"}}`'
        notes = [Note("the first one is here", first)]
        yield diagnose("term-repeated", term.span, message, help=help, notes=notes)


def _check_features(course: Course, documents: Collection[Document]) -> Iterator[Diagnostic]:
    for feature in features():
        if feature.check is None:
            continue
        try:
            yield from feature.check(course, documents)
        except Exception as error:
            note = "it fails for no text alone"
            for document in documents:
                try:
                    tuple(feature.check(course, (document,)))
                except Exception:
                    note = f"it fails for {document.source.path}"
                    break
            error.add_note(note)
            raise


_WORDS = re.compile(
    r"\\(?:text\w*|math(?:rm|sf|tt|it|bf|cal|bb|frak|scr)|operatorname\*?|begin|end|tag|label|ref"
    r"|href|color|boldsymbol|mbox|hbox|bm)\s*\{[^{}]*\}|[_^]\s*\{[A-Za-z0-9 ,]*\}"
)
"""What stands in letters of its own, and indices that are words."""
_COMMANDS = frozenset(
    """
    alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta iota kappa lambda sigma tau
    upsilon phi varphi chi psi omega rho pi Gamma Delta Theta Lambda Sigma Upsilon Phi Psi Omega
    frac tfrac dfrac sqrt cdot cdots ldots dots times approx leq geq neq equiv infty partial nabla
    dot ddot hat vec tilde overline mathrm mathbf mathcal boldsymbol sin cos tan cot arcsin arccos
    arctan sinh cosh tanh exp log lim prod quad qquad langle rangle lVert rVert
    """.split()
)
"""Commands that no product of letters spells."""
_SHORT_COMMANDS = frozenset("mu nu xi ln le ge ne in to int sum det bar sgn".split())
"""Those that one may; they are taken for commands where the text uses them as such."""
_LETTERS = re.compile(r"\\[A-Za-z]+|\\.|[A-Za-z]+", re.DOTALL)
_BRACKETS = re.compile(r"\\[{}]|\\[^{}]|[()\[\]]", re.DOTALL)
_PAIR = re.compile(
    r"\([^()\[\]]*\)|\[[^()\[\]]*[,;][^()\[\]]*[)\[]|[(\]][^()\[\]]*[,;][^()\[\]]*\]"
    r"|\][^()\[\]]*[,;][^()\[\]]*\[|\[[^()\[\]]*\]"
)
"""Brackets with none between them that belong together; those of an interval may differ."""
_SLIPS = (
    (r"(?:^|[(\[=+,;&-])\s*(')", "this prime follows nothing", "write the letter before it"),
    (
        r"(?<![\\A-Za-z])[A-Za-z]{4,}(?=\{)",
        "these letters and their braces are no command",
        "write `\\` and the command's name",
    ),
    (r"[-+=/]\s*(_)\w(?![\w^{(])", "this index follows nothing", "write the letter before it"),
    (
        r"(?<=[\w)}\]'])\s*(--|\+\s*\+|=\s*=|\\cdot\s*\\cdot\b)(?=\s*[\w\\({])",
        "an operator stands here twice",
        "delete one of the two",
    ),
    (
        r"(?:[-+*/]|\\cdot)\s*(\d+\.\.\d+)|(?<![\w.])(\.\d+\.)(?![\d.])"
        r"|[=+*/<>-]\s*(\d+ +\d{1,2})(?=\s*(?:$|[=+*/)<>,;-]))",
        "this is no number",
        "write one point, or a comma between two numbers",
    ),
)
"""What no formula has, with what is wrong and how to mend it."""
_JOINT = re.compile(
    rf"[A-Za-z]{{0,2}}?({'|'.join(sorted(_COMMANDS, key=len, reverse=True))})[A-Za-z]{{0,2}}"
)
"""A command without its backslash that has run into a letter or two."""
_WORDS_WITH_COMMANDS = frozenset(
    """
    blog chat chia chin chip clog cost costs cosy cots dote dots expo hats limb lime limp logo logs
    meta prods seta sine sing sink sins slim slog tang tank tans taut that vecs what
    """.split()
)


def _formula_uses(document: Document) -> Iterator[tuple[Formula, Excerpt]]:
    """Every formula with its TeX in the text; empty ones were reported by the parser."""
    for _, formula in find_formulas(document):
        if formula.tex.text.strip():
            yield Formula(formula.tex.text, formula.display), formula.tex


def document_formulas(document: Document) -> tuple[Formula, ...]:
    """Each different formula of one document, in order of first use."""
    return tuple(dict.fromkeys(formula for formula, _ in _formula_uses(document)))


def check_formulas(
    document: Document, typeset: Mapping[Formula, str | MathError]
) -> tuple[Diagnostic, ...]:
    """One diagnostic for each place where a formula that does not parse stands."""
    diagnostics: list[Diagnostic] = []
    uses = [*_formula_uses(document)]
    used_commands = {
        command[1:] for _, tex in uses for command in re.findall(r"\\[A-Za-z]+", tex.text)
    }
    commands = _COMMANDS | (_SHORT_COMMANDS & used_commands)
    for formula, tex in uses:
        result = typeset[formula]
        if not isinstance(result, MathError):
            diagnostics += _check_letters(tex, commands)
            continue
        span = tex.span()
        if result.position is not None:
            at = min(result.position, len(tex.text) - 1)
            span = tex.span(at, at + 1)
        message, help = f"the formula does not parse: {result.message}", ""
        if command := re.search(r"unknown command \\([A-Za-z]+)", result.message):
            at = tex.text.find(command[1])
            place = span if at < 0 else tex.span(at, at + len(command[1]))
            likely = nearest(command[1], _COMMANDS)
            if likely is not None:
                help = propose(command[1], likely).at(place)
        diagnostics.append(diagnose("math-syntax", span, message, help=help))
    return tuple(diagnostics)


def _stands_in_fence(place: Span) -> bool:
    """Whether a place is inside a fenced block, as far as its lines above show."""
    opening = ""
    for match in re.finditer(r"^[ \t>]*(`{3,}|~{3,})", place.source.text[: place.start], re.M):
        if not opening:
            opening = match[1]
        elif match[1].startswith(opening):
            opening = ""
    return bool(opening)


def _check_letters(tex: Excerpt, commands: frozenset[str]) -> Iterator[Diagnostic]:
    """Report commands without their backslash, and brackets without the other one."""
    text = _WORDS.sub(lambda match: " " * len(match[0]), tex.text)
    for letters in _LETTERS.finditer(text):
        command, run = letters[0], letters[0]
        if run not in commands:
            joint = _JOINT.fullmatch(run) if run not in _WORDS_WITH_COMMANDS else None
            if joint is None or len(run) - len(joint[1]) > (1 if len(joint[1]) < 4 else 2):
                continue
            command = joint[1]
        proposal = run.replace(command, f" \\{command} ").replace("\\ ", "\\").strip()
        message = f"`{run}` would be shown as a product of letters"
        help = f"write `{proposal}`, or `\\mathrm{{{run}}}` for a name"
        place = tex.span(*letters.span())
        is_string = _stands_in_fence(place)  # there a backslash may need another
        yield diagnose(
            "math-command", place, message, help=Fix(help, None if is_string else proposal)
        )
    for pattern, message, help in _SLIPS:
        if (slip := re.search(pattern, text)) is not None:
            yield diagnose(
                "math-syntax", tex.span(*slip.span(slip.lastindex or 0)), message, help=help
            )
    if (at := text.find("`")) >= 0:
        message, help = "a backtick would be shown in this formula", Fix("delete it", "", safe=True)
        yield diagnose("math-syntax", tex.span(at, at + 1), message, help=help)
    is_one_sided = re.search(r"\\(?:left|right)\s*\.", text) is not None
    while (rest := _PAIR.sub(lambda match: " " * len(match[0]), text)) != text:
        text = rest
    comma = re.search(r"(?<=[\w})]),(?=\\mathrm\s*(?:\{d\}|d\b|d[A-Z]\b))", tex.text)
    if comma is not None and "\\int" in tex.text and text[comma.start()] == ",":
        message, help = "a comma would be shown before this differential", Fix("write `\\,`", "\\,")
        yield diagnose("math-syntax", tex.span(*comma.span()), message, help=help)
    if is_one_sided:
        return
    unmatched: list[int] = []
    for bracket in _BRACKETS.finditer(text):
        if bracket[0] in ("(", "[", "\\{"):
            unmatched.append(bracket.start())
        elif bracket[0] in (")", "]", "\\}"):
            if not unmatched:
                unmatched = [bracket.start()]
                break
            unmatched.pop()
    if unmatched:
        at = unmatched[-1]
        end = at + (2 if text[at] == "\\" else 1)
        help = "write the missing one, or `\\lbrack`, `\\rbrack` where one stands alone"
        message = f"`{text[at:end]}` has no matching bracket"
        yield diagnose("math-brackets", tex.span(at, end), message, help=help)
