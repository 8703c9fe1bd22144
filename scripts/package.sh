#!/usr/bin/env bash
# package.sh PROGRAM FOLDER: writes what a package has beside the program: manual pages, completions, guides, licences, changelog.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$1 folder=$2

rm -rf "$folder"
mkdir -p "$folder"/{man,bash,zsh,fish}
python=${PYTHON:-/usr/bin/python3}
"$python" scripts/pages.py "$folder/pages"
"$python" scripts/notices.py >"$folder/NOTICES"
"$program" man "$folder/man"
# The options of these commands are those of Python programs. roff(7): lines must not begin with a point, dashes are escaped.
for name in compare info plot report study table view; do
    {
        printf '.SH ARGUMENTS\n.nf\n'
        COLUMNS=80 "$program" "$name" --help | sed 's/\\/\\e/g; s/-/\\-/g; s/^[.'\'']/\\\&&/'
        printf '.fi\n'
    } >>"$folder/man/signorini-$name.1"
done
"$program" completions bash >"$folder/bash/signorini"
"$program" completions zsh >"$folder/zsh/_signorini"
"$program" completions fish >"$folder/fish/signorini.fish"
# A paragraph of its own is indented, an empty line is a point (DEP 5).
{
    cat <<END
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: signorini

Files: *
Copyright: 2026 The authors of signorini
License: MIT or Apache-2.0
Comment: The program contains CHOLMOD's supernodal part and crates under Apache-2.0 alone. It is as a whole under the GPL, version 3 or
 later: /usr/share/common-licenses/GPL-3. The file NOTICES in this folder has the licences of all libraries and crates.

License: Apache-2.0
 The text is in /usr/share/common-licenses/Apache-2.0.

License: MIT
END
    sed 's/^$/./; s/^/ /' LICENSE-MIT
} >"$folder/copyright"
gzip -9n <CHANGELOG.md >"$folder/changelog.gz"
# Debian's form of the version, 0.3.0~dev before 0.3.0, and of its date: that of the release in CHANGELOG.md, `## 1.2.3 (2026-01-31)`,
# otherwise that of the commit (deb-changelog(5)).
version=$(sed -n '/^version = "/{s/.*"\(.*\)"/\1/p;q}' Cargo.toml)
day=$(sed -n "s/^## $version (\(.*\))/\1/p" CHANGELOG.md)
[ -n "$day" ] || day=$(git log -1 --format=%cs 2>/dev/null || date +%F)
maintainer=$(sed -n 's/^maintainer = "\(.*\)"/\1/p' Cargo.toml)
printf 'signorini (%s-1) unstable; urgency=medium\n\n  * See changelog.gz in this folder.\n\n -- %s  %s\n' \
    "${version/-/\~}" "$maintainer" "$(LC_ALL=C date --utc --date "$day" '+%a, %d %b %Y %H:%M:%S %z')" >"$folder/changelog.Debian"
