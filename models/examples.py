"""A design to begin with: the sensor of the paper as values by name."""

from __future__ import annotations

from types import MappingProxyType

#: The sensor that Zhu, Tairych, Rosset, Anderson (SPIE EAPAD 2019) built and measured, under their ball, as `design_from` of
#: `models.sensor` takes it [SI]: 1.84 mm of one silicone, of which 1.10 mm are padding. Modulus and permittivity are nominal,
#: electrodes and dielectrics are left to the defaults. Another design is `PAPER_SENSOR | {"padding_thickness": 5e-3}`.
PAPER_SENSOR: MappingProxyType[str, float] = MappingProxyType(
    {
        "indenter_radius": 5e-3,
        "sensor_thickness": 0.74e-3,
        "sensor_radius": 10e-3,
        "young_modulus": 0.69e6,
        "relative_permittivity": 2.8,
        "padding_thickness": 1.1e-3,
    }
)
