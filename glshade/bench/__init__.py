"""What things cost on the driver at hand, by the clock on the wall."""
