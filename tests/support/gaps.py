"""Gap of a diagnosis that shrinks from 12 N to 3 N."""

from identification.documents.diagnosis import Gap

GAP = Gap(
    before_n=12.0,
    after_n=3.0,
    noise_floor_n=2.5,
    shrinkage=0.98,
    shrinkage_ci95=(0.97, 0.99),
    train_before_n=11.0,
    train_after_n=3.0,
)
