"""Every page as Markdown, and a list of them for language models.

1. `writer` writes a document as Markdown.
2. `copies` writes a page as Markdown: from its document, or from its HTML where it has none
   (`from_html`), and lists these copies.
"""

from coursebuild.core.features import Feature, PageCopy
from coursebuild.features.markdown.copies import markdown_files, note_markdown

FEATURE = Feature(
    name="markdown",
    copies=(PageCopy(ending=".md", type="text/markdown", text="exports.markdown"),),
    note=note_markdown,
    files=markdown_files,
)
