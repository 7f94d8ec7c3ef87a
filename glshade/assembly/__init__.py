"""Assembly: a Scene with everything looked up, ready for either renderer."""
