"""The two engines of trials: the browser's, in V8, and native MuJoCo.

- `browser` (with `pieces.js`): `LabEngine`, and how fast it runs a model
- `native` (with its child `native_worker`): `NativeEngine`, and the files of both on which results
  depend
"""
