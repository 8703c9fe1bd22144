#!/bin/sh
# The runner of `make test` (cargo's `target.….runner`). PETSc is one per process, and the tests of a process take turns: so
# the laws run in as many processes at once as there are cores.
case $(basename "$1")-$# in
laws-*-1) "$1" --list --format terse | sed -n 's/: test$//p' | xargs -P "$(nproc)" -n 4 "$1" --exact ;;
*) exec "$@" ;;
esac
