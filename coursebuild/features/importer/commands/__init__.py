"""The command `import`, and what it does when it proves."""
