"""The door between a simulation and a child script in another process: calls of the API, and nothing else.

The script's process has the script alone, and stands in for the API (script_process, stand_ins); the simulation's has
all the rest, and checks what comes through as a message from outside (simulation_end, script_there).
"""
