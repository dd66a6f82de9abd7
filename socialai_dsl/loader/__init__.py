"""The loader: from a scenario's name to plain data with positions, through YAML, `extends` and variants."""
