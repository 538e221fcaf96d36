"""Programs that look after the repository and its runs."""
