"""The kind `table`: a shaking table that carries an active mass damper."""
