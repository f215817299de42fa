"""Components: the directions in which what is enrolled differs most."""

import numpy as np

from app.pipeline.types import F32

MAX_FITTED = 2000
"""Views that the principal components are computed from; more are thinned evenly."""


def principal(centred: F32, components: int) -> F32:
    """(n, d) centred rows to the (d, k) leading eigenvectors of their covariance.

    The smaller of the two Gram matrices is decomposed; directions without variance are left out.
    """
    sample = centred[:: -(-len(centred) // MAX_FITTED)].astype(np.float64)
    count, dimensions = sample.shape
    gram = sample @ sample.T if count < dimensions else sample.T @ sample
    values, vectors = np.linalg.eigh(gram)
    values, vectors = values[::-1][:components], vectors[:, ::-1][:, :components]
    keep = values > max(1e-6 * float(values[0]), 1e-9)
    values, vectors = values[keep], vectors[:, keep]
    if count < dimensions:
        vectors = (sample.T @ vectors) / np.sqrt(values)
    basis: F32 = np.ascontiguousarray(vectors, np.float32)
    return basis
