"""V-REP's files made into ours: scene file, meshes, URDFs and scripts in a folder, and a list of what is missing."""
