"""What is there: frozen descriptions of spacecraft, cameras, Sun and Earth; no graphics."""
