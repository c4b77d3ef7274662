"""Every page as plain Markdown, and the list of these copies."""

from coursebuild.api import Feature, PageCopy, on_demand

FEATURE = Feature(
    name="markdown",
    copies=(PageCopy(ending=".md", type="text/markdown", text="exports.markdown"),),
    note=on_demand("coursebuild.features.markdown.page_copies:note_markdown"),
    files=on_demand("coursebuild.features.markdown.page_copies:markdown_files"),
)
