"""The operator's panel in a browser: who may order what, what a page shows, how old that is, and how it is served."""
