"""The script API: what a child script reaches as `sim` and `simROS`."""
