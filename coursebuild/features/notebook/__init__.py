"""Lessons as Jupyter notebooks that run."""

from coursebuild.api import Feature, PageCopy, on_demand

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
            services=on_demand("coursebuild.features.notebook.notebook_files:launch_services"),
        ),
    ),
    note=on_demand("coursebuild.features.notebook.notebook_files:note_cells"),
    files=on_demand("coursebuild.features.notebook.notebook_files:notebook_files"),
)
