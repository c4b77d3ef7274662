"""The language server, on the course in memory that the preview uses as well.

- `lsp`: the command: threads, and what ends with what
- `server`: what a client may ask; `texts`: of which; `places`: its positions and offsets
- `diagnosis`: what is wrong, in the texts as they are
- `lookup`: what something in a text stands for; `engine`: the same of a field of MuJoCo
- `completion`; `fields`: the keys of JSON and TOML that are known at a place
- `actions`: edits that are offered; `renaming`; `outline`: headings, folding, formatting
"""
