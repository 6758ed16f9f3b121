"""Child scripts in Lua, through lupa."""
