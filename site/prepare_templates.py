"""Compiles the templates that come with the tool, so that no run has to.

    python site/prepare_templates.py FOLDER

`site/bundle.py` calls it with the bundle that it makes; `core/pages/renderer.py` loads them.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from coursebuild.core.files.resources import template_texts
from coursebuild.core.pages.renderer import compile_templates


def main(bundle: Path) -> None:
    """Write the compiled templates into a bundle."""
    compile_templates(template_texts(), bundle / "prepared")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
