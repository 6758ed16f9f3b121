"""The controls and keys that the tutorial names for readers who use the browser.

The value of a control is the accessible name of its button, tab or menu entry in the page: a regular expression that
ignores case.
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
