"""What the machine offers: cores, threads of linear algebra, memory, a terminal."""
