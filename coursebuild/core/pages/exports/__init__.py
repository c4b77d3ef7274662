"""What a course gives away besides its pages: the same lessons for other programs.

1. `markdown` writes blocks as plain Markdown (`marks`); `plain` adds the blocks that are ours.
2. `markdown_copy` is a page as Markdown, from its document, or from its HTML where it has none
   (`fromhtml`). `llms` lists these copies.
3. `notebook` is a lesson as a Jupyter notebook that runs, `notebook_file` its file.
4. `files` says which of these files a site has.
5. `context` is what exporters of features are given, `xml` what several write with.
"""
