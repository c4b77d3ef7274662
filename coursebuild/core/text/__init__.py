"""Texts, places in them, and what is wrong there: sources and spans, rules and diagnostics."""
