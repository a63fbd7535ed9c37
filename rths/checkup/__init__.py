"""The parts of `rths doctor`: each measures one thing of this machine; `verdict` judges them."""
