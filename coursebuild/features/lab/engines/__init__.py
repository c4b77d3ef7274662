"""The engines of trials: the browser's MuJoCo in V8, and the native one in a child process."""
