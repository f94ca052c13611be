#!/usr/bin/env bash
# Times the whole job beside other programs on the same files, and prints the
# table of benches/README.md. CPU is user + system seconds; each figure is the
# median of five runs. Needs GNU time; a peer that is not installed is left out.
#
#   benches/compare.sh [FACETS ...]        default: 100k 750k 5.5M
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --quiet -p lamp-cli
bin=$PWD/target/release
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# cpu COMMAND...: median CPU seconds and peak memory in MB of five runs
cpu() {
    for _ in 1 2 3 4 5; do
        /usr/bin/time -f '%U %S %M' -o "$work/time" "$@" >/dev/null
        awk '{print $1 + $2, $3 / 1000}' "$work/time"
    done | sort -n | sed -n 3p
}

row() { # row NAME CPU MB PEER_CPU
    awk -v n="$1" -v c="$2" -v m="$3" -v p="$4" \
        'BEGIN {printf "| %s | %.2f s | %.0f MB | %.2f |\n", n, c, m, c / p}'
}

[ $# -gt 0 ] || set -- 100k 750k 5.5M
for count in "$@"; do
    "$bin/lamp" sample blade --facets "$count" -o "$work/blade.stl" --quiet
    echo
    echo "### Blade mould, $count facets, 1500 dpi, 100 um"
    echo
    echo "| command | CPU | peak memory | CPU / that of the first |"
    echo "|---|---|---|---|"
    read -r base base_mb < <(cpu sha256sum "$work/blade.stl")
    row "\`sha256sum blade.stl\`" "$base" "$base_mb" "$base"
    for option in "" "--memory 64MB" "--memory 16MB"; do
        # shellcheck disable=SC2086
        read -r c mb < <(cpu "$bin/slice" "$work/blade.stl" $option -o "$work/blade.tif")
        row "\`slice blade.stl${option:+ $option}\`" "$c" "$mb" "$base"
    done
    echo
    echo "| the stack again | CPU | peak memory | CPU / that of the first |"
    echo "|---|---|---|---|"
    base=
    if command -v tiffcp >/dev/null; then
        read -r base base_mb < <(cpu tiffcp -c g4 "$work/blade.tif" "$work/copy.tif")
        row "\`tiffcp -c g4\` (libtiff: decode and encode)" "$base" "$base_mb" "$base"
    fi
    read -r c mb < <(cpu "$bin/fix" "$work/blade.tif" -o "$work/copy.tif")
    row "\`fix\` (decode, check and encode)" "$c" "$mb" "${base:-$c}"
    read -r c mb < <(cpu "$bin/tile" "$work/blade.tif" -o "$work/copy.tif")
    row "\`tile\` (decode, place and encode)" "$c" "$mb" "${base:-$c}"
done
