"""The product's own blind trial: sealed scenarios, recorded, diagnosed, unsealed, scored."""
