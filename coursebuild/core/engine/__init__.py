"""What is made once and used again: results kept by key, work spread over processes, publishing."""
