"""Scene: the document that says what a picture shows, and its files."""
