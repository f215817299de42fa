"""Holes in a thresholded hand."""

import cv2
import numpy as np
import pytest

from app.pipeline.holes import MOST_HOLES, fill_holes


def disc(*holes):
    """A disc of 11,300 pixels with round holes ``(x, y, radius)``."""
    mask = np.zeros((160, 200), np.uint8)
    cv2.circle(mask, (100, 80), 60, 1, cv2.FILLED)
    for x, y, radius in holes:
        cv2.circle(mask, (x, y), radius, 0, cv2.FILLED)
    return mask


def test_small_holes_are_filled():
    mask = disc((80, 70, 3), (120, 90, 4))
    fill_holes(mask, 0.015)
    assert np.array_equal(mask, disc())


def test_the_ring_of_thumb_and_finger_stays():
    mask = disc((100, 60, 15))
    fill_holes(mask, 0.015)
    assert np.array_equal(mask, disc((100, 60, 15)))


def test_a_bay_is_no_hole():
    mask = disc()
    mask[:80, 99:102] = 0
    before = mask.copy()
    fill_holes(mask, 0.015)
    assert np.array_equal(mask, before)


@pytest.mark.parametrize("mask", [np.zeros((20, 30), np.uint8), np.ones((20, 30), np.uint8)])
def test_a_mask_of_one_colour_is_left_alone(mask):
    before = mask.copy()
    fill_holes(mask, 0.015)
    assert np.array_equal(mask, before)


def test_nothing_is_filled_when_it_is_off():
    mask = disc((80, 70, 3))
    fill_holes(mask, 0.0)
    assert np.array_equal(mask, disc((80, 70, 3)))


def test_noise_is_left_alone():
    mask = disc()
    mask[20:140:4, 50:150:4] = 0
    assert np.count_nonzero(mask == 0) > MOST_HOLES
    before = mask.copy()
    fill_holes(mask, 0.015)
    assert np.array_equal(mask, before)
