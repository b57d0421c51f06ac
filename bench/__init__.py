"""Runs tests, keeps their records, serves people."""
