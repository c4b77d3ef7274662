"""Compiles the templates of pages that come with the tool: see `coursebuild/effects/prepared.py`.

    python site/prepare_templates.py FOLDER

`site/bundle.py` calls it with the bundle that it makes. A template becomes Python; the tool only
has to compile that, and needs no Jinja.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from coursebuild.effects.resources import template_texts
from coursebuild.render.templates import made_ahead


def prepared() -> bytes:
    """The Python of all templates by the names that `made_ahead` gives them."""
    text = json.dumps(made_ahead(template_texts()), indent=1, ensure_ascii=False, sort_keys=True)
    return f"{text}\n".encode()


def main(bundle: Path) -> None:
    """Write it into the bundle."""
    (bundle / "prepared" / "templates.json").write_bytes(prepared())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
