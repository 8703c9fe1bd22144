"""The figures of the atlas of failure, one module per map."""
