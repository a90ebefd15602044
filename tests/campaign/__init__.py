"""Campaigns: drawing, labels, workers."""
