"""Error descriptions of all REST paths."""

from bench.service.application import PUBLIC_OPERATIONS, create_app


def test_every_path_describes_its_errors_and_needs_the_token():
    for path, methods in create_app().openapi()["paths"].items():
        for verb, method in methods.items():
            if f"{verb.upper()} {path}" not in PUBLIC_OPERATIONS:
                assert method["security"] == [{"HTTPBearer": []}], path
                assert "application/problem+json" in method["responses"]["422"]["content"], path
