"""What every course needs; features enter through `features`."""
