"""The built-in child scripts. They are not imported: they are run, as a student's are."""
