"""The controls and keys that the tutorial names to who reads it in the browser: the one list of them.

Each has the accessible name by which the page has it as a button, a tab or in a menu: a regular expression, in any
case.
"""

CONTROLS = {
    "▶ start": "start",
    "⏸ pause": "pause",
    "⏭ step": "step",
    "⟲ restart": "restart",
    "View": "view",
    "Cameras": "cameras",
    "Plots": "plots",
    "Tune": "tune",
    "Log": "log",
    "Run": "run",
    "Revert": "revert",
    "Save as": "save as",
    "Next": "next",
}
KEYS = {"W", "S", "A", "D", "Q", "E", "R", "F", "Shift"}
