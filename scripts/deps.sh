#!/usr/bin/env bash
# deps.sh PACKAGE…: installs the Debian packages that are missing, and looks for a Rust
# toolchain. Says nothing when all is there. On a system without dpkg, or with DEPS=none, it names the
# packages, and the build then reports what it does not find.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() {
    printf 'error: %s\n' "$@" >&2
    exit 1
}

# First, because it is the one thing not installed here.
wanted=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
advice="install Rust $wanted or newer from https://rustup.rs:
    curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
command -v cargo >/dev/null || fail "cargo was not found; $advice"
found=$(cargo --version | cut -d' ' -f2)
printf '%s\n' "$wanted" "${found%%-*}" | sort -CV || fail "cargo is version $found; $advice"

if [ "${DEPS:-}" = none ] || ! command -v dpkg-query >/dev/null; then
    echo "note: nothing is installed here; needed is the content of these Debian packages (INSTALL.md): $*" >&2
    exit 0
fi
installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null || true)
missing=()
for package; do
    grep -qx "installed $package" <<<"$installed" || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

install=(apt-get install -y --no-install-recommends "${missing[@]}")
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    # Without a terminal nobody can type the password.
    if ! command -v sudo >/dev/null || { [ ! -t 0 ] && ! sudo -n true 2>/dev/null; }; then
        fail "packages are missing; as root, run: apt-get update && ${install[*]}
(or without root, with libraries of your own: make DEPS=none …, see INSTALL.md)"
    fi
    as_root=(sudo)
fi
echo "installing: ${missing[*]}"
# Another apt may be at work on a machine that has just started: wait for it.
as_root+=(env DEBIAN_FRONTEND=noninteractive)
wait=(-o DPkg::Lock::Timeout=300)
"${as_root[@]}" apt-get "${wait[@]}" -q update
"${as_root[@]}" "${install[@]}" "${wait[@]}" -q
