"""The cockpit, a node of its own: scene, controls, cameras, scripts and plots in a browser."""
