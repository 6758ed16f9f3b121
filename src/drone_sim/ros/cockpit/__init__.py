"""The cockpit: scene, controls, cameras, script and plots in a browser. A node of its own, with the topics of all."""
