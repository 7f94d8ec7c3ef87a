"""Assembly: a scene whose names and files are all looked up, as both renderers take it."""
