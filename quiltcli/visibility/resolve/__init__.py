"""From a drawn canvas to what each pixel sees."""
