"""What flies: a vehicle, its objects under V-REP's names, its script."""
