"""Scene: the document that describes a picture, its parts, and the files that it is read from."""
