"""From actions to joint motion that is smooth and within every limit."""
