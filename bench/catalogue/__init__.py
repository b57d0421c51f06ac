"""The catalogue: which runs there are, where their logs lie, and the jobs on them."""
