"""The physics of a soft capacitive sensor on padding under a rigid sphere: designs in, loading curves out."""
