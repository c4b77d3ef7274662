"""Seed right names and numbers into right texts, and see that `check --fix` changes none.

Run: python benchmarks/kept_forms.py [--count 2000] [--seed 1]

Names are of Python, NumPy and MuJoCo, and words of fields; numbers have units, or are prices,
versions, dates, scores. Each stands as words or code between right texts of the tests. A last
lesson has a mistake of form, which has to be mended.
"""

import argparse
import random
import re
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np

from coursebuild.core.run import gate

ROOT = Path(__file__).resolve().parents[1]
TEXTS = ROOT / "tests/fixtures/right_texts/cases.txt"
LESSONS = 40
OWNERS = (mujoco, mujoco.MjModel, mujoco.MjData, mujoco.mjtJoint, np, np.linalg)
UNITS = "m s kg N Hz rad mm ms kW kPa °C % dB eV mol K V mA MiB px rpm min".split()
WORDS = "NaCl CO2 H2SO4 mRNA pH p-value AdamW OpenCV iPhone parent_frame joint_margin x_1".split()
NAMES = {*WORDS, *sys.stdlib_module_names, *(n for o in OWNERS for n in dir(o) if n[0] != "_")}
FORMS = (
    "The value {} is kept, as `{}` is.",
    "- an item with {}, and more\n",
    "## About `{}`\n\n> Of {}, “as it is”.",
    "| name | value |\n| --- | --- |\n| a | {} |\n",
    "Das Wort {} bleibt; 例如 `{}`。",
)
MISTAKE = "A sign that no text holds, \0, is deleted.\n"


def make_number(rng: random.Random) -> str:
    """A number as people write it."""
    digits, whole, unit = rng.randint(0, 4), rng.randint(0, 99_999), rng.choice(UNITS)
    quantity = f"{rng.uniform(-1000, 1000):.{digits}f} {unit}"
    version, date = f"{whole % 30}.{whole % 7}.{digits}", f"20{whole % 90 + 10}-{digits + 1:02}-09"
    forms = f"{whole:,}", f"0x{whole:X}", f"{whole % 10}:{digits + 1}", f"1e-{digits + 1}"
    power = f"${whole % 9 + 1}\\cdot 10^{{{digits + 2}}}$"
    return rng.choice((quantity, quantity.replace(".", ","), version, date, power, *forms))


def main() -> None:
    """Print how many were seeded, and the lessons that were changed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, names = random.Random(options.seed), sorted(NAMES)
    fillings = re.split(r"^=== .*\n", TEXTS.read_text("utf-8"), flags=re.MULTILINE)[1:]
    seeds = [rng.choice([rng.choice(names), make_number(rng)]) for _ in range(options.count)]
    texts = []
    for number in range(LESSONS):
        parts = [rng.choice(FORMS).replace("{}", seed) for seed in seeds[number::LESSONS]]
        texts.append("\n\n".join(f"{part}\n\n{rng.choice(fillings)}" for part in parts))
    course = '[course]\ntitle = "Seeds"\n[[level]]\nid = "1"\ntitle = "Seeds"\n'
    with tempfile.TemporaryDirectory(prefix="kept-forms-") as folder:
        paths = [Path(folder, f"content/lessons/1.{n}-seeds-{n}.md") for n in range(LESSONS + 1)]
        paths[0].parent.mkdir(parents=True)
        for n, (path, text) in enumerate(zip(paths, (*texts, MISTAKE), strict=True)):
            path.write_text(text, encoding="utf-8")
            course += f'[[level.lesson]]\nid = "1.{n}"\nslug = "seeds-{n}"\ntitle = "Seeds {n}"\n'
            course += 'status = "complete"\n'
        Path(folder, "content/course.toml").write_text(course, encoding="utf-8")
        command = gate.module_command("coursebuild", "-C", folder, "check", "--fix")
        gate.finish(command, gate.environment(*gate.TOOL))
        changed = [n for n in range(LESSONS) if paths[n].read_text("utf-8") != texts[n]]
        is_mended = paths[-1].read_text("utf-8") == MISTAKE.replace("\0", "")
    print(f"{len(seeds)} seeds; lessons changed: {changed or 'none'}; mistake mended: {is_mended}")
    sys.exit(bool(changed) or not is_mended)


if __name__ == "__main__":
    main()
