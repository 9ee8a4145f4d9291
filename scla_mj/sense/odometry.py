"""Dead reckoning: wheel encoders for the distance, a gyro for the turn, integrated every control period."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

ENCODER_COUNTS: Final = 4096
"""Counts per turn of the wheel's encoder (AS5601, in the robot's XL330-M077-T motors; ROBOTIS e-Manual)."""
GYRO_NOISE_DEG_SQRT_S: Final = 0.01
"""Angle random walk: 0.01 deg/s per root hertz (rate noise density of the MPU-9250, gyro of the TurtleBot3's board)."""
GYRO_BIAS_DEG_S: Final = 0.1
"""Standard deviation of what is left of the gyro's bias once a mean at rest is taken off: the MPU-9250 drifts by
30 deg/s over 125 kelvin, so half a kelvin of warming later it is off by this much."""


class Odometer(NamedTuple):
    """Encoders, gyro and the pose that they add up to, as the compiled loop takes them.

    `estimate` is x and y in metres, the heading in radians, and the latest speed in m/s and turn rate in rad/s, shape
    (5,); `counts` are the encoders' latest readings, shape (2,); `gyro_bias_rad_s` is one value.
    """

    rng: np.random.Generator
    metres_per_count: float
    counts_per_rad: float
    period_s: float
    gyro_noise_rad: float
    gyro_bias_rad_s: NDArray[np.float64]
    estimate: NDArray[np.float64]
    counts: NDArray[np.float64]


def make_odometer(*, rolling_radius_m: float, period_s: float, rng: np.random.Generator) -> Odometer:
    """Return an odometer at the origin for wheels of this rolling radius; the gyro's bias is drawn now, at power-on."""
    counts_per_rad = ENCODER_COUNTS / math.tau
    return Odometer(
        rng=rng,
        metres_per_count=rolling_radius_m / counts_per_rad,
        counts_per_rad=counts_per_rad,
        period_s=period_s,
        gyro_noise_rad=math.radians(GYRO_NOISE_DEG_SQRT_S) * math.sqrt(period_s),
        gyro_bias_rad_s=np.array([draw_gyro_bias_rad_s(rng)]),
        estimate=np.zeros(5),
        counts=np.zeros(2),
    )


def draw_gyro_bias_rad_s(rng: np.random.Generator) -> float:
    """Draw the bias that a gyro has from its power-on."""
    return float(rng.normal(0.0, math.radians(GYRO_BIAS_DEG_S)))


def place(odometer: Odometer, x_m: float, y_m: float, heading_rad: float, wheels_rad: NDArray[np.float64]) -> None:
    """Set the odometer to where the robot stands, at rest, with its wheels at these angles."""
    odometer.estimate[:] = x_m, y_m, heading_rad, 0.0, 0.0
    odometer.counts[:] = np.floor(wheels_rad * odometer.counts_per_rad)


@njit(inline="always")
def advance(odometer: Odometer, left_rad: float, right_rad: float, turned_rad: float) -> None:
    """Add one control period to the estimate.

    Args:
        odometer: its estimate and its latest counts are changed.
        left_rad: the left wheel's true angle now; the encoder counts whole steps of it.
        right_rad: the right wheel's.
        turned_rad: by how much the body truly turned in this period; the gyro adds its bias and its noise.
    """
    left = math.floor(left_rad * odometer.counts_per_rad)
    right = math.floor(right_rad * odometer.counts_per_rad)
    rolled_m = (left - odometer.counts[0] + right - odometer.counts[1]) / 2.0 * odometer.metres_per_count
    odometer.counts[0], odometer.counts[1] = left, right
    turned = turned_rad + odometer.gyro_bias_rad_s[0] * odometer.period_s
    turned += odometer.gyro_noise_rad * odometer.rng.standard_normal()
    estimate = odometer.estimate
    # The chord of a short arc points half-way between the headings at its ends.
    course = estimate[2] + turned / 2.0
    estimate[0] += rolled_m * math.cos(course)
    estimate[1] += rolled_m * math.sin(course)
    estimate[2] += turned
    estimate[3] = rolled_m / odometer.period_s
    estimate[4] = turned / odometer.period_s
