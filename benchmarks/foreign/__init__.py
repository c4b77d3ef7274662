"""Texts that strangers wrote: how they are got, and how they are made courses."""
