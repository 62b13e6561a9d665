"""What is true of files, images and displays."""
