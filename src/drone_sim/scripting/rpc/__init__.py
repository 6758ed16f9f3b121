"""RPC between a simulation and a child script in a separate process; only calls of the script API are transferred.

The script's process contains the script and stubs of the API (script_process, api_stubs). The simulation's process
contains everything else and validates each message from the script (connection, script_proxy).
"""
