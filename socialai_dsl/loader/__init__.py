"""From a scenario's name to plain data with positions: reading YAML, `extends` and variants."""
