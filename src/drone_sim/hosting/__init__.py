"""Child scripts of vehicles and of other objects: loading, order of calls, parameters and tuning."""
