"""What documents define and refer to: terms, symbols, formulas and links.

`lexicon` reads a document, with the sentence of a definition (`sentences`) and the letters of a
formula (`symbols`); `references` brings those of all documents together. The feature `glossary`
makes pages of it.
"""
