"""A small calibration and a number in, what came of breaking it out; knows of calib what its user sees, commands and files."""
