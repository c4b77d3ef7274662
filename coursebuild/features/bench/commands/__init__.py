"""The commands that measure models, `bench` and `diet`, and what `stability` shares with them."""
