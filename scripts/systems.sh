#!/usr/bin/env bash
# systems.sh [SYSTEM…]: builds, runs and tests signorini on other systems, each in a clean chroot. As root.
#
# Systems are names of releases: bookworm, trixie, sid, noble, resolute. Set in the environment:
#   DEBIAN=…, UBUNTU=…  the archives. Debian's is found in the apt sources. Without Ubuntu's, its releases are skipped.
#   STEPS=…             what to do after the build, of: scenes test validate container (all, if it is not set)
#   CHROOTS=…           the folder of the bare systems (debootstrap), of the logs, and of the rows of the table
# The toolchain and the crates are this machine's: run `make mesh && make run` first. The figures of the scenes are
# compared with this machine's. The table goes into INSTALL.md; a system that does not run now keeps its row.
set -euo pipefail
cd "$(dirname "$0")/.."

# In a mount namespace of its own, no mount outlives the script.
[ -n "${SYSTEMS_NAMESPACE-}" ] || SYSTEMS_NAMESPACE=1 exec unshare --mount "$0" "$@"

DEBIAN=${DEBIAN-$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    sed -n -E 's/^(URIs:|deb( \[.*\])?) *([^ ]*\/debian)\/?( .*)?$/\3/p' | head -n 1 || true)}
STEPS=${STEPS-scenes test validate container}
CHROOTS=${CHROOTS-/var/tmp/signorini-systems}
CARGO=${CARGO_HOME-$HOME/.cargo} RUSTUP=${RUSTUP_HOME-$HOME/.rustup}
mkdir -p "$CHROOTS"

# bare SYSTEM: its smallest installation, made once.
bare() {
    [ ! -e "$CHROOTS/$1/etc/apt/apt.conf.d/99copy" ] || return 0
    local archive=$DEBIAN options=() script=/usr/share/debootstrap/scripts/$1
    case $1 in
    noble | resolute)
        archive=${UBUNTU-}
        options=(--components=main,universe --keyring=/usr/share/keyrings/ubuntu-archive-keyring.gpg)
        # All releases of Ubuntu have this script; an older debootstrap does not know the newer names.
        script=/usr/share/debootstrap/scripts/gutsy
        ;;
    esac
    [ -n "$archive" ] || { echo "$1: skipped; set UBUNTU or DEBIAN to its archive" && return 1; }
    debootstrap --variant=minbase "${options[@]}" "$1" "$CHROOTS/$1" "$archive" "$script" >"$CHROOTS/$1.log"
    # An archive that is a copy may lag behind.
    echo 'Acquire::Check-Valid-Until "false";' >"$CHROOTS/$1/etc/apt/apt.conf.d/99copy"
}

# fresh SYSTEM: mounts a writable layer above the bare system, with devices and this machine's toolchain (read-only).
fresh() {
    root=$CHROOTS/$1.root
    ! mountpoint -q "$root" || umount -Rl "$root"
    rm -rf --one-file-system "$root" "$root".{changed,work} && mkdir "$root" "$root".{changed,work}
    mount -t overlay overlay -o "lowerdir=$CHROOTS/${1%-*},upperdir=$root.changed,workdir=$root.work" "$root"
    mount -t proc proc "$root/proc" && mount --rbind /dev "$root/dev" && mount --rbind /sys "$root/sys"
    mkdir -p "$root"/root/{.rustup,.cargo/registry}
    mount --bind "$RUSTUP" "$root/root/.rustup" && mount -o remount,ro,bind "$root/root/.rustup"
    # A copy, as `cargo install` adds to it.
    cp -a "$CARGO/bin" "$root/root/.cargo"
    mount --bind "$CARGO/registry" "$root/root/.cargo/registry"
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    # Networks may have certificates of their own.
    cp "${SSL_CERT_FILE-/etc/ssl/certs/ca-certificates.crt}" "$root/root/certificates.crt"
}

# inside FOLDER COMMAND, as on a machine that has just been installed.
inside() {
    chroot "$root" env -i HOME=/root TERM=dumb LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        CARGO_HTTP_CAINFO=/root/certificates.crt OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
        PATH=/root/.cargo/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh -ec "cd $1; $2"
}

