"""Light that arrives straight from its source: one module per kind of light."""
