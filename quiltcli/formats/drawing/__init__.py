"""Pictures made of shapes and letters."""
