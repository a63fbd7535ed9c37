"""The checks of `rths doctor`: each measures one property of this machine; `verdict` judges them."""
