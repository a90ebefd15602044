"""Damaged files of every kind that simgl reads: each is loaded and drawn, or refused by a line."""
