"""Keys, sticks and gamepads of the browsers, as commands."""
