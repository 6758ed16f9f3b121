"""Child scripts in Lua, by means of lupa."""
