"""Lesson scripts, pure: what is extracted, whether outputs are as recorded, what to write anew."""
