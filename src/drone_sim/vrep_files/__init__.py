"""Reader for binary scenes (.ttt) and models (.ttm) of V-REP and CoppeliaSim."""
