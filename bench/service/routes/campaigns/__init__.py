"""Routes of campaigns and of the queue of the bench, with their models."""

from bench.service.routes.campaigns.routes import router

__all__ = ["router"]
