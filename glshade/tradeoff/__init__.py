"""Tradeoff: measures the time and the error of a scene's settings, and chooses the fastest settings within an error budget.

A knob is one choice of quality, such as the shading rate. A `setting` is one value for each knob. A `study` measures many
settings, the `front` is the list of the settings that no other one beats, and the `page` shows both. `budget` chooses a setting
for each object.
"""
