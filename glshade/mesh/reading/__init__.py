"""Reading: the parts that the readers of mesh formats share."""
