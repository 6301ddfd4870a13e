"""The physics of a soft capacitive sensor on padding under a sphere: designs in, loading curves out; knows no measurement."""
