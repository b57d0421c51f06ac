"""What a recording holds that the law does not say: first its noise floor, below which nothing can be found."""
