"""What a residual may follow from: functions of the inputs, oscillators that they swing, and how well these predict."""
