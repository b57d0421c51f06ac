"""Work on runs: ordered by the service, kept in the catalogue, carried out by workers."""
