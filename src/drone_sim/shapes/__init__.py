"""What a thing looks like: shapes from YAML to Bullet, mesh and rviz."""
