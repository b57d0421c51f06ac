"""What a recording holds that the law does not say; first its noise floor, below which there is nothing to find."""
