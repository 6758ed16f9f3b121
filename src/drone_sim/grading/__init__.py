"""Flights that grade themselves: a plan says what happens and what counts, a script flies it, a result says how well."""
