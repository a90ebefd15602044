"""The closed-loop example: its parts obey their laws, and the loop arrives."""
