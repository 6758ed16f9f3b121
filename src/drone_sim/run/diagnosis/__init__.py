"""Why does it not fly as expected? What is known of vehicles, pace, scripts and cameras, in one look."""
