"""Other packages' names for what taut does, so that programs written for them run with one import changed."""
