"""From measurements to parameters: calibration with intervals, and what planned measurements could determine."""
