"""Import of V-REP files: writes scene file, meshes, URDFs, scripts and a list of differences into a folder."""
