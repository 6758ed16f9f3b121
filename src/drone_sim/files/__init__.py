"""Reading of files from outside, with limits and checks, and writing of the package's own files."""
