"""Compiles the templates of pages that come with the tool: see `coursebuild/effects/prepared.py`.

    python site/prepare_templates.py FOLDER

`site/bundle.py` calls it with the bundle that it makes. What Jinja makes of a template is Python;
the tool only has to compile that, which takes a fifth of the time.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from coursebuild.effects.resources import template_texts
from coursebuild.render.assets import generated


def prepared() -> bytes:
    """The Python of all templates by the names that `generated` gives them."""
    text = json.dumps(generated(template_texts()), indent=1, ensure_ascii=False, sort_keys=True)
    return f"{text}\n".encode()


def main(bundle: Path) -> None:
    """Write it into the bundle."""
    (bundle / "prepared" / "templates.json").write_bytes(prepared())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
