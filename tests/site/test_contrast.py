"""Contrast of every pair of colours that the style sheets can put together, in both themes.

The style sheets are read as they are written. A text's ground is the background of its own rule
where that has one, else each of the grounds that boxes have; a tint lies over these. Text must be
at 7 : 1, all else that carries meaning at 4.5 : 1.

Colours are put together by the formulas of CSS Color 4 and 5 (compositing, `color-mix` in sRGB).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import pytest

from coursebuild.core.drawing.contrast import contrast as told_apart

CSS = Path(__file__).parents[2] / "site" / "css"
SHEETS = sorted(CSS.glob("*.css"))
THEMES = ("light", "dark")
GROUNDS = ("var(--paper)", "var(--sheet)")
TRACES = tuple(f"var(--trace-{n})" for n in range(1, 8))
MEANINGFUL_COLOURS = ("var(--rule-firm)", *TRACES)
"""Colours of lines and marks that tell something."""

Colour = tuple[float, float, float, float]
"""Red, green, blue and opacity, each from 0 to 1."""


@dataclass(frozen=True)
class Rule:
    file: str
    selector: str
    at_rules: str
    """The at-rules that it stands in."""
    declarations: dict[str, str]

    @property
    def is_seen(self) -> bool:
        """Whether it is for screens in the colours of the page."""
        return not re.search("print|forced-colors", self.at_rules)


def rules(text: str, file: str, at_rules: str = "", outer: str = "") -> Iterator[Rule]:
    """The rules of a style sheet, those inside others after them."""
    own_declarations = ""
    at = 0
    while (start := text.find("{", at)) >= 0:
        before, _, head = text[at:start].rpartition(";")
        own_declarations += f"{before};"
        end, depth = start + 1, 1
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        body, head = text[start + 1 : end - 1], head.strip()
        if head.startswith("@"):
            yield from rules(body, file, f"{at_rules} {head}".strip(), outer)
        else:
            yield from rules(body, file, at_rules, f"{outer} {head}".strip())
        at = end
    pairs = (part.partition(":") for part in (own_declarations + text[at:]).split(";"))
    declarations = {name.strip(): value.strip() for name, _, value in pairs if value.strip()}
    if outer and declarations:
        yield Rule(file, outer, at_rules, declarations)


def without_comments(path: Path) -> str:
    return re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)


ALL = [rule for path in SHEETS for rule in rules(without_comments(path), path.name)]
PROPERTIES: dict[str, list[str]] = {}
for _rule in ALL:
    for _name, _value in _rule.declarations.items():
        if _name.startswith("--") and _rule.is_seen:
            PROPERTIES.setdefault(_name, []).append(_value)


def colours(value: str, theme: str) -> list[Colour]:
    """What a value can be in a theme: custom properties may be set in several places."""
    value = value.strip()
    if match := re.fullmatch(r"var\((--[\w-]+)\)", value):
        assert match[1] in PROPERTIES, f"{match[1]} is set nowhere"
        return [
            colour for definition in PROPERTIES[match[1]] for colour in colours(definition, theme)
        ]
    if match := re.fullmatch(r"light-dark\((.*)\)", value):
        light, dark = arguments(match[1])
        return colours(light if theme == "light" else dark, theme)
    if match := re.fullmatch(r"color-mix\(in srgb, (.*) (\d+)%, transparent\)", value):
        share = int(match[2]) / 100
        return [(r, g, b, a * share) for r, g, b, a in colours(match[1], theme)]
    if match := re.fullmatch(r"color-mix\(in srgb, (.*) (\d+)%, (var\(--[\w-]+\))\)", value):
        share = int(match[2]) / 100
        tops = [(r, g, b, a * share) for r, g, b, a in colours(match[1], theme)]
        return [blend(top, c) for top in tops for c in colours(match[3], theme)]
    if match := re.fullmatch(r"#([0-9a-f]{3}|[0-9a-f]{6})", value):
        digits = match[1] if len(match[1]) == 6 else "".join(2 * digit for digit in match[1])
        red, green, blue = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
        return [(red, green, blue, 1.0)]
    if match := re.fullmatch(r"rgb\((\d+) (\d+) (\d+) / (\d+)%\)", value):
        red, green, blue, alpha = (int(part) for part in match.groups())
        return [(red / 255, green / 255, blue / 255, alpha / 100)]
    raise AssertionError(f"a colour that this test does not understand: {value}")


def arguments(text: str) -> list[str]:
    parts, depth = [""], 0
    for character in text:
        depth += {"(": 1, ")": -1}.get(character, 0)
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def blend(top: Colour, ground: Colour) -> Colour:
    a = top[3]
    red, green, blue = (a * top[i] + (1 - a) * ground[i] for i in range(3))
    return red, green, blue, 1.0


def contrast(text: Colour, ground: Colour) -> float:
    """Of what a screen shows, whose channels have 256 values."""
    text_hex, ground_hex = (
        "#" + "".join(f"{round(255 * channel):02x}" for channel in colour[:3])
        for colour in (blend(text, ground), ground)
    )
    return told_apart(text_hex, [ground_hex])


def plain(theme: str) -> list[Colour]:
    return [colour for ground in GROUNDS for colour in colours(ground, theme)]


_NO_COLOUR = re.compile(
    r"inherit|currentcolor|transparent|none|unset|[A-Z]\w+|(url|linear-gradient)\(.*", re.DOTALL
)


def colour_of(rule: Rule, *names: str) -> str | None:
    """The colour that a rule gives; `None` for none, and for one of the system's."""
    for name in names:
        value = rule.declarations.get(name)
        if value is not None and not _NO_COLOUR.fullmatch(value):
            return value
    return None


