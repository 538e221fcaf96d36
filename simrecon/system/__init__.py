"""What the machine offers: cores, threads of linear algebra, memory, locks, signals, a terminal."""
