"""The formulas of a course, and diagnostics of those that do not parse or look mistyped.

Entry points: `course_formulas(course)`; `document_formulas` and `check_formulas` for one
document.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from coursebuild.core.model import Course, Document, find_formulas
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

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
_INTERVAL = re.compile(r"[()\[\]][^()\[\]]*[,;][^()\[\]]*[()\[\]]|\\(?:left|right)\s*\.|\\begin")


def _formula_uses(document: Document) -> Iterator[tuple[Formula, Excerpt]]:
    """Every formula with its TeX in the text; empty ones were reported by the parser."""
    for _, formula in find_formulas(document):
        if formula.tex.text.strip():
            yield Formula(formula.tex.text, formula.display), formula.tex


def course_formulas(course: Course) -> tuple[Formula, ...]:
    """Each different formula of the course, in order of first use."""
    return tuple(dict.fromkeys(f for d in course.documents for f in document_formulas(d)))


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
        diagnostics.append(
            diagnose("math-syntax", span, f"the formula does not parse: {result.message}")
        )
    return tuple(diagnostics)


def _check_letters(tex: Excerpt, commands: frozenset[str]) -> Iterator[Diagnostic]:
    """Report commands without their backslash, and brackets without the other one."""
    text = _WORDS.sub(lambda match: " " * len(match[0]), tex.text)
    for letters in _LETTERS.finditer(text):
        if letters[0] in commands:
            message = f"`{letters[0]}` would be shown as a product of letters"
            help = f"write `\\{letters[0]}`, or `\\mathrm{{{letters[0]}}}` for a name"
            yield diagnose("math-command", tex.span(*letters.span()), message, help=help)
    if (prime := re.search(r"(?:^|[(\[=+,;&-])\s*(')", text)) is not None:
        message, help = "this prime follows nothing", "write the letter before it"
        yield diagnose("math-syntax", tex.span(*prime.span(1)), message, help=help)
    if (at := text.find("`")) >= 0:
        message, help = "a backtick would be shown in this formula", "delete it"
        yield diagnose("math-syntax", tex.span(at, at + 1), message, help=help)
    if _INTERVAL.search(text):
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
        help = "write the other one, or `\\lbrack`, `\\rbrack` where one stands alone"
        message = f"`{text[at:end]}` has no bracket that belongs to it"
        yield diagnose("math-brackets", tex.span(at, end), message, help=help)
