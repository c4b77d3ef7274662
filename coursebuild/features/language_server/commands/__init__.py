"""The language server, which keeps the course in memory as the preview does."""
