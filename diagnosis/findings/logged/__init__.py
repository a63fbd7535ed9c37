"""What the data logger of an import did to readings, and a building whose forces it recorded."""
