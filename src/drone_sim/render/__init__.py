"""OpenGL renderer: camera images from meshes and poses. It imports neither PyBullet nor ROS."""
