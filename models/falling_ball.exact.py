"""Free fall: what falling_ball.xml does, exactly."""

G = 9.81


def motion(time, qpos, qvel):
    """Height and velocity at a time in s."""
    return qpos + qvel * time - G * time**2 / 2, qvel - G * time
