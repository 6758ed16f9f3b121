"""RPC between a simulation and a child script in a separate process; only calls of the script API are transferred.

The simulation's process sends a command, such as a phase, and waits for its end; meanwhile it executes the calls that
the script makes. `script_proxy` does that, and validates everything that it receives from `connection`. In the script's
process, `script_process` executes the commands, and the script calls `api_stubs`. The `mirror` saves messages there: it
answers reads from the snapshot in each message to the script. `effects` says how long they are valid. `values` encodes
arguments and results.

Messages to the script, written by marshal:

    ("go", script, command, arguments, snapshot)  ("is", result, snapshot)  ("no", error, text, explanation, snapshot)

Messages to the simulation, in JSON: a list of items, in order, of which only the last one is waited for:

    ["set", function, *arguments]  a call that returns nothing
    ["reads", [[function, *arguments], ...]]  the reads of this phase, for the snapshots of its next run
    ["call", function, [[name, value], ...], *arguments]  a call, with named arguments; the answer is "is" or "no"
    ["end", has_thread, result]  ["failed", has_thread, phase, path, line, reason]  the end of the command
"""
