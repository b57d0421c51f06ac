"""What planned strokes can tell of a damper, before anything moves."""
