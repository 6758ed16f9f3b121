"""What every node of the package uses: its start and end, messages, parameters, stamps, the simulator's services."""
