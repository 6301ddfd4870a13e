"""Bayesian calibration of a soft capacitive pressure sensor: lab files in, posterior, report and recommendation out."""
