"""Words from numbers: the reported diagnosis, its headline, advice and next experiment."""
