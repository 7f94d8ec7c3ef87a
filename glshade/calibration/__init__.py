"""Calibration: how a picture was seen: its pixels' size, the camera's pose and the poses of the objects; and files of them."""

from glshade.found import lazily

__getattr__ = lazily(__name__, {"Calibration": "calibration", "CalibratedPicture": "calibration"})
