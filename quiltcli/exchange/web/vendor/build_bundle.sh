#!/usr/bin/env bash
# Makes three.bundle.js anew, in a temporary folder; needs npm and its registry. See README.md.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y > /dev/null
npm install --no-audit --no-fund three@0.187.0 esbuild@0.28.2
cp "$here/three.entry.js" entry.js
notice="/*! three.js 0.187.0, bundled by esbuild from three.entry.js
$(cat node_modules/three/LICENSE)
*/"
npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 \
	--charset=utf8 --legal-comments=none --banner:js="$notice" --outfile="$here/three.bundle.js"
cp node_modules/three/LICENSE "$here/LICENSE.three.txt"
(cd "$here" && sha256sum three.bundle.js > three.bundle.js.sha256)
