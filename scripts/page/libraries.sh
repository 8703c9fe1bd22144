#!/bin/sh
# Bundles the libraries of package.json into libraries.js and libraries.css, with their licences.
set -e
cd "$(dirname "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp package.json libraries.in.js "$work"
(cd "$work" && npm install --no-audit --no-fund --no-package-lock --silent)
modules=$work/node_modules
version() { node -p "require('$modules/$1/package.json').version"; }
{
    echo "/* twgl.js $(version twgl.js)"
    cat "$modules/twgl.js/LICENSE.md"
    echo "uPlot $(version uplot)"
    cat "$modules/uplot/LICENSE"
    echo "*/"
    "$modules/.bin/esbuild" "$work/libraries.in.js" --bundle --minify --format=iife --global-name=libraries \
        --legal-comments=none
} > "$work/libraries.js"
mv "$work/libraries.js" libraries.js
{ echo "/* uPlot $(version uplot); its licence is in libraries.js. */"; cat "$modules/uplot/dist/uPlot.min.css"; } > libraries.css
