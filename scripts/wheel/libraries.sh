#!/usr/bin/env bash
# libraries.sh FOLDER: the static libraries of the wheel, in FOLDER/lib, with FOLDER/lib/pkgconfig for build.rs. PETSc is built
# without MPI from its sources on PyPI, in FOLDER/petsc. CHOLMOD, OpenBLAS and the run-time libraries of GCC are those of Debian.
# PYTHON has pip. FOLDER/licenses gets the licences and the versions.
set -euo pipefail
folder=$(realpath "$1")
PETSC=3.26.1
OPENBLAS=libopenblas-serial-dev
mkdir -p "$folder"/{lib/pkgconfig,licenses,downloads}
cd "$folder/downloads"

# Unpacked, not installed: installed, it would become the BLAS of all programs of this machine.
apt-get -q download "$OPENBLAS"
dpkg -x "$OPENBLAS"_*.deb openblas
cp openblas/usr/lib/*/openblas-serial/libopenblas.a "$folder/lib"
quadmath=
# GCC has it for x86 alone.
[ "$(uname -m)" != x86_64 ] || quadmath=quadmath
for name in cholmod amd camd colamd ccolamd suitesparseconfig gfortran gomp $quadmath; do
    cp "$(gcc -print-file-name="lib$name.a")" "$folder/lib"
done
# CHOLMOD can order by METIS. The program orders by CAMD, so METIS is left out.
cat >stand_ins.c <<'END'
int METIS_NodeND(void) { return -4; /* METIS_ERROR */ }
int METIS_ComputeVertexSeparator(void) { return -4; }
END
gcc -O2 -fPIC -c stand_ins.c
rm -f "$folder/lib/libstand_ins.a"
ar rcs "$folder/lib/libstand_ins.a" stand_ins.o
# package NAME LIBRARIES, for pkg-config.
package() {
    printf 'Name: %s\nDescription: static, for the wheel\nVersion: 0\nLibs: -L%s %s\n' "$1" "$folder/lib" "$2" \
        >"$folder/lib/pkgconfig/$1.pc"
}
package CHOLMOD '-lcholmod -lamd -lcolamd -lccolamd -lcamd -lsuitesparseconfig -lstand_ins'
blas="-lopenblas -lgfortran ${quadmath:+-lquadmath} -lm"
package lapack "$blas"
package blas ''

documents=/usr/share/doc
cp openblas"$documents/$OPENBLAS/copyright" "$folder/licenses/OpenBLAS"
cp "$documents/libsuitesparse-dev/copyright" "$folder/licenses/SuiteSparse"
cp "$documents/libgomp1/copyright" "$folder/licenses/GCC-runtime"
cp /usr/share/common-licenses/{GPL-2,GPL-3,LGPL-2.1,Apache-2.0} "$folder/licenses"
{
    echo "The program contains these libraries. Their sources:"
    echo "PETSc $PETSC: https://pypi.org/project/petsc/$PETSC/"
    echo "Packages of https://snapshot.debian.org:"
    dpkg-query -W -f '${source:Package} ${source:Version}\n' libsuitesparse-dev libgomp1
    dpkg-deb -f "$OPENBLAS"_*.deb Source Package Version | paste -sd ' '
} >"$folder/licenses/SOURCES"

[ ! -e "$folder/petsc/static/lib/libpetsc.a" ] || exit 0
"${PYTHON:-python3}" -m pip -q download --no-deps --no-binary petsc "petsc==$PETSC"
rm -rf "$folder/petsc" && mkdir "$folder/petsc"
tar xf "petsc-$PETSC.tar.gz" --strip-components=1 -C "$folder/petsc"
cp "$folder/petsc/LICENSE" "$folder/licenses/PETSc"
cd "$folder/petsc"
./configure PETSC_ARCH=static --with-mpi=0 --with-fc=0 --with-cxx=0 --with-shared-libraries=0 --with-debugging=0 \
    --with-x=0 --with-ssl=0 --with-valgrind=0 --with-hwloc=0 "CFLAGS=-fPIC -ffile-prefix-map=$PWD=petsc" COPTFLAGS=-O2 \
    "--with-blaslapack-lib=-L$folder/lib $blas"
# The library records where it was built. Two builds shall be equal.
sed -i "s|$folder|wheel|g; /^.Machine characteristics/d" static/include/petsc{conf,configinfo,machineinfo}.h
make PETSC_DIR="$PWD" PETSC_ARCH=static -j"$(nproc)" libs
rm -rf static/obj
