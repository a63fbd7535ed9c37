"""What readings show of their sensors by themselves: noise, steps, and samples that are missed."""
