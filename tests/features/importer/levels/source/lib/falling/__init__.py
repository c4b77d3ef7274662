"""What falls."""
