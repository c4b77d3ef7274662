"""What every course needs, from the text up; features enter through `features`."""
