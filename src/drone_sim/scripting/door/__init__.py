"""RPC between a simulation and a child script in a separate process; only calls of the script API are transferred.

The script's process contains the script and stubs of the API (script_process, stand_ins). The simulation's process
contains everything else and validates each message from the script (simulation_end, script_there).
"""
