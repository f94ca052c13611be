#!/usr/bin/env bash
# Packs stacks beside zstd, and prints the tables of docs/pack.md. Sizes are in MB (1e6 bytes); CPU is
# user + system seconds of all threads, the median of five runs (zstd -19: one). Needs GNU time and zstd.
#
#   benches/packing.sh [STACK.tif ...]     default: the blade mould in 100 um at 1500 dpi and 635 layers of
#                                          25 um at 2400 dpi, alone and in the alpha machine's mesh
#
# LAMP=path/to/lamp takes a binary that is built already.
set -euo pipefail
top=$(cd "$(dirname "$0")/.." && pwd)
if [ -z "${LAMP:-}" ]; then
    cargo build --release --quiet --manifest-path "$top/Cargo.toml" -p lamp-cli
    LAMP=$top/target/release/lamp
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [ $# -eq 0 ]; then
    "$LAMP" sample blade --facets 750k -q -o "$work/blade.stl"
    "$LAMP" slice "$work/blade.stl" --dpi 1500 --thickness 100um -q -o "$work/blade_100um.tif"
    "$LAMP" slice "$work/blade.stl" --dpi 2400 --thickness 25um --layers 2000..2635 -q -o "$work/blade_25um.tif"
    for part in blade_100um blade_25um; do
        "$LAMP" tile "$work/$part.tif" --machine alpha -q -o "$work/${part}_mesh.tif"
    done
    set -- "$work"/blade_100um.tif "$work"/blade_25um.tif "$work"/blade_100um_mesh.tif "$work"/blade_25um_mesh.tif
fi

cpu() { # cpu RUNS COMMAND...: the median of CPU seconds
    local runs=$1
    shift
    for _ in $(seq "$runs"); do
        /usr/bin/time -f '%U %S' -o "$work/time" "$@" >/dev/null
        awk '{print $1 + $2}' "$work/time"
    done | sort -n | sed -n "$(((runs + 1) / 2))p"
}

size() { awk -v b="$(stat -c %s "$1")" 'BEGIN {printf "%.2f", b / 1e6}'; }

echo '| stack | TIFF | zstd -3 / -19 --long=27 | packed, level 1 / usual / 19 | TIFF / packed | CPU of zstd -19 | of packing | of reading the TIFF | of reading it packed |'
echo '|---|---|---|---|---|---|---|---|---|'
for stack in "$@"; do
    zstd -q -f -3 --long=27 "$stack" -o "$work/3.zst"
    slow=$(cpu 1 zstd -q -f -19 --long=27 "$stack" -o "$work/19.zst")
    for level in 1 19; do "$LAMP" pack "$stack" -q --level $level -o "$work/$level.lamp"; done
    packing=$(cpu 5 "$LAMP" pack "$stack" -q -o "$work/usual.lamp")
    "$LAMP" convert "$work/usual.lamp" -q -o "$work/back.tif"
    same=$("$LAMP" convert "$stack" -q | cmp - "$work/back.tif" && echo same)
    [ "$same" = same ] || { echo "$stack does not come back" >&2 && exit 1; }
    tiff=$(cpu 5 "$LAMP" verify "$stack" -q)
    packed=$(cpu 5 "$LAMP" verify "$work/usual.lamp" -q)
    ratio=$(awk -v a="$(stat -c %s "$stack")" -v b="$(stat -c %s "$work/usual.lamp")" 'BEGIN {printf "%.1f", a / b}')
    echo "| $(basename "$stack" .tif) | $(size "$stack") | $(size "$work/3.zst") / $(size "$work/19.zst") |" \
        "$(size "$work/1.lamp") / $(size "$work/usual.lamp") / $(size "$work/19.lamp") | $ratio |" \
        "$slow s | $packing s | $tiff s | $packed s |"
done
