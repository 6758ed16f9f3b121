"""The server: who comes in, where, and what is said over the socket."""
