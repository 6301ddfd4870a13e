"""Puts the lab data of `datasets/padded_sensor` into the installed package as `calib/example`; for the rest: pyproject.toml."""

from setuptools import find_namespace_packages, setup

setup(
    packages=[*find_namespace_packages(include=["calib*", "models*"]), "calib.example"],
    package_dir={"calib.example": "datasets/padded_sensor"},
)
