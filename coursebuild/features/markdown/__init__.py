"""Every page as Markdown, and a list of them for language models."""

from coursebuild.core.features import Feature, PageCopy
from coursebuild.features.markdown.copies import markdown_files, note_markdown

FEATURE = Feature(
    name="markdown",
    copies=(PageCopy(ending=".md", type="text/markdown", text="exports.markdown"),),
    note=note_markdown,
    files=markdown_files,
)
