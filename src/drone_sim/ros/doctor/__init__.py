"""`rosrun drone_sim doctor`: is all there that drone_sim needs?

A module here imports what may be missing only where it finds that out.
"""
