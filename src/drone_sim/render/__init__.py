"""Camera pictures from meshes and poses: knows numpy and OpenGL, neither PyBullet nor ROS."""
