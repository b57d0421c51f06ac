"""Reports: one page and its plots from a log and a fit, both read as files."""
