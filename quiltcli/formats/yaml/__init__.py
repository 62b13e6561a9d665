"""YAML read strictly, every value with the place it stands at."""
