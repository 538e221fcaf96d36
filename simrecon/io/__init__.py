"""Files: how they are written, read back and trusted."""
