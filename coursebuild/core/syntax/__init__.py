"""Text of a course into values, pure: Markdown, fences, quizzes, labs, the course map."""
