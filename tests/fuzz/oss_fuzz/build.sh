#!/bin/bash -eu
# Run by OSS-Fuzz in its image: a harness, first inputs and words for each target, in $OUT.
cd "$SRC/coursebuild"
pip3 install --editable '.[lsp]' hypothesis
export PYTHONPATH="$SRC/coursebuild:$SRC/coursebuild/tests"
python3 -m fuzz --write-seeds "$OUT"
for words in "$OUT"/fuzz_*.dict; do
  name=$(basename "$words" .dict)
  cp tests/fuzz/oss_fuzz/fuzz_target.py "$SRC/$name.py"
  compile_python_fuzzer "$SRC/$name.py" --paths "$SRC/coursebuild" --paths "$SRC/coursebuild/tests" \
    --collect-all coursebuild --collect-submodules support --copy-metadata coursebuild \
    --collect-all py_mini_racer --collect-all mujoco --collect-all pygments --collect-data lsprotocol \
    --add-data "$SRC/coursebuild/templates:templates" --add-data "$SRC/coursebuild/site:site"
done
