"""Published or independently computed numbers, each with its source."""
