"""The two engines of trials: the browser's, in V8, and native MuJoCo.

- `browser` (with `pieces.js`): `LabEngine`
- `native` (with its child `native_worker`): `NativeEngine`
- `speed`: how fast the browser's engine runs a model
- `files`: the files of both on which results depend
"""
