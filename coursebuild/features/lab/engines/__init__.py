"""The two engines that labs are tried in: the browser's, in V8, and native MuJoCo.

- `browser` (with `pieces.js`): `LabEngine`
- `native` (with its child `native_worker`): `NativeEngine`
- `speed`: how fast a model runs in the first
- `files`: what both consist of, as far as results depend on it
"""
