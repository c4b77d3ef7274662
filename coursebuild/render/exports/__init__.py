"""What a course gives away besides its pages: the same lessons for other programs.

1. `markdown` writes blocks as plain Markdown (`marks`); `plain` adds the blocks that are ours.
2. `twin` is a page as Markdown, from its document, or from its HTML where it has none (`fromhtml`).
3. `notebook` is a lesson as a Jupyter notebook that runs, `notebook_file` its file.
4. `parts` makes of a drawn lesson its part of the whole course (`rewrite`); `book` and `epub` put
   these together, as one page and as an e-book.
5. `page` says what a page gives to all of these, `files` which files a site has.
"""
