"""The light that leaves visible points towards the eye."""
