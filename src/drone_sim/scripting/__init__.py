"""Child scripts: the API that they are written against, and what loads and calls them."""
