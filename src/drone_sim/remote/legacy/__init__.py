"""V-REP's legacy remote API (`simxStart`): commands over TCP that call the functions that child scripts call."""
