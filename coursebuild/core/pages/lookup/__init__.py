"""Pages to look things up in, and what they gather from the documents of a course.

`lexicon` reads a document, `references` brings those of all documents together, `glossary` and
`symbol_index` make the pages; `sentences` finds a definition's sentence, `symbols` the letters of a
formula.
"""
