"""From the folder of an experiment to a report: reads what runs left, computes, draws, and writes pages and tables."""
