"""The slave: it drives a laboratory of any kind by the commands of the master."""
