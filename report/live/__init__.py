"""The live view: a recording that is being written, or one that is finished, as plots in a browser on this machine."""
