"""What is true of a 360° light field display and its pictures."""
