"""Parsers, which are pure: Markdown, fences, JSON, TOML and the course map become values."""
