"""V-REP's legacy remote API (`simxStart`): commands over TCP call the functions that child scripts call."""
