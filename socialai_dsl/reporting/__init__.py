"""Reports: from the folder of an experiment to figures, tables and pages."""
