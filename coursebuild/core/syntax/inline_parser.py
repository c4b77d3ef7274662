"""The inline parser: markdown-it's rules, and those for formulas, footnotes, terms and numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import cast

from markdown_it import MarkdownIt, rules_inline
from markdown_it.helpers import parseLinkLabel
from markdown_it.parser_inline import ParserInline
from markdown_it.ruler import Ruler
from markdown_it.token import Token
from markdown_it.utils import EnvType

from coursebuild.core.syntax.attributes import TERM
from coursebuild.core.syntax.block_parser import BACKTICKS, math_inline
from coursebuild.core.syntax.html import LITERAL, tag_at
from coursebuild.core.syntax.spans import InlineState, PositionedToken
from coursebuild.core.text.regex import regex

MAX_NESTING = 20
"""How deep brackets may nest and still become links and images."""
MAX_RUN = 200
"""Emphasis marks in a row; a longer run is text."""


def inline_tokens(src: str, env: EnvType, *, html: bool = False) -> list[PositionedToken]:
    """The inline tokens of a block; in `html` only tags, entities and formulas are read."""
    if src and not (_HTML_STOP if html else _STOP).search(src):
        return [PositionedToken("text", "", 0, content=src, start=0, end=len(src))]
    parser = _HTML if html else _MARKDOWN
    return cast(list[PositionedToken], parser.inline.parse(src, parser, env, []))


def _emphasis(state: rules_inline.StateInline, silent: bool) -> bool:
    """Emphasis marks and two tildes; an absurd run, or another number of tildes, is text."""
    start, mark = state.pos, state.src[state.pos]
    end = start
    while end < state.posMax and state.src[end] == mark:
        end += 1
    if end - start < MAX_RUN if mark != "~" else end - start == 2:
        rule = (
            rules_inline.strikethrough.tokenize if mark == "~" else rules_inline.emphasis.tokenize
        )
        return rule(state, silent)
    if not silent:
        state.append_pending(state.src[start:end])
    state.pos = end
    return True


_BINDING = regex(
    r"""\{out(?:=(?P<script>[^\s{}"']+)(?:\ "(?P<line>[^{}"]+)")?|="(?P<words>[^{}"]+)")?\}
    |\{(?P<given>given)="(?P<source>[^{}"]+)"\}|\{code\}""",
    re.VERBOSE,
)


def _code_span(state: rules_inline.StateInline, silent: bool) -> bool:
    """A code span; with `{out}` after it a `number_binding`, the script's path in its `info`.

    The words of `{out="words"}` are in its `meta`. With `{given="…"}` it is a `number_given`, and
    its `info` the source; that of code is `code`, if `{code}` follows.
    """
    start = state.pos
    if not rules_inline.backtick(state, silent):
        return False
    end = state.pos
    match = _BINDING.match(state.src, end, state.posMax)
    if match is None or not state.src[start:end].strip("`"):
        return True
    state.pos = match.end()
    if not silent:
        token = state.tokens[-1]
        if match[0] == "{code}":
            token.info = "code"
            return True
        token.type = "number_given" if match["given"] else "number_binding"
        token.info = match["script"] or match["source"] or ""
        token.meta["words"] = match["line"] or match["words"] or ""
        token.map = [start + len(token.markup), end - len(token.markup)]
    return True


_CITED = r"(?:[^\[\]{}@;]*\s)?@(?:[\w.:/+-]*\w)(?:[^\S\n]*,[^\[\]{};@]*)?\s*"
_LEAVES = {
    "citation": regex(rf"\[({_CITED}(?:;{_CITED})*)\](?![\[({{])"),
    "footnote_ref": regex(r"\[\^([^\s\[\]]+)\]"),
}


def _leaf(state: rules_inline.StateInline, silent: bool, *, kind: str) -> bool:
    """`[see @key, p. 12; @other]` or `[^label]`; `content` has what stands between the brackets."""
    match = _LEAVES[kind].match(state.src, state.pos, state.posMax)
    if match is None:
        return False
    if not silent:
        state.push(kind, "", 0).content = match[1]
    state.pos = match.end()
    return True


def _term(state: rules_inline.StateInline, silent: bool) -> bool:
    """`[text]{term}`: tokens `term_open` and `term_close`; `map` of the second has the braces.

    In silent mode, which only looks for the end of a link's text, these are mere brackets: so a
    term may stand in a link.
    """
    if silent:
        return False
    assert isinstance(state, InlineState)
    if state.pos > state.last_attribute:
        return False
    start, limit = state.pos, state.posMax
    end = parseLinkLabel(state, start)
    braces = TERM.match(state.src, end + 1, limit) if end >= 0 else None
    if braces is None:
        return False
    state.pos, state.posMax = start + 1, end
    state.push("term_open", "dfn", 1)
    state.md.inline.tokenize(state)
    token = state.push("term_close", "dfn", -1)
    token.map = [*braces.span(1)]
    state.pos, state.posMax = braces.end(), limit
    return True


def _link(state: rules_inline.StateInline, silent: bool) -> bool:
    """A link or image, unless no bracket closes after this one."""
    assert isinstance(state, InlineState)
    if state.pos > state.last_bracket:
        return False
    rule = rules_inline.link if state.src[state.pos] == "[" else rules_inline.image
    return rule(state, silent)


def _html(state: rules_inline.StateInline, silent: bool) -> bool:
    assert isinstance(state, InlineState)
    tag = tag_at(state.src, state.pos)
    if tag is None:
        return False
    if tag.name in LITERAL and not tag.is_complete and state.literal in ("", tag.name):
        state.literal = "" if tag.is_end_tag else tag.name
    state.push("html_inline", "", 0).content = state.src[tag.start : tag.end]
    state.pos = tag.end
    return True


def _formula(state: rules_inline.StateInline, silent: bool) -> bool:
    """A formula in a text that is HTML, or a dollar after a backslash."""
    assert isinstance(state, InlineState)
    if state.literal:
        return False
    if state.src[state.pos] == "$":
        return math_inline(state, silent)
    if not state.src.startswith("$", state.pos + 1):
        return False
    state.push("text_special", "", 0).content = "$"
    state.pos += 2
    return True


def _line_end(state: rules_inline.StateInline, silent: bool) -> bool:
    state.push("softbreak", "br", 0)
    state.pos += 1
    return True


InlineRules = dict[str, tuple[Callable[[rules_inline.StateInline, bool], bool], ...]]

_RULES: InlineRules = {
    "\n": (rules_inline.newline,),
    "\\": (rules_inline.escape,),
    "`": (_code_span,),
    "*": (_emphasis,),
    "_": (_emphasis,),
    "~": (_emphasis,),
    "[": (partial(_leaf, kind="citation"), _term, _link, partial(_leaf, kind="footnote_ref")),
    "!": (_link,),
    "<": (rules_inline.autolink, rules_inline.html_inline),
    "&": (rules_inline.entity,),
    "$": (math_inline,),
}
_STOP = regex(r"[\n\\`*_~\[\]<&$!](?:(?<!!)|(?=\[))")
"""Characters at which plain text ends; a `!` only before a bracket."""
_HTML_RULES: InlineRules = {
    "\n": (_line_end,),
    "\\": (_formula,),
    "<": (_html,),
    "&": (rules_inline.entity,),
    "$": (_formula,),
}
_HTML_STOP = regex(r"[\n\\<&$]")


class _InlineParser(ParserInline):
    """Rules by the next character; tokens get their places in the text."""

    def __init__(self, rules: InlineRules, stop: re.Pattern[str]) -> None:
        super().__init__()
        self.rules = rules
        self.ruler = Ruler()
        self.ruler.push("text", rules_inline.text)
        self.ruler.push("by character", self.apply_rule)
        self.ruler2.disable("fragments_join")
        self.terminator_re = stop

    def apply_rule(self, state: rules_inline.StateInline, silent: bool) -> bool:
        """Try the rules of the next character until one applies; give its tokens their places."""
        at, token_count = state.pos, len(state.tokens)
        for rule in self.rules.get(state.src[at], ()):
            if rule(state, silent):
                if len(state.tokens) > token_count:
                    assert isinstance(state, InlineState)
                    tokens, end = state.tokens, state.pos
                    cursor = at
                    for token in tokens[token_count:]:
                        assert isinstance(token, PositionedToken)
                        if token.end >= 0:
                            continue
                        if token.type in ("link_open", "term_open"):
                            token.start, token.end = at, at + 1
                        elif token.type != "text":
                            token.end = end
                        elif tokens[-1].markup == "autolink":
                            token.start, token.end = at + 1, end - 1
                        else:
                            token.start, token.end = cursor, cursor + len(token.content)
                            cursor = token.end
                    state.text_start = end
                return True
        return False

    def parse(self, src: str, md: MarkdownIt, env: EnvType, tokens: list[Token]) -> list[Token]:
        """Add the tokens of a whole text."""
        state = InlineState(src, md, env)
        if "`" in self.rules and "$" in src:  # only formulas need to know code spans ahead
            state.last_runs = {len(run[0]): run.start() for run in BACKTICKS.finditer(src)}
        self.tokenize(state)
        if state.delimiters or any(state.tokens_meta):  # there are emphasis marks to pair
            for rule in self.ruler2.getRules(""):
                rule(state)
        tokens.extend(state.tokens)
        return tokens


def _build_parser(rules: InlineRules, stop: re.Pattern[str]) -> MarkdownIt:
    md = MarkdownIt("zero", {"html": True, "maxNesting": MAX_NESTING})
    md.inline = _InlineParser(rules, stop)
    # Links with dangerous schemes stay links, so that they can be reported.
    md.validateLink = lambda url: True  # type: ignore[method-assign]
    return md


_MARKDOWN = _build_parser(_RULES, _STOP)
_HTML = _build_parser(_HTML_RULES, _HTML_STOP)
