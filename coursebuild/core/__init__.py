"""What every course needs; it knows no single feature."""
