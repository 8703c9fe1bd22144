#!/usr/bin/env bash
# systems.sh [SYSTEM…]: builds, runs and tests signorini on other systems, each in a clean chroot. As root.
#
# Systems are names of releases: bookworm, trixie, sid, noble, resolute. Set in the environment:
#   DEBIAN=…, UBUNTU=…  the archives. Debian's is found in the apt sources. Without Ubuntu's, its releases are skipped.
#   STEPS=…             of: build scenes test validate container wheel (all, if it is not set)
#   CHROOTS=…           the folder of the bare systems (debootstrap) and of the logs
# The toolchain and the crates are this machine's: run `make mesh && make run` first, and `make wheel` for the wheel. The figures
# of the scenes are compared with this machine's. The table is in INSTALL.md; the cells of what does not run now stay.
set -euo pipefail
cd "$(dirname "$0")/.."

# In a mount namespace of its own, no mount outlives the script.
[ -n "${SYSTEMS_NAMESPACE-}" ] || SYSTEMS_NAMESPACE=1 exec unshare --mount "$0" "$@"

DEBIAN=${DEBIAN-$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    sed -n -E 's/^(URIs:|deb( \[.*\])?) *([^ ]*\/debian)\/?( .*)?$/\3/p' | head -n 1 || true)}
STEPS=${STEPS-build scenes test validate container wheel}
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

# layer SYSTEM: mounts a writable layer above the bare system, with devices.
layer() {
    root=$CHROOTS/$1.root
    ! mountpoint -q "$root" || umount -Rl "$root"
    rm -rf --one-file-system "$root" "$root".{changed,work} && mkdir "$root" "$root".{changed,work}
    mount -t overlay overlay -o "lowerdir=$CHROOTS/${1%-*},upperdir=$root.changed,workdir=$root.work" "$root"
    mount -t proc proc "$root/proc" && mount --rbind /dev "$root/dev" && mount --rbind /sys "$root/sys"
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    # Networks may have certificates of their own.
    cp "${SSL_CERT_FILE-/etc/ssl/certs/ca-certificates.crt}" "$root/certificates.crt"
}

# fresh SYSTEM: a layer with this machine's toolchain (read-only).
fresh() {
    layer "$1"
    mkdir -p "$root"/root/{.rustup,.cargo/registry}
    mount --bind "$RUSTUP" "$root/root/.rustup" && mount -o remount,ro,bind "$root/root/.rustup"
    # A copy, as `cargo install` adds to it.
    cp -a "$CARGO/bin" "$root/root/.cargo"
    mount --bind "$CARGO/registry" "$root/root/.cargo/registry"
}

# inside FOLDER COMMAND, as on a machine that has just been installed: by root, or by `user`.
inside() {
    chroot --userspec="${user-root}" "$root" env -i HOME="${user+/home}/${user-root}" TERM=dumb LANG=C.UTF-8 \
        DEBIAN_FRONTEND=noninteractive PIP_CERT=/certificates.crt CARGO_HTTP_CAINFO=/certificates.crt OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
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

# The build and what follows it: the cells of `built`.
build() {
    local cell=- packages build scenes=- own=- same=- test=- validate=- container=- versions
    fresh "$system"
    step git / 'apt-get -q update; apt-get install -qy --no-install-recommends ca-certificates git make'
    git clone -q . "$root/src"
    step packages /src 'make deps' && packages=$cell
    step build /src 'make build' && build=$cell
    versions=$(inside / 'dpkg-query -W -f "\${Version} " petsc-dev libopenmpi-dev gmsh |
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
    built=$(printf ' %s |' "$versions" "$packages" "$build" "$scenes" "$same" "$own" "$test" "$validate" "$container" \
        "$(date +%F)")
}

# The wheel, by a user without root, where Python is all that is installed: pictures, scenes, reports, the notebook. The cells of
# `packed`.
wheel() {
    local cell pictures same user
    layer "$system"
    step python / 'apt-get -q update; apt-get install -qy --no-install-recommends python3-venv; useradd -m student'
    mkdir "$root/home/student/meshes"
    cp target/wheels/*.whl geo/*.{geo,toml,ipynb} tests/cli/class.py "$root/home/student"
    cp "$CHROOTS"/meshes/* "$root/home/student/meshes"
    chroot "$root" chown -R student /home/student
    user=student
    step wheel /home/student 'python3 -m venv sig; sig/bin/pip install *.whl
        sig/bin/signorini run lshape.toml; sig/bin/signorini plot out/lshape'
    pictures=$cell
    step wheel-scenes /home/student 'sig/bin/pip check
        for scene in *.toml; do sig/bin/signorini run $scene; done; sig/bin/signorini report --pdf out/lshape'
    [[ $cell != failed* ]] || pictures=$cell
    step wheel-same /home/student 'for mesh in meshes/*; do name=$(basename $mesh .msh)
        sig/bin/signorini run $name.toml --mesh $mesh --out same/$name; done'
    same=$("${PYTHON-/usr/bin/python3}" validation/systems.py out "$root/home/student/same")
    step wheel-class /home/student 'sig/bin/pip install "$(echo *.whl)[class]"
        sig/bin/python3 class.py class.ipynb | tee class.txt; grep -q "^9 17 17 \[\]$" class.txt'
    [[ $cell != failed* ]] || pictures=$cell
    packed=$(printf ' %s |' "$pictures" "$same" "$(date +%F)")
}

# Its row: the name, and the cells of `build` and `wheel`.
run_system() {
    local root= name built packed row
    bare "$system" || return 0
    name=$(. "$CHROOTS/$system/etc/os-release" && echo $NAME ${VERSION_ID-} "($system)")
    grep -qF "| $name |" INSTALL.md || sed -i "/^<!-- end of systems/i| $name |$(printf ' - |%.0s' {1..13})" INSTALL.md
    row=$(grep -F "| $name |" INSTALL.md)
    built=$(cut -d '|' -f 3-12 <<<"$row")'|' packed=$(cut -d '|' -f 13-15 <<<"$row")'|'
    if [ "$STEPS" != wheel ]; then build; fi
    if wants wheel; then wheel; fi
    row="| $name |$built$packed"
    sed -i "\@^| $name |@c${row//\\/\\\\}" INSTALL.md
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

meshes
[ $# -gt 0 ] || set -- bookworm trixie sid noble resolute
for system; do run_system; done
