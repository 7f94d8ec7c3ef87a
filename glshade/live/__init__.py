"""glshade dev: pages in a browser that show a scene, and that follow every change of its files."""
