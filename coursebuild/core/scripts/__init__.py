"""Lesson scripts, pure: what is extracted, whether outputs are as recorded, what to write anew.

Entry points: `extract.extract`, `extract.jobs`, `compare.verify`, `findings.script_findings`,
`edit.update_body`, `edit.apply_edits`.
"""
