"""A recorded test as the diagnosis sees it: signals on the ticks, parts with inputs and outputs, exchange, loop."""
