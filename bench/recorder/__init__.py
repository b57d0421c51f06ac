"""Records: writes, reads and mends logs, and takes in recordings made elsewhere."""
