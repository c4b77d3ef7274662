"""The moving picture of the README: a save that is refused, and mended.

Entry point: run it as a file: `.venv/bin/python docs/moving_picture.py`. It writes
docs/images/refused.svg, a drawing that moves by itself wherever SVG is shown, and holds still for
who asks for less motion.

1. The course of the README is written into a scratch folder, and `update` records its output.
2. A digit of the output is changed and `check` is called; then the digit is put back, and `check`
   is called again. What is drawn is what these two printed.
3. Each scene is a group of the drawing, the file above and the terminal below it, and is seen in
   its turn.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import textwrap
from html import escape
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "refused.svg"
RIGHT, WRONG = "4.9148", "4.8148"
FENCE = re.compile(r"^(`{3,})\S.*? file=(\S+)\n(.*?)^\1$", re.MULTILINE | re.DOTALL)
WIDTH, LINE, LEFT, SIZE = 500, 20, 18, 13
COLUMNS = 59
"""Characters of a line. All is drawn as in a narrow window, so that it can be read on a phone."""
TITLE = (
    "A digit of a recorded output is changed; coursebuild check points at it; put back, all holds"
)
SECONDS = (3.0, 2.0, 6.0, 2.0, 4.0)
"""How long each scene is seen."""
STYLE = """
svg { font: %dpx ui-monospace, 'DejaVu Sans Mono', Menlo, monospace; }
.paper { fill: #fcfbf8; } .ink { fill: #1d1d1b; } .soft { fill: #6a665e; }
.rule { stroke: #d9d5cb; } .changed { fill: #b3261e; } .right { fill: #00664b; }
@media (prefers-color-scheme: dark) {
  .paper { fill: #17191c; } .ink { fill: #e6e3dc; } .soft { fill: #a5a197; }
  .rule { stroke: #3a3d42; } .changed { fill: #ffb4ab; } .right { fill: #74d3b2; }
}
.scene { opacity: 0; animation: %gs step-end infinite; }
%s
@media (prefers-reduced-motion: reduce) { .scene { animation: none; } .scene-3 { opacity: 1; } }
"""


def printed(course: Path, command: str) -> list[str]:
    """What a command prints in the course's folder, but its rows about scripts that are right."""
    arguments = [sys.executable, "-m", "coursebuild", "-C", course, command]
    result = subprocess.run(arguments, capture_output=True, text=True)
    lines = (line for line in result.stdout.splitlines() if not line.startswith("ok "))
    return _wrap("\n".join(lines).strip().splitlines())


def _wrap(lines: list[str]) -> list[str]:
    """Lines as a narrow window shows them."""
    indent = " " * 8
    return [
        part
        for line in lines
        for part in textwrap.wrap(line, COLUMNS, subsequent_indent=indent) or [""]
    ]


class Scene(NamedTuple):
    """What is seen at a time."""

    lesson: list[str]
    word: str
    """What was changed last in the lesson; empty: nothing."""
    terminal: list[str]


def play() -> list[Scene]:
    """Call the commands; return the scenes."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        course = Path(folder)
        for _, name, text in FENCE.findall(readme):
            if name.startswith("content/"):
                (course / name).parent.mkdir(parents=True, exist_ok=True)
                (course / name).write_text(text, encoding="utf-8")
        lesson = next(course.glob("content/lessons/*.md"))
        printed(course, "update")
        right = lesson.read_text(encoding="utf-8")
        mistaken_text = right.replace(f"fallen {RIGHT} m", f"fallen {WRONG} m")
        lesson.write_text(mistaken_text, encoding="utf-8")
        refused = printed(course, "check")
        lesson.write_text(right, encoding="utf-8")
        mended = printed(course, "check")
    ask = ["$ coursebuild check"]
    end, end_with_mistake = (
        [
            part
            for line in text.rstrip().splitlines()[-5:]
            for part in textwrap.wrap(line, COLUMNS) or [""]
        ]
        for text in (right, mistaken_text)
    )
    return [
        Scene(end, "", ["$"]),
        Scene(end_with_mistake, WRONG, ask),
        Scene(end_with_mistake, WRONG, ask + refused),
        Scene(end, RIGHT, ask),
        Scene(end, RIGHT, ask + mended),
    ]


def draw(scenes: list[Scene]) -> str:
    """The drawing of the scenes, one after the other."""
    fold = 46 + LINE * max(len(scene.lesson) for scene in scenes)
    height = fold + 30 + LINE * max(len(scene.terminal) for scene in scenes)
    groups, rules, begin, whole = [], [], 0.0, sum(SECONDS)
    for number, (scene, seconds) in enumerate(zip(scenes, SECONDS, strict=True), 1):
        texts = [_draw_line(line, 50 + n * LINE, scene.word) for n, line in enumerate(scene.lesson)]
        for n, line in enumerate(scene.terminal):
            look = "changed" if line.startswith("error") else "right" if "holds" in line else "ink"
            texts.append(_text(LEFT, fold + 28 + n * LINE, escape(line), look))
        groups.append(f'<g class="scene scene-{number}">{"".join(texts)}</g>')
        first, last = 100 * begin / whole, 100 * (begin + seconds) / whole
        frames = {0.0: 0, first: 1, last: 0}
        path = " ".join(f"{at:.2f}% {{ opacity: {opacity}; }}" for at, opacity in frames.items())
        rules.append(f"@keyframes s{number} {{ {path} }}")
        rules.append(f".scene-{number} {{ animation-name: s{number}; }}")
        begin += seconds
    style = STYLE % (SIZE, whole, "\n".join(rules))
    head = _text(LEFT, 24, "content/lessons/1.1-free-fall.md", "soft")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" '
        f'viewBox="0 0 {WIDTH} {height}" role="img">'
        f"<title>{TITLE}</title><style>{style}</style>"
        f'<rect class="paper" width="{WIDTH}" height="{height}" rx="8"/>{head}'
        f'<path class="rule" d="M0 {fold}H{WIDTH}" fill="none"/>{"".join(groups)}</svg>\n'
    )


def _draw_line(line: str, y: int, word: str) -> str:
    """A line of the lesson, with the word that was changed in it."""
    before, word, after = line.partition(word or "\n")  # no line has a line break
    look = "changed" if word == WRONG else "right"
    mark = word and f'<tspan class="{look}" font-weight="bold">{word}</tspan>'
    return _text(LEFT, y, f"{escape(before)}{mark}{escape(after)}", "ink")


def _text(x: int, y: int, content: str, look: str) -> str:
    return f'<text x="{x}" y="{y}" class="{look}" xml:space="preserve">{content}</text>'


if __name__ == "__main__":
    picture = Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE
    picture.write_text(draw(play()), encoding="utf-8")
    print(f"{picture.name}: {picture.stat().st_size} bytes")
