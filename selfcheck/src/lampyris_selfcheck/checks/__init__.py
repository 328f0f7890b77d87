"""The checks: one module each, beside the modules that draw its cases."""
