"""The runs behind the reproduction."""
