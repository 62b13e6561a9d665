"""What a recorded path is: samples, noise, what the filter does, and what a bad tracker costs."""
