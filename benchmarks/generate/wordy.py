"""Lessons for measuring a search: as many different words as a real course of their length has.

Entry point: `write_wordy(folder, lessons)`.

1. A vocabulary of made-up words, by rank as in a language: how often a word comes goes by
   1 / (rank + 2.7) (Mandelbrot's form of Zipf's law), so that new words keep coming.
2. A lesson has a topic: some fifty words of the whole vocabulary that come often in it.
3. About 15 kB: nine sections with prose, formulas, tables and code with names of its own.
"""

from __future__ import annotations

import bisect
import itertools
import random
from pathlib import Path

WORDS = 60_000
_STARTS = (
    "b c d f g h j k l m n p r s t v w br ch cl cr dr fl fr gr pl pr sc sh sl sp st str th tr"
).split()
_MIDDLES = "a e i o u ai ea ee ia io oa ou".split()
_ENDS = "l m n r s t ck ct nd ng nt rd rm rt st".split()
_PHYSICS_WORDS = (
    "inertia tensor momentum rotation quaternion gradient friction contact damping energy drift "
    "integrator timestep constraint pendulum oscillator velocity acceleration torque gyroscope"
).split()
_GREEK = "alpha beta gamma delta epsilon theta kappa lambda mu rho sigma tau phi psi omega".split()


def vocabulary() -> list[str]:
    """Words by rank, the commonest first; the same each time."""
    chance = random.Random(7)
    words: dict[str, None] = {}
    while len(words) < WORDS:
        # Common words are short.
        parts = 1 + (len(words) > 200) + (len(words) > 5000) * (chance.random() < 0.6)
        word = "".join(chance.choice(_STARTS) + chance.choice(_MIDDLES) for _ in range(parts))
        words[word + (chance.choice(_ENDS) if chance.random() < 0.7 else "")] = None
    return list(words)


class _Writer:
    def __init__(self) -> None:
        self.words = vocabulary()
        weights = itertools.accumulate(1 / (rank + 2.7) for rank in range(WORDS))
        self.sums = list(weights)
        chance = random.Random(3)
        self.names = [f"{self.word(chance)}_{self.word(chance)}" for _ in range(3000)]

    def word(self, chance: random.Random) -> str:
        return self.words[bisect.bisect(self.sums, chance.random() * self.sums[-1])]

    def lesson(self, number: int) -> str:
        """The text of a lesson."""
        chance = random.Random(number)
        topic = [chance.choice(self.words) for _ in range(46)] + chance.sample(_PHYSICS_WORDS, 4)

        def phrase(count: int) -> str:
            return " ".join(
                chance.choice(topic) if chance.random() < 0.15 else self.word(chance)
                for _ in range(count)
            )

        parts = []
        for section in range(9):
            names = chance.sample(self.names, 4)
            greek = chance.choice(_GREEK)
            parts += [
                f"## {phrase(3).capitalize()}",
                f"{phrase(70).capitalize()}, where $\\{greek}_{{{section}}}$ is {phrase(12)}.",
                f"$$\n\\{greek} = \\frac{{d}}{{dt}} I_{{{chance.choice('xyz')}}} + {number}\n$$",
                f"{phrase(60).capitalize()}. {phrase(25).capitalize()} with `{names[0]}`.",
                "```python fragment\n"
                + "\n".join(f"{n} = model.{chance.choice(topic)}[{k}]" for k, n in enumerate(names))
                + "\n```",
            ]
            if section % 3 == 0:
                rows = "\n".join(f"| {phrase(2)} | {chance.random():.4f} |" for _ in range(5))
                parts.append(f"| quantity | value |\n| --- | --- |\n{rows}")
        return "\n\n".join(parts) + "\n"


def write_wordy(folder: Path, lessons: int) -> None:
    """Write a course into an empty folder."""
    writer = _Writer()
    chance = random.Random(1)
    texts = folder / "content" / "lessons"
    texts.mkdir(parents=True)
    toml = ['[course]\ntitle = "Many words"\n']
    for number in range(lessons):
        level, at = divmod(number, 20)
        if at == 0:
            toml.append(f'[[level]]\nid = "{level + 1}"\ntitle = "Level {level + 1}"\n')
        title = " ".join(writer.word(chance) for _ in range(3)).capitalize()
        id, slug = f"{level + 1}.{at + 1}", f"l{number}"
        toml.append(
            f'[[level.lesson]]\nid = "{id}"\nslug = "{slug}"\ntitle = "{title}"\n'
            f'summary = "{writer.lesson(number)[3:60].splitlines()[0]}"\nstatus = "complete"\n'
        )
        (texts / f"{id}-{slug}.md").write_text(writer.lesson(number), encoding="utf-8")
    (folder / "content" / "course.toml").write_text("\n".join(toml), encoding="utf-8")
