"""What only rviz asks for."""
