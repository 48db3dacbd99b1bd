"""Folders and files that are replaced whole, and held by one run at a time."""
