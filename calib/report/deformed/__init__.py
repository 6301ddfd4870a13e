"""A solution of the finite elements in, pictures of the deformed sensor and files for ParaView out."""
