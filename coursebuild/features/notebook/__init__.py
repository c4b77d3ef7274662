"""Every lesson as a Jupyter notebook that runs.

1. `cells` writes a lesson as cells of Markdown and code, when its page is drawn.
2. `files` writes them to files, with a cell that writes what the scripts need (`setup`).
"""

from coursebuild.core.features import Feature, PageCopy
from coursebuild.features.notebook.cells import note_cells, notebook_files

FEATURE = Feature(
    name="notebook",
    needs=("markdown",),
    copies=(
        PageCopy(
            ending=".ipynb",
            type="application/x-ipynb+json",
            text="exports.notebook",
            lessons=True,
            download=True,
        ),
    ),
    note=note_cells,
    files=notebook_files,
)
