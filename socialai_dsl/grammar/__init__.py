"""The small language inside YAML strings: expressions, places, activities, effects and texts."""
