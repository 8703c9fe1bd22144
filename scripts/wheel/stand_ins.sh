#!/usr/bin/env bash
# stand_ins.sh LIBGMSH FOLDER: stand-ins for the libraries of X11 and OpenGL that the library of gmsh needs, which servers lack. gmsh
# calls them for windows only; a stand-in ends the program. libgomp is the real one, because gmsh uses it.
set -euo pipefail
gmsh=$(realpath "$1") folder=$(realpath "$2")
cd "$folder"
needed=$(objdump -p "$gmsh" | sed -n -E 's/^ *NEEDED *(lib(X|GL|fontconfig).*)/\1/p')
# All functions are in the first library.
nm -D --undefined-only "$gmsh" | sed -n -E 's/^ *U ((X|Fc|gl)[A-Za-z0-9]*)$/void \1(void) { __builtin_trap(); }/p' >functions.c
sources=functions.c
for name in $needed; do
    gcc -w -O1 -fno-builtin -shared -nostdlib -s -Wl,-z,noseparate-code,-soname,"$name" -o "$name" $sources -x c /dev/null
    sources=
done
rm functions.c
cp "$(gcc -print-file-name=libgomp.so.1)" .
strip --strip-unneeded libgomp.so.1
