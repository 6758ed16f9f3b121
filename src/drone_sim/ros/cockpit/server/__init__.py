"""The web server: access control, addresses, files, and the socket of the page."""