# step NAME FOLDER COMMAND: runs it with a log, and sets `cell` to its seconds or to the last line of the log.
step() {
    local start=$SECONDS log=$CHROOTS/$system.$1.log
    if inside "$2" "$3" >"$log" 2>&1; then cell="$((SECONDS - start)) s"; else cell="failed: $(tail -n 1 "$log")"; fi
    echo "$system: $1: $cell ($log)"
}

wants() { [[ " $STEPS " == *" $1 "* ]]; }

# The Containerfile: a fresh system per FROM, its RUN lines, and its COPY lines from the checkout or an earlier stage.
container() {
    local word rest stage=0 before= start=$SECONDS
    while read -r word rest; do
        case $word in
        FROM) before=${root-} stage=$((stage + 1)) && fresh "$system-$stage" ;;
        RUN) step "container$stage" / "$rest" ;;
        COPY)
            set -- $rest
            [ "$1" = . ] && git clone -q . "$root$2" ||
                { mkdir -p "$root$3" && cp -rT "$before$2" "$root$3"; } ;;
        esac
        [[ $cell != failed* ]] || return 0
    done <Containerfile
    cell="$((SECONDS - start)) s"
}

run_system() {
    local root cell=- packages build scenes=- own=- same=- test=- validate=- container=- versions
    bare "$system" || return 0
    fresh "$system"
    step git / 'apt-get -q update; apt-get install -qy --no-install-recommends ca-certificates git make'
    git clone -q . "$root/src"
    step packages /src 'make deps' && packages=$cell
    step build /src 'make build' && build=$cell
    versions=$(inside / '. /etc/os-release; printf "%s | " "$PRETTY_NAME"
        dpkg-query -W -f "\${Version} " petsc-dev libopenmpi-dev gmsh |
            sed -E "s/^[0-9]+://; s/ ([0-9]+:)?/, /g; s/[+~-][^,]*//g; s/, $//"')
    if wants scenes; then
        step scenes /src 'make mesh && make run' && scenes=$cell
        own=$("${PYTHON-/usr/bin/python3}" validation/systems.py out "$root/src/out")
        # Once more on the meshes of this machine, as gmsh is of another version.
        cp -r "$CHROOTS/meshes" "$root/root/meshes"
        step same /src 'for mesh in /root/meshes/*; do name=$(basename $mesh .msh)
            target/release/signorini run geo/$name.toml --mesh $mesh --out same/$name; done'
        same=$("${PYTHON-/usr/bin/python3}" validation/systems.py out "$root/src/same")
    fi
    if wants test; then step test /src 'make test' && test=$cell; fi
    if wants validate; then
        validate='no dolfinx'
        if inside / 'apt-cache show python3-dolfinx-real' >/dev/null 2>&1; then
            step validate /src 'make validate' && validate=$cell
        fi
    fi
    # Its base is Debian 13.
    if wants container && [ "$system" = trixie ] && [ -e Containerfile ]; then container && container=$cell; fi
    printf '%s | ' "| $versions" "$packages" "$build" "$scenes" "$same" "$own" "$test" "$validate" "$container" \
        >"$CHROOTS/$system.row"
    date '+%F |' >>"$CHROOTS/$system.row"
    umount -Rl "$CHROOTS/$system"*.root
    rm -rf --one-file-system "$CHROOTS/$system"*.root{,.changed,.work}
}

# This machine's meshes, one a scene.
meshes() {
    local scene folder=$CHROOTS/meshes
    rm -rf "$folder" "$folder.new" && mkdir "$folder" "$folder.new" && cp geo/*.{geo,toml} "$folder.new"
    for scene in "$folder.new"/*.toml; do
        target/release/signorini mesh "$scene" >/dev/null
        mv "$folder.new"/*.msh "$folder/$(basename "$scene" .toml).msh"
    done
}

! wants scenes || meshes
all=(bookworm trixie sid noble resolute)
[ $# -gt 0 ] || set -- "${all[@]}"
for system; do run_system; done
{
    sed '/^<!-- systems/q' INSTALL.md
    echo '| system | gmsh, Open MPI, PETSc | packages | build | nine scenes | difference on the same meshes | on its own' \
        'meshes | `make test` | `make validate` | Containerfile | date |'
    echo '|---|---|---|---|---|---|---|---|---|---|---|'
    for system in "${all[@]}"; do cat "$CHROOTS/$system.row" 2>/dev/null || true; done
    sed -n '/^<!-- end of systems/,$p' INSTALL.md
} >INSTALL.md.new && mv INSTALL.md.new INSTALL.md
