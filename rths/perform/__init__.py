"""Commands during a test: run it, watch it, stop it, reset it; the processes behind them."""
