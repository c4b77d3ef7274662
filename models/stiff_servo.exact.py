"""A harmonic oscillator: what stiff_servo.xml does under the command 0, exactly."""

import numpy as np

OMEGA = np.sqrt(40 / 0.1)  # kp over the moment of inertia about the axle


def motion(time, qpos, qvel):
    """Angle and angular velocity at a time in s."""
    c, s = np.cos(OMEGA * time), np.sin(OMEGA * time)
    return qpos * c + qvel / OMEGA * s, qvel * c - qpos * OMEGA * s
