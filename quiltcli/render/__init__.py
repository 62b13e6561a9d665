"""From a job to its files."""
