"""V-REP's and CoppeliaSim's own files (.ttt scenes, .ttm models): bytes in, what stands in them out."""
