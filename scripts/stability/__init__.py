"""The figures of the stability study, one module per map."""