def test_the_formulas() -> None:
    (white,) = colours("#fff", "light")
    assert blend((0, 0, 0, 0.5), white)[:3] == (0.5, 0.5, 0.5)
    assert contrast((0, 0, 0, 1), white) == pytest.approx(21.0)
    mixed = colours("color-mix(in srgb, light-dark(#fff, #000) 25%, transparent)", "dark")
    assert mixed == [(0.0, 0.0, 0.0, 0.25)]


def test_there_is_something_to_test() -> None:
    assert sum(colour_of(rule, "color") is not None for rule in ALL) > 60
    assert {rule.file for rule in ALL} >= {"tokens.css", "code.css", "quiz.css", "lab-live.css"}


@pytest.mark.parametrize("theme", THEMES)
def test_text(theme: str) -> None:
    failures = []
    for rule in ALL:
        text = colour_of(rule, "color")
        if text is None or not rule.is_seen:
            continue
        ground_value = colour_of(rule, "background", "background-color")
        grounds = plain(theme)
        if ground_value is not None:
            grounds = [blend(top, base) for top in colours(ground_value, theme) for base in grounds]
        least = min(
            contrast(colour, ground) for colour in colours(text, theme) for ground in grounds
        )
        if least < 7:
            failures.append((rule.file, rule.selector, text, ground_value, round(least, 2)))
    assert failures == []


WITHOUT_TEXT = (
    "::before",
    "::after",
    "::backdrop",
    "::-webkit-progress",
    "::-moz-progress",
    "> img",
)
"""Of boxes without text: marks and pictures."""
LEAST_CONTRASTS = {"var(--ink)": 7.0, "var(--ink-soft)": 4.5}
"""On what is marked for a while: a selection, the target of a link, a line."""


@pytest.mark.parametrize("theme", THEMES)
def test_text_on_tints(theme: str) -> None:
    """The text of a box that has a ground of its own and no colour of its own."""
    failures = []
    for rule in ALL:
        tint = colour_of(rule, "background", "background-color")
        if tint is None or "color" in rule.declarations or not rule.is_seen:
            continue
        if any(part in rule.selector for part in WITHOUT_TEXT):
            continue
        grounds = [blend(top, ground) for top in colours(tint, theme) for ground in plain(theme)]
        for name, limit in LEAST_CONTRASTS.items():
            least = min(contrast(a, b) for a in colours(name, theme) for b in grounds)
            if least < limit:
                failures.append((rule.file, rule.selector, tint, name, round(least, 2)))
    assert failures == []


@pytest.mark.parametrize("theme", THEMES)
def test_marks_and_lines(theme: str) -> None:
    """Frames of controls, lines of plots, their labels, the ring around what has the focus."""
    failures = []
    strokes = {value for rule in ALL for value in _strokes(rule)}
    assert strokes > {"var(--accent)", "var(--rule-firm)"}
    for value in sorted({*MEANINGFUL_COLOURS, *strokes}):
        least = min(contrast(a, b) for a in colours(value, theme) for b in plain(theme))
        if least < 4.5:
            failures.append((value, round(least, 2)))
    assert failures == []


@pytest.mark.parametrize("theme", THEMES)
def test_lines_of_a_plot_are_told_apart(theme: str) -> None:
    shades = [colour for name in TRACES for colour in colours(name, theme)]
    near = [(a, b) for a, b in combinations(shades, 2) if math.dist(a, b) < 0.24]
    assert near == []


def test_figures_of_the_course() -> None:
    """They have colours of pages, which are looked at above, but for their grid."""
    style = (CSS.parents[1] / "matplotlibrc").read_text(encoding="utf-8")
    lines = [line for line in style.splitlines() if not line.startswith(("#", "grid"))]
    colours_used = {
        f"#{digits}" for line in lines for digits in re.findall(r"\b[0-9a-f]{6}\b", line)
    }
    pairs = [
        pair for name in (*MEANINGFUL_COLOURS, "var(--ink)") for pair in PROPERTIES[name[4:-1]]
    ]
    assert len(colours_used) > 6
    assert colours_used - {pair.partition("(")[2].partition(",")[0] for pair in pairs} == set()


def _strokes(rule: Rule) -> Iterator[str]:
    """Colours of outlines, and of what is drawn, but for quiet rules, which tell nothing."""
    for name in ("outline", "outline-color", "stroke", "fill", "accent-color"):
        for value in re.findall(r"var\(--[\w-]+\)", rule.declarations.get(name, "")):
            if value not in ("var(--rule)", "var(--paper)", "var(--sheet)", "var(--shade)"):
                yield value


def test_print() -> None:
    """On white paper, in whatever is not black."""
    failures = []
    for rule in ALL:
        text = colour_of(rule, "color")
        if text is not None and "print" in rule.at_rules:
            least = min(contrast(colour, (1, 1, 1, 1)) for colour in colours(text, "light"))
            if least < 7:
                failures.append((rule.file, rule.selector, text, round(least, 2)))
    assert failures == []
