"""Sources, spans of their text, the catalogue of rules, and diagnostics."""
