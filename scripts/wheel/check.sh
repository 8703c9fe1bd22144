#!/usr/bin/env bash
# check.sh WHEEL: installs the wheel into a fresh virtual environment, runs a scene there, with pictures, and reads its results.
set -euo pipefail
wheel=$(realpath "$1") scenes=$(realpath "$(dirname "$0")/../../geo") folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
start=$(date +%s.%N)
"${PYTHON:-/usr/bin/python3}" -m venv environment
# Nothing of this machine but Python: no gmsh, PETSc or clone.
inside() { env -i HOME="$folder" LANG=C.UTF-8 "${PIP_ENVIRONMENT[@]}" PATH=/usr/bin:/bin "$@"; }
mapfile -t PIP_ENVIRONMENT < <(env | grep -E '^(PIP_|https?_proxy|HTTPS?_PROXY|SSL_CERT_FILE|REQUESTS_CA_BUNDLE)' || true)
inside environment/bin/pip install -q "$wheel"
cp "$scenes"/lshape.{geo,toml} .
inside environment/bin/signorini run lshape.toml
inside environment/bin/signorini plot out/lshape
printf 'from pip install to the pictures: %.0f s\n' "$(bc <<<"$(date +%s.%N) - $start")"
inside environment/bin/python3 -c "
from signorini_results import load, run
result = load('out/lshape')
assert abs(result.history['work'].iloc[-1] - 5.357032) < 1e-2, result.history['work'].iloc[-1]
run('lshape.toml', out='coarse', mesh={'size': 1.0})"
inside environment/bin/signorini run --ranks 2 lshape.toml && exit 1
! inside ldd environment/bin/signorini | grep -E 'petsc|mpi|blas|not found'
