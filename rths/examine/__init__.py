"""Commands after a test: what a recording holds, its pictures and page, its diagnosis, other formats."""
