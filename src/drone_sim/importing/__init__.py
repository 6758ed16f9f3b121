"""V-REP's files made into ours: a scene file, meshes, URDFs and scripts in a folder, and a list of what stayed behind."""
