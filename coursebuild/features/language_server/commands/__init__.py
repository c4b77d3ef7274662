"""The language server, which keeps the course in memory as the preview does.

- `lsp`: the command and its threads
- `server`: the requests of a client; `texts`: the texts they are about, and positions in them
- `diagnosis`: the diagnostics of the texts as they are, and the edits that are offered
- `lookup`: what a name or a formula stands for
- `completion`: proposals; `fields`: the fields that JSON and TOML can have at a place
- `renaming`: edits that give a thing another name
"""
