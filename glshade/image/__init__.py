"""Images: pictures as arrays and as files, layers, views, and how two pictures differ."""
